#include "client/gltf/primitive_triangles.h"

#include <numeric>
#include <string>

namespace radbake::gltf {

std::size_t num_triangles_of(int mode, std::size_t num_corners) {
  if (mode == kModeTriangles) return num_corners / 3;
  if (mode != kModeTriangleStrip && mode != kModeTriangleFan) return 0;
  return num_corners < 3 ? 0 : num_corners - 2;
}

Result<std::vector<std::array<std::uint32_t, 3>>> primitive_triangles(int mode, std::span<const std::uint32_t> corners,
                                                                      std::size_t num_vertices) {
  const std::size_t n = corners.size();
  if (mode < kModeTriangles || mode > kModeTriangleFan) {
    return invalid_argument("mode " + std::to_string(mode) + " has no triangles");
  }
  if (mode == kModeTriangles && n % 3 != 0) {
    return invalid_argument("a list of triangles has " + std::to_string(n) + " corners, not a multiple of three");
  }
  if (mode != kModeTriangles && (n == 1 || n == 2)) {
    return invalid_argument(std::string("a triangle ") + (mode == kModeTriangleStrip ? "strip" : "fan") + " has " +
                            std::to_string(n) + " corners, fewer than three");
  }
  for (std::size_t i = 0; i < n; ++i) {
    if (corners[i] < num_vertices) continue;
    return invalid_argument("index " + std::to_string(corners[i]) + " at corner " + std::to_string(i) +
                            " is out of range, its primitive has " + std::to_string(num_vertices) + " vertices");
  }
  std::vector<std::array<std::uint32_t, 3>> triangles(num_triangles_of(mode, n));
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    switch (mode) {
      case kModeTriangles: triangles[i] = {corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]}; break;
      // Every second triangle of a strip turns the other way.
      case kModeTriangleStrip: triangles[i] = {corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2]}; break;
      default: triangles[i] = {corners[i + 1], corners[i + 2], corners[0]};
    }
  }
  return triangles;
}

std::vector<std::uint32_t> consecutive_corners(std::size_t num_vertices) {
  std::vector<std::uint32_t> corners(num_vertices);
  std::iota(corners.begin(), corners.end(), 0u);
  return corners;
}

}  // namespace radbake::gltf
