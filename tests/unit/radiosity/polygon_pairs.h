#pragma once

#include <string>
#include <vector>

#include "server/radiosity/form_factor/analytic.h"

namespace radbake::radiosity {

/// Two polygons, what stands between them, and their form factor to 12 digits or more.
struct PolygonPair {
  std::string id;
  PolygonCorners from, to;
  std::vector<PolygonCorners> occluders;
  double exact = 0;
};

/// The pairs of tests/reference whose id starts so. Fails the test where there are not `count` of them.
std::vector<PolygonPair> reference_pairs(const std::string& prefix, std::size_t count = 1);

/// polygon_form_factor(), which must not refuse and must state an error that holds.
PolygonFormFactor measured(const PolygonPair& pair, double tolerance);
PolygonFormFactor measured(const PolygonCorners& from, const PolygonCorners& to,
                           const std::vector<PolygonCorners>& occluders, double tolerance);

/// The largest |F - exact| of pairs, which is also recorded under the test's name.
double largest_error(const std::vector<PolygonPair>& pairs, double tolerance);

/// A parallelogram that faces along cross(u, v).
PolygonCorners parallelogram(Vec3 corner, Vec3 u, Vec3 v);
PolygonCorners turned_over(const PolygonCorners& corners);
double area_of(const PolygonCorners& corners);

/// Howell's C-11: parallel equal rectangles a x b at distance c.
double parallel_rectangles(double a, double b, double c);

/// Howell's C-14: perpendicular rectangles w x l and h x l that share the edge l.
double perpendicular_rectangles(double w, double h, double l);

/// From a point to a rectangle in a parallel plane at distance c; x and y relative to the foot of its normal.
///
///   F = sum of four corners, 1/(2 pi)[ X/sqrt(1+X^2) atan(Y/sqrt(1+X^2)) + Y/sqrt(1+Y^2) atan(X/sqrt(1+Y^2)) ]
double point_to_parallel_rectangle(double x0, double x1, double y0, double y1, double c);

}  // namespace radbake::radiosity
