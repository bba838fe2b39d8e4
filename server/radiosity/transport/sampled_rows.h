#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace radbake::radiosity {

/// Rows as they were sampled: integer counts, so nothing depends on an order of summation.
/// Shapes: all [n] but entries; row i is entries [first[i], first[i + 1]), ascending by patch.
struct SampledRows {
  struct Entry {
    std::uint32_t patch;
    std::uint32_t count;
  };
  std::vector<std::uint64_t> first;
  std::vector<Entry> entries;
  std::vector<std::uint32_t> counted;   ///< rays of the row
  std::vector<std::uint32_t> escaped;   ///< of them, into the open
  std::vector<std::uint32_t> absorbed;  ///< of them, at backs of single-sided surfaces
  std::vector<double> areas;            ///< visible areas

  std::size_t size() const { return areas.size(); }
};

}  // namespace radbake::radiosity
