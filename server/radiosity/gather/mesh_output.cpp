#include "server/radiosity/gather/mesh_output.h"

#include <map>
#include <utility>

#include "server/radiosity/survey/mesh_edges.h"

namespace radbake::radiosity {
namespace {

/// What copies of a vertex differ by: chart and vertex group.
using Side = std::pair<std::uint32_t, std::uint32_t>;

MeshOutput make_output(const Surfaces& surfaces, std::uint32_t m, const MeshRange& range, const Layout* layout,
                       const VertexLight* light) {
  const Mesh& mesh = surfaces.scene->meshes[m];
  MeshOutput out;
  if (layout != nullptr) out.placement = layout->meshes[m];
  const bool is_unwrapped = out.placement.source == UvSource::kUnwrapped;
  const auto num_own = static_cast<std::uint32_t>(mesh.positions.size());
  out.num_vertices = num_own;

  // Give each corner a vertex: the first side of a vertex is the vertex, further sides are copies.
  std::vector<std::array<std::uint32_t, 3>> triangles = mesh.triangles;
  std::vector<std::uint32_t> sources(num_own);
  for (std::uint32_t v = 0; v < num_own; ++v) sources[v] = v;
  std::vector<std::uint8_t> is_used(num_own, 0);
  std::vector<Side> first_side(num_own);
  std::map<std::pair<std::uint32_t, Side>, std::uint32_t> copies;
  struct Corner {
    std::uint32_t triangle = 0;
    int corner = 0;
  };
  std::vector<Corner> shown_by(num_own);  // a corner that each vertex takes its values from
  for (std::uint32_t t = range.begin; t < range.end; ++t) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = surfaces.vertices(t)[k];
      const Side side{is_unwrapped ? layout->chart_of[t] : kNoChart,
                      light != nullptr ? light->groups.of_corner[t][k] : kNoGroup};
      std::uint32_t own = v;
      if (!is_used[v]) {
        is_used[v] = 1;
        first_side[v] = side;
        shown_by[v] = {t, k};
      } else if (first_side[v] != side) {
        const auto [copy, is_new] = copies.emplace(std::pair(v, side), static_cast<std::uint32_t>(sources.size()));
        own = copy->second;
        if (is_new) {
          sources.push_back(v);
          shown_by.push_back({t, k});
        }
      }
      triangles[surfaces.in_mesh[t]][k] = own;
    }
  }
  is_used.resize(sources.size(), 1);

  const std::size_t n = sources.size();
  if (n > num_own) {
    out.source_vertices = std::move(sources);
    out.triangles = std::move(triangles);
    out.num_vertices = static_cast<std::uint32_t>(n);
  }
  if (is_unwrapped) out.uvs.assign(n, {0, 0});
  if (light != nullptr) out.irradiance.assign(n, {0, 0, 0});
  for (std::size_t v = 0; v < n; ++v) {
    if (!is_used[v]) continue;
    const auto& [t, k] = shown_by[v];
    if (is_unwrapped) {
      const Vec2 uv = layout->uv_of(t, k, out.placement.sheet);
      out.uvs[v] = {static_cast<float>(uv.x), static_cast<float>(uv.y)};
    }
    if (light != nullptr) {
      const Vec3 h = light->irradiance[light->groups.of_corner[t][k]];
      out.irradiance[v] = {static_cast<float>(h.x), static_cast<float>(h.y), static_cast<float>(h.z)};
    }
  }
  return out;
}

}  // namespace

std::vector<MeshOutput> make_mesh_outputs(const Surfaces& surfaces, const Layout* layout, const VertexLight* light) {
  const std::vector<MeshRange> ranges = mesh_ranges(surfaces);
  std::vector<MeshOutput> outputs;
  outputs.reserve(ranges.size());
  for (std::uint32_t m = 0; m < ranges.size(); ++m) {
    outputs.push_back(make_output(surfaces, m, ranges[m], layout, light));
  }
  return outputs;
}

}  // namespace radbake::radiosity
