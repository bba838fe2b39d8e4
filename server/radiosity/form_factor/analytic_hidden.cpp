#include <algorithm>
#include <limits>

#include "server/radiosity/form_factor/analytic_lines.h"
#include "server/radiosity/form_factor/analytic_pair.h"

namespace radbake::radiosity {
namespace {

// More chains than this, or than leave each so many evaluations, are not counted.
constexpr std::size_t kMostChains = 256;
constexpr long kLeastEvaluationsOfChain = 100;
// How much polygons shrink for general position: a part in 3e10, but at least so much that rounding stays a small part
// of it. Each by its own multiple, by the golden ratio: equal steps would leave what lies in one plane in one plane.
constexpr double kShrinkage = 0x1p-35, kShrinkageOverRounding = 0x1p-46;

double shrinkage_of(const PolygonCorners& corners, std::size_t place) {
  const double inradius = 2 * polygon_area(corners) / perimeter(corners);
  const double turns = 0.6180339887 * static_cast<double>(place);
  return (1 + turns - std::floor(turns)) * std::max(kShrinkage, kShrinkageOverRounding / inradius);
}

/// Walks over the chains of occluders that lines pass one after the other.
class Chains {
 public:
  Chains(std::span<const Passing> passings, double tolerance, long most)
      : passings_(passings),
        tolerance_(tolerance),
        most_(most),
        most_chains_(std::min(kMostChains, static_cast<std::size_t>(most / kLeastEvaluationsOfChain))) {}

  Exchange add_up() {
    if (passings_.size() > most_chains_) return {0, std::numeric_limits<double>::infinity(), 0};
    for (std::uint32_t k = 0; k < passings_.size(); ++k) extend({}, k);
    if (chains_.size() > most_chains_) return {0, std::numeric_limits<double>::infinity(), 0};
    Exchange sum;
    for (const Chain& chain : chains_) {
      const Exchange one = exchange_of(chain);
      sum.value += chain.passed.size() % 2 == 1 ? one.value : -one.value;
      sum.error += one.error;
      sum.evaluations += one.evaluations;
    }
    return sum;
  }

 private:
  struct Chain {
    std::vector<std::uint32_t> passed;
    std::vector<PolygonCorners> polygons;  ///< p, what is passed, q
  };

  /// Lets the lines of a chain pass one occluder more, if any can, and goes on from there.
  void extend(const Chain& before, std::uint32_t k) {
    if (chains_.size() > most_chains_) return;
    const Passing& next = passings_[k];
    for (const std::uint32_t j : before.passed) {
      if (passings_[j].item == next.item) return;
    }
    Chain chain;
    if (before.passed.empty()) {
      chain = {{k}, {next.p, next.between, next.q}};
    } else {
      chain = before;
      chain.passed.push_back(k);
      chain.polygons.insert(chain.polygons.end() - 1, next.between);
      PolygonCorners clipped;
      const auto clip = [&](PolygonCorners& corners, const HalfSpace& inside) {
        clip_convex(corners, inside, clipped);
        corners.swap(clipped);
        return !corners.empty();
      };
      const std::size_t last = chain.polygons.size() - 1;
      for (std::size_t i = 0; i + 1 < last; ++i) {
        if (!clip(chain.polygons[i], next.ahead.reversed())) return;
      }
      if (!clip(chain.polygons[last], next.ahead)) return;
      for (const std::uint32_t j : before.passed) {
        if (!clip(chain.polygons[last - 1], passings_[j].ahead)) return;
      }
      if (!may_pass_all(chain.polygons)) return;
    }
    chains_.push_back(chain);
    for (std::uint32_t j = 0; j < passings_.size(); ++j) extend(chain, j);
  }

  /// Whether lines through two polygons may meet the third, for all threes with the last occluder among them.
  static bool may_pass_all(const std::vector<PolygonCorners>& polygons) {
    const std::size_t added = polygons.size() - 2;
    for (std::size_t i = 0; i < polygons.size(); ++i) {
      for (std::size_t j = i + 1; j < polygons.size(); ++j) {
        for (std::size_t m = 0; m < polygons.size(); ++m) {
          if (m == i || m == j || (i != added && j != added && m != added)) continue;
          if (passage_of(polygons[i], polygons[j], polygons[m]) == Passage::kBeside) return false;
        }
      }
    }
    return true;
  }

  Exchange exchange_of(const Chain& chain) const {
    const PolygonCorners &p = chain.polygons.front(), &q = chain.polygons.back();
    std::vector<PolygonCorners> polygons;
    double moved = 0;
    for (std::size_t i = 0; i < chain.polygons.size(); ++i) {
      const PolygonCorners& corners = chain.polygons[i];
      const double share = shrinkage_of(corners, i);
      polygons.push_back(shrunk(corners, share));
      const double distance = share * radius_about(mean_corner(corners), corners);
      moved += std::min(movement_error(corners, distance, p), movement_error(corners, distance, q));
    }
    Exchange exchange = crossing_exchange(polygons, tolerance_ / static_cast<double>(chains_.size()),
                                          most_ / static_cast<long>(chains_.size()));
    exchange.error += moved;
    return exchange;
  }

  std::span<const Passing> passings_;
  double tolerance_;
  long most_;
  std::size_t most_chains_;
  std::vector<Chain> chains_;
};

}  // namespace

Exchange hidden_exchange(std::span<const Passing> passings, double tolerance, long most) {
  return Chains(passings, tolerance, most).add_up();
}

}  // namespace radbake::radiosity
