#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <stop_token>
#include <unordered_map>
#include <vector>

#include "common/base/sequence.h"
#include "server/radiosity/survey/surfaces.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

inline constexpr std::uint32_t kNoPatch = 0xffffffffu;

struct PatchOptions {
  double edge = 0;              ///< wanted length of a patch's side, scene units
  std::size_t max_patches = 0;  ///< bound on the number of patches, both sides of sheets counted
  std::stop_token stop = {};    ///< stopped early, the patches mean nothing
};

/// The senders: surface elements of constant radiosity, and the look-up from a hit to its element.
///
/// Neighbouring triangles of one material within 20 degrees form a group. A group is cut by a regular grid in its plane
/// (by layers of height too, where it is curved): each occupied cell is a patch, so large triangles are split and
/// small ones merged by one rule. Groups smaller than a cell that the bound does not allow apart are merged by
/// position and direction. A cell that another surface touches or crosses is cut along that contact, so that no patch
/// lies on both sides of a wall. A double-sided cell has a patch on each side, with the same area.
/// Indices: front patches first, one a (part of a) cell, in the order of the triangles; back patches after them.
class Patches {
 public:
  /// A convex part of a triangle inside a cell, as one triangle of a fan.
  struct Piece {
    std::uint32_t triangle;
    std::array<Vec2, 3> corners;  ///< barycentric weights (u, v)
    double area_up_to;            ///< running sum over the cell's pieces, this one included
  };

  std::size_t size() const { return areas_.size(); }
  /// Patches on front sides.
  std::size_t num_cells() const { return first_piece_.size() - 1; }
  /// Cells that a contact crosses but that the bound on patches did not allow to cut.
  std::size_t num_uncut() const { return num_uncut_; }

  /// Scene units squared.
  double area(std::uint32_t patch) const { return areas_[patch]; }
  bool is_back(std::uint32_t patch) const { return patch >= num_cells(); }
  /// The front of a back patch, or the patch itself.
  std::uint32_t front_of(std::uint32_t patch) const {
    return is_back(patch) ? cell_of_back_[patch - num_cells()] : patch;
  }
  /// The back of a front patch, or kNoPatch where the surface is single-sided.
  std::uint32_t back_of(std::uint32_t front) const { return back_of_cell_[front]; }

  /// The triangles that a front patch consists of, counter-clockwise seen from the front.
  std::span<const Piece> pieces(std::uint32_t front) const {
    return std::span(pieces_).subspan(first_piece_[front], first_piece_[front + 1] - first_piece_[front]);
  }

  /// The patch that a ray meets, or kNoPatch at the back of a single-sided surface.
  /// Preconditions: u, v within the triangle up to rounding.
  std::uint32_t find(std::uint32_t triangle, double u, double v, bool is_back) const;

  /// The patch that a ray of this direction (unit length) met, or kNoPatch at the back of a single-sided surface.
  ///
  /// Looked up where the ray was still a little above the surface: single precision may let a ray pass the foot of a
  /// wall that stands there, and then its hit lies on the wrong side of the contact by as much.
  std::uint32_t met_by(const Hit& hit, Vec3 direction, const Surfaces& surfaces) const;

  /// met_by(), and whether the ray met a back: the same answer, sooner where no contact or border of a patch is near.
  struct Meeting {
    std::uint32_t patch;
    bool is_back;
  };
  Meeting meet(const Hit& hit, const std::array<float, 3>& direction, const Surfaces& surfaces) const;

  /// Has the memory fetch early what meet() will read of a triangle. Precondition: not kNoHit.
  void expect(std::uint32_t triangle) const { __builtin_prefetch(&quick_maps_[triangle]); }

  /// A point of the patch, uniform by area for uniform (x, y) in the unit square; continuous within a piece.
  SurfacePoint sample(std::uint32_t patch, double x, double y) const;

  /// For each patch, one that stands for the patch twice as large that it is a part of: 2 x 2 cells of its grid (2 x 2
  /// x 2 where it is curved), on the same side. Parts of a cell that a contact cuts stay apart. Shapes: [size()].
  std::vector<std::uint32_t> twice_as_large() const;

  /// The direction that a point of this patch faces: the triangle's normal, turned for back patches.
  Vec3 normal(std::uint32_t patch, const SurfacePoint& p, const Surfaces& surfaces) const {
    return is_back(patch) ? -surfaces.normals[p.triangle] : surfaces.normals[p.triangle];
  }

 private:
  friend class PatchBuilder;
  friend class ContactCutter;

  /// The grid of a group: grid coordinates of a triangle's points are affine in (u, v).
  struct Grid {
    std::array<std::int32_t, 3> cells = {1, 1, 1};
    std::uint64_t dense_at = 0;  ///< into dense_, where the grid is small; else sparse_
    bool is_dense = true;
  };
  struct GridMap {
    Vec3 origin, per_u, per_v;
  };
  struct SparseCell {
    std::uint32_t group;
    std::uint64_t flat;
    bool operator==(const SparseCell&) const = default;
  };
  struct SparseCellHash {
    std::size_t operator()(const SparseCell& c) const { return mixed_bits(mixed_bits(c.group) ^ c.flat); }
  };

  /// A straight contact with another surface, in grid coordinates: normal . (x, y) = offset.
  struct Cut {
    Vec2 normal;
    double offset;
    bool is_beyond(Vec3 grid) const { return normal.x * grid.x + normal.y * grid.y > offset; }
  };

  /// What meet() reads of a triangle, in one line of the cache.
  struct alignas(64) QuickMap {
    std::array<float, 3> normal;
    std::array<float, 2> origin, per_u, per_v;  ///< of grid coordinates
    float shift = 0;  ///< how far along the grid met_by() may go back for a ray along the normal; infinite: ask it
    std::array<std::int32_t, 2> cells;
    std::uint32_t dense_at = 0;
  };
  void make_quick_maps(const Surfaces& surfaces);

  std::uint32_t part_at(std::uint32_t cell, Vec3 grid) const;
  /// The cell of a triangle at a place of its grid, or kNoPatch.
  std::uint32_t cell_of(std::uint32_t triangle, Vec3 grid) const;
  std::uint32_t cell_at(std::uint32_t group, const std::array<std::int32_t, 3>& at) const;
  static std::uint64_t flat_index(const Grid& grid, const std::array<std::int32_t, 3>& at) {
    return (static_cast<std::uint64_t>(at[2]) * grid.cells[1] + at[1]) * static_cast<std::uint64_t>(grid.cells[0]) +
           at[0];
  }

  // A grid cell without cuts is one front patch; with cuts it is one for each combination of sides that occurs.
  std::vector<std::uint32_t> first_part_;  ///< [grid cells + 1], into part_sides_ = front patches
  std::vector<std::uint32_t> part_sides_;  ///< [front patches] bit k: beyond cut k; ascending within a grid cell
  std::vector<std::uint32_t> first_cut_;   ///< [grid cells + 1]
  std::vector<Cut> cuts_;
  std::size_t num_uncut_ = 0;

  std::vector<double> areas_;
  std::vector<std::uint64_t> first_piece_;  ///< [num_cells + 1]
  std::vector<Piece> pieces_;
  std::vector<std::uint32_t> back_of_cell_;   ///< [num_cells], kNoPatch: single-sided
  std::vector<std::uint32_t> cell_of_back_;   ///< [size() - num_cells()]
  std::vector<std::uint32_t> group_of_;       ///< [triangles]
  std::vector<GridMap> maps_;                 ///< [triangles]
  std::vector<std::array<Vec3, 2>> weights_;  ///< [triangles] gradients of u and v over space
  std::vector<std::uint32_t> some_cell_;      ///< [triangles] a cell of it, for hits that round out of all
  std::vector<Grid> grids_;                   ///< [groups]
  std::vector<QuickMap> quick_maps_;          ///< [triangles]
  std::vector<std::uint32_t> dense_;
  std::unordered_map<SparseCell, std::uint32_t, SparseCellHash> sparse_;
};

/// Cuts surfaces into patches of about the wanted edge, coarser where the bound asks for it.
///
/// A quarter of the bound is kept for cuts along contacts.
/// Errors: none; the bound holds for max_patches >= 64 (checked).
Patches make_patches(const Surfaces& surfaces, const Visibility& visibility, const PatchOptions& options);

}  // namespace radbake::radiosity
