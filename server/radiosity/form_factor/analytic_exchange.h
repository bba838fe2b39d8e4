#pragma once

#include <span>

#include "server/radiosity/form_factor/analytic_polygon.h"

namespace radbake::radiosity {

/// A F of two pieces: the same from both sides. Units: length squared.
struct Exchange {
  double value = 0;
  double error = 0;
  long evaluations = 0;
};

/// Exchange of two unoccluded pieces by Stokes' theorem.
///
///   A F = 1/(2 pi) oint oint ln r dr.dr' = 1/(2 pi) sum over pairs of edges u.u' int int ln r ds ds'
///   int ln r ds' = [ t/2 ln(t^2 + d^2) - t + d atan(t/d) ],  t along the inner edge, d the distance from its line
///
/// The outer integral: Gauss rules of 8 and 16 points where they agree; else tanh-sinh between the points of closest
/// approach, which takes the edges that the patches share in its stride: there ln r is singular at the ends only.
/// Errors: two rules a pair of edges, plus rounding of the sum. Precondition: each piece in front of the other.
/// Source: Schroeder & Hanrahan 1993 (eq. 3); Takahasi & Mori 1974 (tanh-sinh).
Exchange contour_exchange(const Piece& p, const Piece& q);

/// Exchange of two unoccluded pieces far from each other, by Gauss rules on both: A F = 1/pi int int cos cos' / r^2.
/// No term is negative, so nothing cancels. Errors: two orders that agree, plus rounding.
/// Precondition: is_far(p, q), each piece in front of the other.
Exchange kernel_exchange(const Piece& p, const Piece& q);
/// Whether the kernel converges by 5 digits or more for each 3 points a side: centres 3 times the sizes' sum apart.
bool is_far(const Piece& p, const Piece& q);

/// Exchange of two pieces behind convex occluders, by Lambert's formula of the part of `inner` that is visible from a
/// point, integrated over `outer`.
///
///   A F = int_outer 1/(2 pi) sum over visible parts, edges of gamma n.c/|c| dA
///
/// Visible from a point: `inner` less the part in the pyramid over an occluder and behind its plane. The outer integral
/// halves the triangle with the largest difference of two rules (7 and 16 points) until four times the sum is below the
/// tolerance; it cuts along visibility events, the lines where the plane of an edge and a corner meets the outer one.
/// Shapes: occluders [k], may be empty.
/// Units:  tolerance in those of A F.
/// Errors: precondition: each piece in front of the other. The error is above the tolerance after `most` evaluations.
/// Source: Lambert 1760; Baum, Rushmeier & Winget 1989; Walton 2002 (NISTIR 6925).
Exchange visible_exchange(const Piece& outer, const Piece& inner, std::span<const Piece> occluders, double tolerance,
                          long most);

}  // namespace radbake::radiosity
