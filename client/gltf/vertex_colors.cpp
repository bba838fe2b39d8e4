#include "client/gltf/vertex_colors.h"

#include <algorithm>
#include <cmath>

#include "client/gltf/weld_vertices.h"

namespace radbake::gltf {

void drop_white_colors(Mesh& mesh) {
  const auto is_white = [](Vec3 color) { return color == Vec3{1, 1, 1}; };
  if (std::all_of(mesh.colors.begin(), mesh.colors.end(), is_white)) mesh.colors.clear();
}

double limit_colors(Mesh& mesh, const MaterialFacts& facts, double max_reflectance) {
  const Vec3 factor = facts.untextured, limited = facts.limited;
  if (mesh.colors.empty() || facts.limited_share == 0 || factor == Vec3{}) return facts.limited_share;
  // Where a vertex is above the limit, its triangles are counted whole.
  const auto is_above = [&](std::uint32_t vertex) {
    return max_component(scaled_by(factor, mesh.colors[vertex])) > max_reflectance;
  };
  double limited_area = 0, area = 0;
  for (const auto& triangle : mesh.triangles) {
    const double triangle_area = length(area_vector(mesh, triangle));
    area += triangle_area;
    if (std::any_of(triangle.begin(), triangle.end(), is_above)) limited_area += triangle_area;
  }
  for (Vec3& color : mesh.colors) {
    for (int c = 0; c < 3; ++c) {
      if (limited[c] > 0) color[c] = std::fmin(color[c] * factor[c] / limited[c], 1.0);
    }
  }
  return area > 0 ? limited_area / area : 0;
}

}  // namespace radbake::gltf
