#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/radiosity/form_factor/analytic_occluders.h"
#include "server/radiosity/patches/patches.h"

namespace radbake::radiosity {

/// Joins convex pieces that share an edge and lie in one plane, as long as what comes out is convex.
///
/// Corners nearer than 2^-44 count as one. Pieces keep the order of the first of what they were joined from;
/// came_from[k] is the index, in what is returned, of piece k of the input.
std::vector<Piece> joined_pieces(const std::vector<Piece>& pieces, std::vector<std::uint32_t>& came_from);

/// Patches and surfaces as planar convex polygons, in the coordinates of the surfaces.
///
/// The parts of triangles that make up a patch are joined where that gives convex polygons: a cell of a flat wall is
/// one, a curved patch several. So are the triangles of the scene, as occluders: those that close around a convex body
/// are known to. Parts narrower than rounding have no plane and are left out, with their area.
class PatchPolygons {
 public:
  PatchPolygons(const Surfaces& surfaces, const Patches& patches);

  /// The polygons of a front patch, facing as it does.
  std::span<const Piece> of(std::uint32_t front) const {
    return std::span(pieces_).subspan(first_[front], first_[front + 1] - first_[front]);
  }
  /// The same, facing backwards.
  std::span<const Piece> back_of(std::uint32_t front) const {
    return std::span(backs_).subspan(first_[front], first_[front + 1] - first_[front]);
  }

  const Occluders& occluders() const { return occluders_; }
  /// The occluder that a triangle is part of, or kNoBody where it is narrower than rounding.
  std::uint32_t occluder_of(std::uint32_t triangle) const { return occluder_of_[triangle]; }

 private:
  std::vector<std::size_t> first_;
  std::vector<Piece> pieces_, backs_;
  std::vector<std::uint32_t> occluder_of_;
  Occluders occluders_;
};

}  // namespace radbake::radiosity
