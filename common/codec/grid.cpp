#include "common/codec/grid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace radbake {
namespace {

constexpr int kMaxBits = 24;
// Far inside float32's exponents, so that neither the step nor its inverse leaves them.
constexpr int kMaxExponent = 100;

struct Bounds {
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3 lower{kInfinity, kInfinity, kInfinity};
  Vec3 upper{-kInfinity, -kInfinity, -kInfinity};
};

/// Bounds of the vertices that triangles use.
Bounds bounds_of(const Scene& scene) {
  Bounds bounds;
  for (const Mesh& mesh : scene.meshes) {
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t vertex : triangle) {
        for (int axis = 0; axis < 3; ++axis) {
          bounds.lower[axis] = std::min(bounds.lower[axis], mesh.positions[vertex][axis]);
          bounds.upper[axis] = std::max(bounds.upper[axis], mesh.positions[vertex][axis]);
        }
      }
    }
  }
  return bounds;
}

/// Texel of every triangle with an area, in metres.
std::vector<double> texel_sizes(const Scene& scene, int atlas_size, double texels_per_meter) {
  std::vector<double> sizes;
  for (const Mesh& mesh : scene.meshes) {
    for (const auto& [a, b, c] : mesh.triangles) {
      const Vec3 p = mesh.positions[a];
      const double area = length(cross(mesh.positions[b] - p, mesh.positions[c] - p));
      if (!(area > 0)) continue;
      double size = 1 / texels_per_meter;
      if (atlas_size > 0 && !mesh.texcoord1.empty()) {
        const Vec2 t = mesh.texcoord1[a];
        const double uv_area = std::abs(cross(mesh.texcoord1[b] - t, mesh.texcoord1[c] - t));
        // A triangle without a place in the layout says nothing about its texels.
        if (uv_area > 0) size = std::sqrt(area / uv_area) / atlas_size;
      }
      sizes.push_back(size);
    }
  }
  return sizes;
}

}  // namespace

float Grid::round(double x) const { return static_cast<float>(is_quantised() ? std::nearbyint(x / step) * step : x); }

Grid choose_grid(double extent, double max_move) {
  // Rounding moves a coordinate by at most half a step.
  const int exponent = std::ilogb(2 * max_move);
  if (!(max_move > 0) || std::abs(exponent) > kMaxExponent) return {};
  const double step = std::ldexp(1.0, exponent);

  // Fewest bits that hold the sign and the largest index; one more index for an origin that is rounded, too.
  const double largest = std::ceil(extent / step) + 1;
  for (int bits = 2; bits <= kMaxBits; ++bits) {
    if (largest < std::ldexp(1.0, bits - 1)) return {step, bits};
  }
  return {};
}

Result<PositionGrid> choose_position_grid(const Scene& scene, int atlas_size, double texels_per_meter) {
  std::vector<double> sizes = texel_sizes(scene, atlas_size, texels_per_meter);
  if (sizes.empty()) return invalid_argument("the scene has no triangle with an area");
  const auto percentile = sizes.begin() + static_cast<std::ptrdiff_t>((sizes.size() - 1) / 20);
  std::nth_element(sizes.begin(), percentile, sizes.end());

  PositionGrid result;
  result.texel_size = *percentile;
  const Bounds bounds = bounds_of(scene);
  const double extent = max_component(bounds.upper * 0.5 - bounds.lower * 0.5);
  if (!(extent < std::numeric_limits<float>::max())) {
    return invalid_argument("the scene is " + std::to_string(2 * extent) + " m long: too long for float32 positions");
  }

  // The move of a position is at most sqrt(3) times that of a coordinate.
  result.grid = choose_grid(extent, kPositionMoveTexels * result.texel_size / std::sqrt(3.0));

  // Round the origin to the lattice, or to float32's spacing at the edge of the scene: then coordinates that lie on
  // it in the world are exact relative to the origin as well.
  const double step = result.grid.is_quantised() ? result.grid.step : std::ldexp(1.0, std::ilogb(extent) - 23);
  for (int axis = 0; axis < 3; ++axis) {
    const double centre = bounds.lower[axis] * 0.5 + bounds.upper[axis] * 0.5;
    const double rounded = std::nearbyint(centre / step) * step;
    result.origin[axis] = std::isfinite(rounded) ? rounded : centre;
  }
  return result;
}

}  // namespace radbake
