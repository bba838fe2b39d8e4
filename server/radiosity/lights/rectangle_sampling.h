#pragma once

#include "common/geometry/vector.h"

namespace radbake::radiosity {

/// A rectangle seen from a point, sampled uniformly over the solid angle that it subtends.
///
/// Units:  any one unit; solid angle in steradian.
/// Errors: solid angles below kMinSolidAngle lose digits and count as none: sample the area then.
/// Source: Urena, Fajardo & King 2013, "An area-preserving parametrization for spherical rectangles".
class SphericalRectangle {
 public:
  static constexpr double kMinSolidAngle = 1e-5;

  /// corner + a s + b t, s orthogonal to t.
  SphericalRectangle(Vec3 corner, Vec3 s, Vec3 t, Vec3 viewer);

  double solid_angle() const { return solid_angle_; }

  struct Sample {
    double a = 0, b = 0;  ///< 0..1 along s and t
    Vec3 direction;       ///< from the viewer to the point, not normalised
  };
  /// For uniform (x, y) in the unit square. Precondition: solid_angle() > 0.
  Sample sample(double x, double y) const;

 private:
  Vec3 along_x_, along_y_, along_z_;  ///< unit vectors: of s, of t, and away from the viewer
  double x0_ = 0, x1_ = 0, y0_ = 0, y1_ = 0, z0_ = 0;
  double b0_ = 0, b1_ = 0, k_ = 0, solid_angle_ = 0;
};

}  // namespace radbake::radiosity
