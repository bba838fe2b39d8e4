#include "server/radiosity/survey/mesh_edges.h"

#include <algorithm>
#include <numeric>
#include <tuple>

namespace radbake::radiosity {

std::vector<MeshRange> mesh_ranges(const Surfaces& surfaces) {
  std::vector<MeshRange> ranges(surfaces.scene->meshes.size());
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    MeshRange& range = ranges[surfaces.meshes[t]];
    if (range.end == 0) range.begin = t;
    range.end = t + 1;
  }
  return ranges;
}

std::vector<SharedEdge> shared_edges(const Surfaces& surfaces, std::uint32_t begin, std::uint32_t end) {
  // Number the corners by position.
  std::vector<std::uint32_t> by_position(3 * std::size_t{end - begin});
  std::iota(by_position.begin(), by_position.end(), 0);
  const auto position = [&](std::uint32_t corner) { return surfaces.corners[begin + corner / 3][corner % 3]; };
  const auto key = [&](std::uint32_t corner) {
    const Vec3 p = position(corner);
    return std::tuple(p.x, p.y, p.z);
  };
  std::sort(by_position.begin(), by_position.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::vector<std::uint32_t> place(by_position.size());
  std::uint32_t num_places = 0;
  for (std::size_t i = 0; i < by_position.size(); ++i) {
    if (i > 0 && key(by_position[i]) != key(by_position[i - 1])) ++num_places;
    place[by_position[i]] = num_places;
  }

  // Bring equal edges together.
  struct Edge {
    std::uint32_t low, high, triangle;
    int edge;
    bool is_forward;
  };
  std::vector<Edge> edges;
  for (std::uint32_t t = 0; t < end - begin; ++t) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = place[3 * t + k], to = place[3 * t + (k + 1) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), begin + t, k, from < to});
    }
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high, a.triangle, a.edge) < std::tie(b.low, b.high, b.triangle, b.edge);
  });
  std::vector<SharedEdge> shared;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t j = i;
    while (j < edges.size() && edges[j].low == edges[i].low && edges[j].high == edges[i].high) ++j;
    if (j == i + 2 && edges[i].is_forward != edges[i + 1].is_forward && edges[i].triangle != edges[i + 1].triangle) {
      shared.push_back({edges[i].triangle, edges[i + 1].triangle, edges[i].edge, edges[i + 1].edge});
    }
    i = j;
  }
  std::sort(shared.begin(), shared.end(),
            [](const SharedEdge& a, const SharedEdge& b) { return std::tie(a.a, a.b) < std::tie(b.a, b.b); });
  return shared;
}

}  // namespace radbake::radiosity
