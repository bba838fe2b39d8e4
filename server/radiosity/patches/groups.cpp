#include "server/radiosity/patches/groups.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "common/base/sequence.h"

namespace radbake::radiosity {
namespace {

/// Normals of one group differ from its first by at most this: the projection to a plane shrinks areas by 6 % at most.
const double kMinCosine = std::cos(20 * std::numbers::pi / 180);

/// An undirected edge of a triangle, by a hash of its two end positions.
struct Edge {
  std::uint64_t key;
  std::uint32_t triangle;
};

std::uint64_t position_hash(Vec3 p) {
  // Adding zero makes -0 and 0 one position.
  std::uint64_t hash = mixed_bits(std::bit_cast<std::uint64_t>(p.x + 0.0));
  hash = mixed_bits(hash ^ std::bit_cast<std::uint64_t>(p.y + 0.0));
  return mixed_bits(hash ^ std::bit_cast<std::uint64_t>(p.z + 0.0));
}

std::vector<Edge> edges_by_key(const Surfaces& surfaces) {
  std::vector<Edge> edges;
  edges.reserve(3 * surfaces.size());
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    std::array<std::uint64_t, 3> corner;
    for (int k = 0; k < 3; ++k) corner[k] = position_hash(surfaces.corners[t][k]);
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t a = corner[k], b = corner[(k + 1) % 3];
      edges.push_back({mixed_bits(std::min(a, b)) ^ std::max(a, b), t});
    }
  }
  std::sort(edges.begin(), edges.end(),
            [](const Edge& a, const Edge& b) { return a.key != b.key ? a.key < b.key : a.triangle < b.triangle; });
  return edges;
}

}  // namespace

SurfaceGroups group_surfaces(const Surfaces& surfaces) {
  // Triangles that share an edge, as lists: neighbours of t are neighbours[first[t] .. first[t + 1]).
  const std::vector<Edge> edges = edges_by_key(surfaces);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && edges[end].key == edges[i].key) ++end;
    // A chain through all triangles at an edge connects them; pairs of all with all would be quadratic.
    for (std::size_t k = i + 1; k < end; ++k) {
      pairs.emplace_back(edges[k - 1].triangle, edges[k].triangle);
      pairs.emplace_back(edges[k].triangle, edges[k - 1].triangle);
    }
    i = end;
  }
  std::sort(pairs.begin(), pairs.end());

  SurfaceGroups groups;
  constexpr std::uint32_t kNone = 0xffffffffu;
  groups.group_of.assign(surfaces.size(), kNone);
  std::vector<std::size_t> first(surfaces.size() + 1, 0);
  for (const auto& pair : pairs) ++first[pair.first + 1];
  for (std::size_t t = 0; t < surfaces.size(); ++t) first[t + 1] += first[t];

  // Flood from each triangle that has no group yet.
  std::vector<std::uint32_t> open;
  for (std::uint32_t seed = 0; seed < surfaces.size(); ++seed) {
    if (groups.group_of[seed] != kNone) continue;
    const std::uint32_t group = groups.num_groups++;
    const int material = surfaces.mesh(seed).material;
    groups.group_of[seed] = group;
    open.assign(1, seed);
    while (!open.empty()) {
      const std::uint32_t t = open.back();
      open.pop_back();
      for (std::size_t k = first[t]; k < first[t + 1]; ++k) {
        const std::uint32_t next = pairs[k].second;
        if (groups.group_of[next] != kNone || surfaces.mesh(next).material != material) continue;
        if (surfaces.is_emitter[next] != surfaces.is_emitter[seed]) continue;
        if (dot(surfaces.normals[next], surfaces.normals[seed]) < kMinCosine) continue;
        groups.group_of[next] = group;
        open.push_back(next);
      }
    }
  }
  return groups;
}

}  // namespace radbake::radiosity
