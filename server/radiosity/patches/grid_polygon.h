#pragma once

#include <array>
#include <vector>

#include "common/geometry/vector.h"

namespace radbake::radiosity {

/// A corner of a part of a triangle: barycentric weights, and coordinates in the grid of its group.
struct GridCorner {
  Vec2 uv;
  Vec3 grid;
};
using GridPolygon = std::vector<GridCorner>;

inline double signed_area(Vec2 a, Vec2 b, Vec2 c) { return cross(b - a, c - a) / 2; }

/// Area as a share of twice the triangle's.
inline double area_in_uv(const GridPolygon& polygon) {
  double area = 0;
  for (std::size_t k = 2; k < polygon.size(); ++k) area += signed_area(polygon[0].uv, polygon[k - 1].uv, polygon[k].uv);
  return area;
}

/// The part of a convex polygon where distance(grid) >= 0; distance is affine. Source: Sutherland & Hodgman 1974.
template <typename Distance>
GridPolygon clipped(const GridPolygon& polygon, const Distance& distance) {
  GridPolygon inside;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const GridCorner& a = polygon[k];
    const GridCorner& b = polygon[(k + 1) % polygon.size()];
    const double da = distance(a.grid), db = distance(b.grid);
    if (da >= 0) inside.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) {
      const double t = da / (da - db);
      inside.push_back({a.uv + (b.uv - a.uv) * t, a.grid + (b.grid - a.grid) * t});
    }
  }
  if (inside.size() < 3) inside.clear();
  return inside;
}

/// The part where sign * (grid[axis] - bound) >= 0.
inline GridPolygon clipped_to_axis(const GridPolygon& polygon, int axis, double bound, double sign) {
  return clipped(polygon, [=](Vec3 grid) { return sign * (grid[axis] - bound); });
}

}  // namespace radbake::radiosity
