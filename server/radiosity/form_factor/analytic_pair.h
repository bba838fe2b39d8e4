#pragma once

#include <cstdint>
#include <span>

#include "server/radiosity/form_factor/analytic_exchange.h"
#include "server/radiosity/form_factor/analytic_occluders.h"

namespace radbake::radiosity {

inline constexpr long kMostPairEvaluations = 4'000'000;

/// A F between two convex pieces, how it was found and how far from exact it may be.
struct PairExchange : Exchange {
  AnalyticMethod method = AnalyticMethod::kZero;
};

/// A F of two convex pieces behind those occluders of which `candidates` are the indices.
///
/// Clips each piece to the front of the other and finds which candidates reach the lines between them, then the first
/// that fits: nothing left 0; nothing between, the kernel or the contour; else the open value less what the occluders
/// hide, by pairs of edges (hidden_exchange), over parts where bodies hold some of a piece or occluders are too many.
/// Where that has too few digits, the value is the outer integral over what is visible, within what is known for
/// certain. The error includes corners known to 8 ulp. A difference that is not above its error is 0.
///
/// Units:  tolerance in those of A F; it bounds the error of occluded pairs, unless `most` evaluations end it.
/// Errors: precondition: the pieces do not coincide face to face; candidates hold every occluder between them.
/// Occluders
///         in the plane of a piece count for nothing here.
PairExchange pair_exchange(const Piece& whole_p, const Piece& whole_q, const Occluders& occluders,
                           std::span<const std::uint32_t> candidates, double tolerance,
                           long most = kMostPairEvaluations);

/// Light from p to q that passes through one occluder: parts of the pieces on its two sides, and its part between them.
/// All three counter-clockwise about the lines from p to q.
struct Passing {
  PolygonCorners p, between, q;
  HalfSpace ahead;         ///< where lines go to when they have passed
  std::uint32_t item = 0;  ///< occluders of one body, or the two sides of one polygon, have one item
  std::uint32_t occluder = 0;
  bool is_whole = false;   ///< p and q are all of the pieces
  bool hides_all = false;  ///< all lines from p to q pass through it
};

struct Passings {
  std::vector<Passing> all;              ///< no two of them in one plane overlap
  std::vector<std::uint32_t> in_shaft;   ///< occluders that reach the lines between p and q
  bool hides_all = false;                ///< one occluder is enough, or one piece is in a body and the other out of it
  std::uint32_t tangled_body = kNoBody;  ///< one that holds a part of a piece; then `all` means nothing
};

/// Finds the light from p to q that passes through each occluder. Of a body only the faces count where lines enter it,
/// or where they leave it if they start inside.
/// Precondition: each piece in front of the other.
Passings find_passings(const Piece& p, const Piece& q, const Occluders& occluders,
                       std::span<const std::uint32_t> candidates);

/// A F of the lines from p to q that pass through any occluder: inclusion and exclusion over the chains of occluders of
/// different items that lines pass one after the other.
/// Errors: the error is infinite where there are too many chains.
Exchange hidden_exchange(std::span<const Passing> passings, double tolerance, long most);

/// How much A F can change while the corners of `moved` move by at most `near`.
///
///   |d(A F)| <= near sum over edges of length min(1, A_seen/(pi d^2)),  d: the least distance of edge and `seen`
///
/// The light of `seen` is a field without sources, at most 1: its flux through a polygon depends on the outline only.
double movement_error(const PolygonCorners& moved, double near, const PolygonCorners& seen);

}  // namespace radbake::radiosity
