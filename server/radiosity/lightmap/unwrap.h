#pragma once

#include <cstdint>
#include <vector>

#include "server/radiosity/lightmap/plane_triangles.h"
#include "server/radiosity/survey/surfaces.h"

namespace radbake::radiosity {

/// No direction in any triangle is stretched by more than this against the mean of its object, or by less than its
/// inverse.
inline constexpr double kMaxStretch = 1.2;

/// A piece of a mesh laid flat, without overlap.
struct Chart {
  std::vector<std::uint32_t> triangles;
  Vec3 u, v;           ///< position -> (dot(u, p), dot(v, p)) - low, in scene units
  Vec2 low;            ///< lower left corner of the chart's box before the subtraction
  Vec2 size;           ///< of the box, scene units; size.x >= size.y
  double stretch = 1;  ///< largest of s and 1/s over the scales s along any direction in any triangle

  PlaneTriangle corners(const Surfaces& surfaces, std::uint32_t triangle) const {
    PlaneTriangle flat;
    for (int k = 0; k < 3; ++k) {
      const Vec3 p = surfaces.corners[triangle][k];
      flat[k] = Vec2{dot(u, p), dot(v, p)} - low;
    }
    return flat;
  }
};

/// Lays triangles [begin, end) of a mesh flat: clusters of neighbours that face about one way are projected along their
/// axis, turned so that their box is the smallest, and cut where they would lie on themselves.
///
/// A triangle at angle t to the axis is shortened to cos t along one direction and kept along the other. Charts are
/// enlarged by 1 / sqrt(min cos t), so a scale s lies within [sqrt(cos t), 1 / sqrt(cos t)]; half angles of at most
/// acos(1 / 1.2^2) = 46 degrees keep it below kMaxStretch. A chart that fills its box badly is cut where that saves
/// room, the margin around each part counted.
/// Units: margin in scene units, around every chart.
std::vector<Chart> unwrap(const Surfaces& surfaces, std::uint32_t begin, std::uint32_t end, double margin);

}  // namespace radbake::radiosity
