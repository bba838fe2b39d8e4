#pragma once

#include <array>

#include "common/geometry/vector.h"

namespace radbake::radiosity {

/// A point on a triangle seen from elsewhere.
struct TriangleSample {
  double u = 0, v = 0;     ///< barycentric weights of the second and third corner
  Vec3 direction;          ///< from the viewer to the point, not normalised
  double solid_angle = 0;  ///< of what was sampled: 1 / density over directions; 0: no such point
};

/// Chooses a point of a triangle for a uniform (x, y) in the unit square: uniform over the solid angle that the
/// triangle subtends where that is wide, else uniform over its area (with the solid angle's density, cos A / r^2).
///
/// Units:  any one unit; solid angle in steradian.
/// Errors: relative 1e-12 in the density (the narrow branch takes over where the wide one loses digits).
/// Source: Arvo 1995, "Stratified sampling of spherical triangles".
TriangleSample sampled_triangle(const std::array<Vec3, 3>& corners, Vec3 normal, double area, Vec3 viewer, double x,
                                double y);

}  // namespace radbake::radiosity
