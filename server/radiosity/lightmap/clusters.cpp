#include "server/radiosity/lightmap/clusters.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <queue>
#include <tuple>
#include <unordered_set>

#include "common/base/sequence.h"
#include "server/radiosity/survey/mesh_edges.h"

namespace radbake::radiosity {
namespace {

/// How much an uncompact shape counts beside a wide angle (squared): a disc's 1 as much as 6 degrees.
constexpr double kShapeWeight = 0.01;
/// Cones around cones are tightened where they are wider than this share of what is allowed.
constexpr double kLooseShare = 0.5;
/// A pair whose cost has grown by less since it was queued is merged as it is.
constexpr double kStaleTolerance = 1.0 + 1e-9;

double angle_between(Vec3 a, Vec3 b) { return std::atan2(length(cross(a, b)), dot(a, b)); }

/// Directions within half_angle of an axis.
struct Cone {
  Vec3 axis;
  double half_angle = 0;
};

/// The smallest cone around two.
Cone around(const Cone& a, const Cone& b) {
  const Cone &wide = a.half_angle >= b.half_angle ? a : b, &narrow = a.half_angle >= b.half_angle ? b : a;
  const double between = angle_between(wide.axis, narrow.axis);
  if (between + narrow.half_angle <= wide.half_angle) return wide;
  const double half_angle = (wide.half_angle + between + narrow.half_angle) / 2;
  if (half_angle >= std::numbers::pi) return {wide.axis, std::numbers::pi};
  // Turn the wide axis towards the narrow one.
  const Vec3 across = narrow.axis - wide.axis * dot(wide.axis, narrow.axis);
  const double turn = half_angle - wide.half_angle;
  if (length(across) == 0) return {wide.axis, half_angle};
  return {normalized(wide.axis * std::cos(turn) + normalized(across) * std::sin(turn)), half_angle};
}

/// What is known of a cluster while it grows; sums over its triangles.
struct Growing {
  Cone cone;
  double area = 0;
  Vec3 moment;               ///< sum area * centroid
  double second_moment = 0;  ///< sum area * |centroid|^2, and of each triangle about its own
  std::uint32_t version = 0;
  std::uint32_t last = 0;  ///< of its chain of triangles

  /// 1 for a disc, more for anything longer: the variance of its points over that of a disc of its area.
  double shape() const {
    const double variance = second_moment / area - dot(moment, moment) / (area * area);
    return std::max(variance, 0.0) * 2 * std::numbers::pi / area;
  }
  double cost() const { return cone.half_angle * cone.half_angle + kShapeWeight * shape(); }
};

class Clustering {
 public:
  Clustering(const Surfaces& surfaces, std::uint32_t begin, std::uint32_t end, double max_half_angle, double max_fold)
      : surfaces_(surfaces), begin_(begin), max_half_angle_(max_half_angle), max_fold_(max_fold) {
    const std::uint32_t n = end - begin;
    parent_.resize(n);
    std::iota(parent_.begin(), parent_.end(), 0);
    next_.assign(n, kEnd);
    for (std::uint32_t t = begin; t < end; ++t) {
      const auto& c = surfaces.corners[t];
      const double area = surfaces.areas[t];
      const Vec3 centroid = (c[0] + c[1] + c[2]) / 3;
      // The variance of a triangle's points is a twelfth of its corners' squared distances from the centroid.
      double own = 0;
      for (const Vec3 corner : c) own += dot(corner - centroid, corner - centroid) / 12;
      growing_.push_back(
          {{surfaces.normals[t], 0}, area, centroid * area, area * (dot(centroid, centroid) + own), 0, t - begin});
    }
  }

  /// Merges the cheapest pair first, as long as there is one.
  void merge_all(std::uint32_t end) {
    for (const SharedEdge& edge : shared_edges(surfaces_, begin_, end)) {
      if (angle_between(surfaces_.normals[edge.a], surfaces_.normals[edge.b]) > max_fold_) continue;
      const std::uint32_t a = edge.a - begin_, b = edge.b - begin_;
      queue_.emplace(joined(a, b).cost(), std::min(a, b), std::max(a, b));
    }
    while (!queue_.empty()) {
      const auto [queued_cost, a, b] = queue_.top();
      queue_.pop();
      const std::uint32_t first = std::min(root(a), root(b)), second = std::max(root(a), root(b));
      if (first == second) continue;
      const bool is_as_queued = first == a && second == b;
      // Many edges lie between two clusters: their pair is judged once as they grow.
      if (!is_as_queued && !judged_.insert({first, second, growing_[first].version, growing_[second].version}).second) {
        continue;
      }
      const Growing both = joined(first, second);
      if (both.cone.half_angle > max_half_angle_) continue;
      if (both.cost() > queued_cost * kStaleTolerance) {
        queue_.emplace(both.cost(), first, second);
        continue;
      }
      parent_[second] = first;
      next_[growing_[first].last] = second;
      growing_[first] = both;
    }
  }

  /// In the order of their first triangles.
  std::vector<Cluster> clusters() {
    std::vector<std::uint32_t> cluster_of(parent_.size());
    std::vector<Cluster> clusters;
    for (std::uint32_t t = 0; t < parent_.size(); ++t) {
      const std::uint32_t own = root(t);
      if (own == t) {
        cluster_of[t] = static_cast<std::uint32_t>(clusters.size());
        clusters.push_back({{}, growing_[t].cone.axis, growing_[t].cone.half_angle});
      }
      clusters[cluster_of[own]].triangles.push_back(begin_ + t);
    }
    return clusters;
  }

 private:
  static constexpr std::uint32_t kEnd = std::numeric_limits<std::uint32_t>::max();
  using Pair = std::tuple<double, std::uint32_t, std::uint32_t>;
  using Judged = std::array<std::uint32_t, 4>;
  struct JudgedHash {
    std::size_t operator()(const Judged& j) const {
      return mixed_bits(mixed_bits(std::uint64_t{j[0]} << 32 | j[1]) ^ (std::uint64_t{j[2]} << 32 | j[3]));
    }
  };

  /// Union-find, the smaller index is the root.
  std::uint32_t root(std::uint32_t t) {
    while (parent_[t] != t) t = parent_[t] = parent_[parent_[t]];
    return t;
  }

  Growing joined(std::uint32_t first, std::uint32_t second) const {
    const Growing &a = growing_[first], &b = growing_[second];
    Growing both{around(a.cone, b.cone),
                 a.area + b.area,
                 a.moment + b.moment,
                 a.second_moment + b.second_moment,
                 std::max(a.version, b.version) + 1,
                 b.last};
    // Cones around cones grow too wide: where that matters, look at all the normals.
    if (both.cone.half_angle > kLooseShare * max_half_angle_) tighten(first, second, both.cone);
    return both;
  }

  /// Moves the axis towards the farthest normal in ever smaller steps. Source: Badoiu & Clarkson 2003.
  void tighten(std::uint32_t first, std::uint32_t second, Cone& cone) const {
    constexpr int kSteps = 12;
    Vec3 axis = cone.axis;
    for (int step = 1;; ++step) {
      double least_cosine = 1;
      Vec3 farthest = axis;
      for (const std::uint32_t chain : {first, second}) {
        for (std::uint32_t t = chain; t != kEnd; t = next_[t]) {
          const Vec3 normal = surfaces_.normals[begin_ + t];
          if (const double cosine = dot(axis, normal); cosine < least_cosine) {
            least_cosine = cosine;
            farthest = normal;
          }
        }
      }
      const double half_angle = std::acos(std::max(least_cosine, -1.0));
      if (half_angle < cone.half_angle) cone = {axis, half_angle};
      if (step > kSteps) return;
      const Vec3 moved = axis + (farthest - axis) / (step + 1);
      if (length(moved) == 0) return;
      axis = normalized(moved);
    }
  }

  const Surfaces& surfaces_;
  std::uint32_t begin_;
  double max_half_angle_, max_fold_;
  std::vector<std::uint32_t> parent_;
  std::vector<std::uint32_t> next_;  ///< chain of a cluster's triangles, from its root
  std::vector<Growing> growing_;     ///< right at roots
  std::priority_queue<Pair, std::vector<Pair>, std::greater<>> queue_;
  std::unordered_set<Judged, JudgedHash> judged_;
};

}  // namespace

std::vector<Cluster> cluster_triangles(const Surfaces& surfaces, std::uint32_t begin, std::uint32_t end,
                                       double max_half_angle, double max_fold) {
  Clustering clustering(surfaces, begin, end, max_half_angle, max_fold);
  clustering.merge_all(end);
  return clustering.clusters();
}

}  // namespace radbake::radiosity
