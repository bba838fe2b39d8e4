#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "common/geometry/vector.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// Half a cube over a point: its pixels, and the share of the light through each that counts at the point.
///
/// The top face z = 1 has r x r pixels, the faces x = +-1 and y = +-1 have r x r/2 each, from the point's plane up.
/// The delta form factor of a pixel is the exact form factor from the point to it, not the product of area and kernel
/// at its centre: second differences over its corners of
///
///   top   G(x, y) = 1/(2 pi) [ x/sqrt(1 + x^2) atan(y/sqrt(1 + x^2)) + y/sqrt(1 + y^2) atan(x/sqrt(1 + y^2)) ]
///   side  G(y, z) = 1/(2 pi) [ atan(y) - 1/sqrt(1 + z^2) atan(y/sqrt(1 + z^2)) ]
///
/// so they sum to 1 up to rounding at any resolution.
/// Shapes: pixels [3 r^2].
/// Units:  directions of unit length about +z; form factors dimensionless.
/// Errors: precondition: resolution even and >= 2. What a pixel shows is decided at its centre: the error of a form
///         factor is at most the delta form factors of the pixels that an outline crosses, O(1/r); O(r^-3/2) in the
///         mean square over turns about the normal.
/// Source: Cohen & Greenberg 1985; Howell C-12 and C-13 of an element to a rectangle (parallel, perpendicular).
class Hemicube {
 public:
  explicit Hemicube(int resolution);

  struct Pixel {
    Vec3 direction;  ///< through its centre
    double form_factor = 0;
  };

  int resolution() const { return resolution_; }
  std::span<const Pixel> pixels() const { return pixels_; }

  /// What is seen through each pixel of a hemicube about a normal, turned about it by an angle.
  /// Shapes: rays and hits, which are replaced, [3 r^2]. Units: normal of unit length, turn in radians.
  void cast(const Visibility& visibility, std::array<float, 3> origin, Vec3 normal, double turn, std::vector<Ray>& rays,
            std::vector<Hit>& hits) const;

 private:
  int resolution_;
  std::vector<Pixel> pixels_;
};

}  // namespace radbake::radiosity
