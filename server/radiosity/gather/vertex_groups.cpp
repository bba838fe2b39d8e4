#include "server/radiosity/gather/vertex_groups.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <tuple>

#include "server/radiosity/survey/mesh_edges.h"

namespace radbake::radiosity {
namespace {

const double kCosineOfCrease = std::cos(40 * std::numbers::pi / 180);

/// Union-find over all corners; the smaller index is the root.
class Sets {
 public:
  explicit Sets(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

/// Joins corners at one place that have about the same normal.
void join_by_normal(const Surfaces& surfaces, const MeshRange& range, Sets& sets) {
  std::vector<std::uint32_t> corners(3 * std::size_t{range.end - range.begin});
  std::iota(corners.begin(), corners.end(), 3 * range.begin);
  const auto key = [&](std::uint32_t corner) {
    const Vec3 p = surfaces.corners[corner / 3][corner % 3];
    return std::tuple(p.x, p.y, p.z, corner);
  };
  std::sort(corners.begin(), corners.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  const auto position = [&](std::uint32_t corner) { return surfaces.corners[corner / 3][corner % 3]; };
  for (std::size_t i = 0; i < corners.size();) {
    // One representative a normal: places where very many corners meet have few normals.
    std::vector<std::pair<Vec3, std::uint32_t>> known;
    std::size_t j = i;
    for (; j < corners.size() && position(corners[j]) == position(corners[i]); ++j) {
      const Vec3 own = surfaces.corner_normal(corners[j] / 3, static_cast<int>(corners[j] % 3));
      const auto same =
          std::find_if(known.begin(), known.end(), [&](const auto& k) { return are_same_normal(k.first, own); });
      if (same == known.end()) {
        known.emplace_back(own, corners[j]);
      } else {
        sets.join(same->second, corners[j]);
      }
    }
    i = j;
  }
}

/// Joins the corners at both ends of every edge that is not sharp.
void join_across_edges(const Surfaces& surfaces, const MeshRange& range, Sets& sets) {
  for (const SharedEdge& edge : shared_edges(surfaces, range.begin, range.end)) {
    if (dot(surfaces.normals[edge.a], surfaces.normals[edge.b]) < kCosineOfCrease) continue;
    // The edge runs the other way round in the second triangle.
    const auto corner = [](std::uint32_t t, int k) { return 3 * t + static_cast<std::uint32_t>(k % 3); };
    sets.join(corner(edge.a, edge.edge_of_a), corner(edge.b, edge.edge_of_b + 1));
    sets.join(corner(edge.a, edge.edge_of_a + 1), corner(edge.b, edge.edge_of_b));
  }
}

}  // namespace

VertexGroups group_vertices(const Surfaces& surfaces) {
  Sets sets(3 * surfaces.size());
  const std::vector<MeshRange> ranges = mesh_ranges(surfaces);
  for (std::size_t m = 0; m < ranges.size(); ++m) {
    if (surfaces.scene->meshes[m].normals.empty()) {
      join_across_edges(surfaces, ranges[m], sets);
    } else {
      join_by_normal(surfaces, ranges[m], sets);
    }
  }
  VertexGroups groups;
  groups.of_corner.resize(surfaces.size());
  std::uint32_t num_groups = 0;
  for (std::uint32_t c = 0; c < 3 * surfaces.size(); ++c) {
    const std::uint32_t root = sets.root(c);
    groups.of_corner[c / 3][c % 3] = root == c ? num_groups++ : groups.of_corner[root / 3][root % 3];
  }
  groups.first_corner.assign(num_groups + 1, 0);
  for (const auto& triangle : groups.of_corner) {
    for (const std::uint32_t group : triangle) ++groups.first_corner[group + 1];
  }
  for (std::uint32_t g = 0; g < num_groups; ++g) groups.first_corner[g + 1] += groups.first_corner[g];
  groups.corners.resize(3 * surfaces.size());
  std::vector<std::uint32_t> next(groups.first_corner.begin(), groups.first_corner.end() - 1);
  for (std::uint32_t c = 0; c < 3 * surfaces.size(); ++c) groups.corners[next[groups.of_corner[c / 3][c % 3]]++] = c;
  return groups;
}

}  // namespace radbake::radiosity
