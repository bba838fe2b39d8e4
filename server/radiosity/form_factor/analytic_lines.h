#pragma once

#include <span>

#include "server/radiosity/form_factor/analytic_exchange.h"

namespace radbake::radiosity {

/// How much of the light between the first and the last of some convex polygons passes through all those between.
///
///   A F = -1/(2 pi) sum over pairs of polygons, of their edges, of  int int a.(I - u u')b ds dt
///   int a.(I - u u')b dt = [ a.b h atan(t/h) - a.h ln r ],  h from the outer point to the inner edge's line
///
/// over those (s, t) whose line, along u from the earlier edge to the later, meets all the other polygons. The measure
/// of lines is the square of a symplectic form, the derivative of a form that vanishes on lines through a straight
/// edge: Stokes' theorem, twice, leaves the lines that touch two edges. No term is singular, however close the edges
/// come. Each condition is the side on which the line passes an edge, bilinear in s and t: the outer integral is cut
/// where two of them, or one and an end of the inner edge, meet, so it is smooth between its cuts, and halved where two
/// Gauss rules differ most until the sum of their differences is below the tolerance.
///
/// Shapes: chain [n], n >= 2, in the order in which the lines meet them, each counter-clockwise about the lines.
/// Units:  tolerance in those of A F.
/// Errors: precondition: general position. Where three edges of different polygons lie in one plane, rounding decides
///         which lines count: see shrunk(). The error is above the tolerance after `most` evaluations beyond the first
///         of each interval.
/// Source: Santalo 1976 (measure of lines); for two polygons it is Schroeder & Hanrahan 1993 (eq. 3), by parts.
Exchange crossing_exchange(std::span<const PolygonCorners> chain, double tolerance, long most);

/// On which sides lines from one convex polygon to another pass the edges of a third.
enum class Passage { kBeside, kPartly, kThrough };
/// All lines miss the polygon by one edge, or all pass through it; else kPartly. Orientations as above.
Passage passage_of(const PolygonCorners& first, const PolygonCorners& last, const PolygonCorners& between);

/// A polygon scaled about its mean corner by 1 - share.
PolygonCorners shrunk(const PolygonCorners& corners, double share);

}  // namespace radbake::radiosity
