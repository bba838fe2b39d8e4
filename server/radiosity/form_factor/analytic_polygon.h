#pragma once

#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/geometry/vector.h"
#include "server/radiosity/form_factor/analytic.h"

namespace radbake::radiosity {

/// A half-space, its inside where distance() > 0. PolygonCorners nearer than snap() count as on its plane.
struct HalfSpace {
  Vec3 point;
  Vec3 normal;            ///< unit
  double near = 0;        ///< snap at the point itself
  double per_length = 0;  ///< how much the snap grows with the distance from the point: the normal's own error

  double distance(Vec3 p) const { return dot(normal, p - point); }
  double snap(Vec3 p) const { return near + per_length * length(p - point); }
  /// -1 outside, 0 on the plane, 1 inside.
  int side(Vec3 p) const {
    const double d = distance(p), s = snap(p);
    return d > s ? 1 : d < -s ? -1 : 0;
  }
  HalfSpace reversed() const { return {point, -normal, near, per_length}; }
};

/// A convex piece of a patch or an occluder and the half-space in front of its plane.
struct Piece {
  PolygonCorners corners;
  HalfSpace front;
};

/// Sum of cross products about the first corner: twice the area along the normal.
Vec3 twice_area_vector(std::span<const Vec3> corners);
inline double polygon_area(std::span<const Vec3> corners) { return length(twice_area_vector(corners)) / 2; }
double perimeter(std::span<const Vec3> corners);
/// The largest distance of a corner from a point.
double radius_about(Vec3 centre, std::span<const Vec3> corners);
Vec3 mean_corner(std::span<const Vec3> corners);

/// The plane of a polygon. Units: ulp and corners in one unit of length; ulp is the spacing of the given coordinates.
/// Errors: kInvalidArgument if the area is zero or a corner is off the plane by more than 8 ulp.
Result<HalfSpace> plane_of(std::span<const Vec3> corners, double ulp, const std::string& name);

/// Cuts a simple polygon into convex pieces: itself, or triangles by cutting ears off.
/// Errors: kInvalidArgument if no ear is left: the outline crosses itself.
/// Source: Meisters 1975.
Result<std::vector<Piece>> convex_pieces(const PolygonCorners& corners, const HalfSpace& front,
                                         const std::string& name);

/// The part of a convex polygon inside a half-space. Empty if no corner is strictly inside.
/// Source: Sutherland & Hodgman 1974.
void clip_convex(const PolygonCorners& corners, const HalfSpace& inside, PolygonCorners& clipped);

/// On which sides of a plane a polygon has corners.
struct Reach {
  bool front = false, back = false;
};
Reach reach_of(std::span<const Vec3> corners, const HalfSpace& plane);

/// clip_convex, or the polygon itself where it reaches no further.
PolygonCorners part_inside(const PolygonCorners& corners, const HalfSpace& inside, bool reaches_outside);

inline PolygonCorners reversed(const PolygonCorners& corners) { return {corners.rbegin(), corners.rend()}; }

/// Takes the intersection of the half-spaces out of convex polygons; what is left is convex polygons again.
void remove_convex(std::vector<PolygonCorners>& polygons, std::span<const HalfSpace> hole);

/// Shortest distance between a point and a segment.
double distance_to_segment(Vec3 p, Vec3 a, Vec3 b);

/// Shortest distance between a point and a convex polygon.
double distance_to_polygon(Vec3 p, const Piece& piece);

}  // namespace radbake::radiosity
