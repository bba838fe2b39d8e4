#pragma once

#include <cstdint>
#include <vector>

namespace radbake::radiosity {

/// Rows as they were estimated: F_ij = weight_ij / counted_i. Numbers of rays where rays were drawn, so that no sum
/// depends on its order.
/// Shapes: all [n] but entries; row i is entries [first[i], first[i + 1]), ascending by patch.
struct EstimatedRows {
  struct Entry {
    std::uint32_t patch;
    float weight;
  };
  std::vector<std::uint64_t> first;
  std::vector<Entry> entries;
  std::vector<double> counted;   ///< rays of the row, or those of an equal variance; 0: there is no row
  std::vector<double> escaped;   ///< of them, into the open
  std::vector<double> absorbed;  ///< of them, at backs of single-sided surfaces
  std::vector<double> areas;     ///< visible areas

  std::size_t size() const { return areas.size(); }

  /// 1 - (escaped + absorbed) / counted: what a repaired row sums to.
  double measured_row_sum(std::uint32_t i) const {
    return counted[i] > 0 ? 1 - (escaped[i] + absorbed[i]) / counted[i] : 0;
  }

  /// What of all rows escaped and was absorbed, weighted by area.
  struct LostShares {
    double escaped = 0, absorbed = 0;
  };
  LostShares lost_shares() const {
    LostShares lost;
    double area = 0;
    for (std::size_t i = 0; i < size(); ++i) {
      if (counted[i] == 0) continue;
      area += areas[i];
      lost.escaped += areas[i] * escaped[i] / counted[i];
      lost.absorbed += areas[i] * absorbed[i] / counted[i];
    }
    if (area > 0) lost = {lost.escaped / area, lost.absorbed / area};
    return lost;
  }
};

}  // namespace radbake::radiosity
