#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/radiosity/form_factor/analytic_polygon.h"

namespace radbake::radiosity {

inline constexpr std::uint32_t kNoBody = 0xffffffffu;

/// Convex polygons that block light from either side, and which of them close around a convex body.
///
/// A line enters a convex body once: what a body hides is the sum of what its faces hide of the lines that come from
/// outside, and no two faces hide the same. Faces of a body face outwards here, whatever they did before.
class Occluders {
 public:
  /// Bodies are groups of pieces, each edge of which exactly two pieces share, corner by corner, and that lie on one
  /// side of each of their planes.
  explicit Occluders(std::vector<Piece> pieces);

  std::span<const Piece> pieces() const { return pieces_; }
  /// Of a piece, or kNoBody.
  std::uint32_t body_of(std::uint32_t piece) const { return body_of_[piece]; }
  /// The pieces that close around a body.
  std::span<const std::uint32_t> faces(std::uint32_t body) const { return bodies_[body]; }

 private:
  std::vector<Piece> pieces_;
  std::vector<std::uint32_t> body_of_;
  std::vector<std::vector<std::uint32_t>> bodies_;
};

/// Where a patch lies to a convex body. A patch on a face lies on the side that it faces.
enum class Place { kOutside, kInside, kAcross };
Place place_of(const Piece& patch, const Occluders& occluders, std::uint32_t body);

}  // namespace radbake::radiosity
