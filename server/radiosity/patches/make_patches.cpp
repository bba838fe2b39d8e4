#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "common/base/check.h"
#include "server/radiosity/patches/contact_cuts.h"
#include "server/radiosity/patches/grid_polygon.h"
#include "server/radiosity/patches/group_planes.h"
#include "server/radiosity/patches/groups.h"
#include "server/radiosity/patches/patches.h"

namespace radbake::radiosity {
namespace {

/// Parts of a triangle smaller than this share of a cell come from rounding at grid lines.
constexpr double kNegligiblePart = 1e-6;
/// Grids with more cells than this for each cell that its surface can fill are kept as a hash table.
constexpr double kMaxDenseWaste = 16;
/// No scene is longer than 2 units: at this edge every group is smaller than a cell.
constexpr double kWholeSceneEdge = 4;

/// Which groups smaller than a cell become one patch.
enum class Merging { kNone, kWithinMaterial, kAcrossMaterials };

}  // namespace

class PatchBuilder {
 public:
  PatchBuilder(const Surfaces& surfaces, const Visibility& visibility, const PatchOptions& options)
      : surfaces_(surfaces),
        visibility_(visibility),
        options_(options),
        groups_(group_surfaces(surfaces)),
        planes_(group_planes(surfaces, groups_)),
        max_uncut_(options.max_patches - options.max_patches / 4) {
    for (const GroupPlane& plane : planes_) num_group_sides_ += sides(plane.first_triangle);
  }

  Patches build() {
    double edge = options_.edge;
    Merging merging = Merging::kNone;
    // Coarsen until the bound holds; where even the groups are too many, merge the smallest.
    while (!try_edge(edge, merging)) {
      if (merging == Merging::kNone && num_group_sides_ > max_uncut_ / 2) {
        merging = Merging::kWithinMaterial;
      } else if (edge >= kWholeSceneEdge) {
        RADBAKE_CHECK(merging != Merging::kAcrossMaterials);
        merging = merging == Merging::kNone ? Merging::kWithinMaterial : Merging::kAcrossMaterials;
      } else {
        const double excess = static_cast<double>(count_) / static_cast<double>(max_uncut_);
        edge = std::min(kWholeSceneEdge, edge * std::clamp(std::sqrt(excess), 1.05, 2.0));
      }
    }
    return std::move(result_);
  }

 private:
  int sides(std::uint32_t triangle) const { return surfaces_.material(triangle).is_double_sided ? 2 : 1; }

  bool is_small(const GroupPlane& plane, double edge) const { return max_component(plane.high - plane.low) <= edge; }

  /// Builds patches of this edge; false where there are more than allowed (count_ then holds at least how many).
  bool try_edge(double edge, Merging merging) {
    result_ = Patches();
    count_ = 0;
    lay_grids(edge, merging);
    cell_of_piece_.clear();
    cell_is_double_sided_.clear();
    for (std::uint32_t t = 0; t < surfaces_.size() && !options_.stop.stop_requested(); ++t) {
      cut_triangle(t);
      if (count_ > 4 * max_uncut_) return false;
    }
    if (count_ > max_uncut_) return false;
    finish();
    return true;
  }

  /// Gives every group its grid, and merged groups a common one of a single cell.
  void lay_grids(double edge, Merging merging) {
    using Key = std::tuple<int, bool, int, std::int64_t, std::int64_t, std::int64_t>;
    std::map<Key, std::uint32_t> merged;
    std::vector<std::uint32_t> grid_of_group(planes_.size());
    cell_size_.clear();
    grid_is_merged_.clear();
    for (std::uint32_t g = 0; g < planes_.size(); ++g) {
      const GroupPlane& plane = planes_[g];
      Patches::Grid grid;
      Vec3 cell_size{1, 1, 1};
      const bool can_merge = merging != Merging::kNone && is_small(plane, edge);
      if (can_merge) {
        const Material& material = surfaces_.material(plane.first_triangle);
        const int own_material = surfaces_.mesh(plane.first_triangle).material;
        const auto voxel = [edge](double x) { return static_cast<std::int64_t>(std::floor((x + 1) / edge)); };
        const Key key{merging == Merging::kWithinMaterial ? own_material : 0,
                      material.is_double_sided,
                      main_direction(plane.axes[2]),
                      voxel(plane.centroid.x),
                      voxel(plane.centroid.y),
                      voxel(plane.centroid.z)};
        const auto [entry, is_new] = merged.try_emplace(key, static_cast<std::uint32_t>(result_.grids_.size()));
        grid_of_group[g] = entry->second;
        if (!is_new) continue;
      } else {
        grid_of_group[g] = static_cast<std::uint32_t>(result_.grids_.size());
        for (int axis = 0; axis < 3; ++axis) {
          const double extent = plane.high[axis] - plane.low[axis];
          grid.cells[axis] = std::max(1, static_cast<std::int32_t>(std::ceil(extent / edge - kNegligiblePart)));
          cell_size[axis] = extent > 0 ? extent / grid.cells[axis] : 1;
        }
      }
      const double num_cells = static_cast<double>(grid.cells[0]) * grid.cells[1] * grid.cells[2];
      grid.is_dense = num_cells <= kMaxDenseWaste * (4 + plane.area / (edge * edge));
      if (grid.is_dense) {
        grid.dense_at = result_.dense_.size();
        result_.dense_.resize(result_.dense_.size() + static_cast<std::size_t>(num_cells), kNoPatch);
      }
      result_.grids_.push_back(grid);
      grid_is_merged_.push_back(can_merge);
      cell_size_.push_back(cell_size);
    }
    result_.group_of_.resize(surfaces_.size());
    for (std::uint32_t t = 0; t < surfaces_.size(); ++t) {
      result_.group_of_[t] = grid_of_group[groups_.group_of[t]];
    }
    result_.maps_.resize(surfaces_.size());
    result_.weights_.resize(surfaces_.size());
    result_.some_cell_.assign(surfaces_.size(), kNoPatch);
  }

  /// 0..5: the axis that a normal is nearest to.
  static int main_direction(Vec3 n) {
    int axis = 0;
    for (int k = 1; k < 3; ++k) {
      if (std::fabs(n[k]) > std::fabs(n[axis])) axis = k;
    }
    return 2 * axis + (n[axis] < 0);
  }

  void cut_triangle(std::uint32_t t) {
    const std::uint32_t g = result_.group_of_[t];
    const bool is_merged = grid_is_merged_[g];
    const GroupPlane& plane = planes_[groups_.group_of[t]];
    const auto& c = surfaces_.corners[t];
    std::array<Vec3, 3> at;
    for (int k = 0; k < 3; ++k) {
      const Vec3 q = plane.coordinates(c[k]) - plane.low;
      at[k] = {q.x / cell_size_[g].x, q.y / cell_size_[g].y, q.z / cell_size_[g].z};
      if (is_merged) at[k] = {0.5, 0.5, 0.5};
    }
    result_.maps_[t] = {at[0], at[1] - at[0], at[2] - at[0]};
    const Vec3 n = surfaces_.normals[t];
    const double twice_area = 2 * surfaces_.areas[t];
    result_.weights_[t] = {cross(c[2] - c[0], n) / twice_area, cross(n, c[1] - c[0]) / twice_area};

    const GridPolygon whole = {{{0, 0}, at[0]}, {{1, 0}, at[1]}, {{0, 1}, at[2]}};
    const double cell_area = cell_size_[g].x * cell_size_[g].y;
    const double negligible = is_merged ? 0 : kNegligiblePart * std::min(cell_area, surfaces_.areas[t]);
    std::array<std::int32_t, 3> index{};
    cut_axis(t, g, whole, 0, index, negligible);
  }

  /// Cuts a polygon along one axis, then its parts along the next; parts of all three become pieces.
  void cut_axis(std::uint32_t t, std::uint32_t g, const GridPolygon& polygon, int axis,
                std::array<std::int32_t, 3>& index, double negligible) {
    if (axis == 3) return add_piece(t, g, polygon, index, negligible);
    const std::int32_t cells = result_.grids_[g].cells[axis];
    double low = polygon[0].grid[axis], high = low;
    for (const GridCorner& corner : polygon) {
      low = std::min(low, corner.grid[axis]);
      high = std::max(high, corner.grid[axis]);
    }
    const std::int32_t first = std::clamp(static_cast<std::int32_t>(std::floor(low)), 0, cells - 1);
    const std::int32_t last = std::clamp(static_cast<std::int32_t>(std::floor(high)), 0, cells - 1);
    for (std::int32_t i = first; i <= last; ++i) {
      GridPolygon part = polygon;
      if (i > first) part = clipped_to_axis(part, axis, i, 1);
      if (i < last && !part.empty()) part = clipped_to_axis(part, axis, i + 1, -1);
      if (part.empty()) continue;
      index[axis] = i;
      cut_axis(t, g, part, axis + 1, index, negligible);
    }
  }

  void add_piece(std::uint32_t t, std::uint32_t g, const GridPolygon& polygon, const std::array<std::int32_t, 3>& index,
                 double negligible) {
    const double area = 2 * surfaces_.areas[t] * area_in_uv(polygon);
    if (!(area > negligible)) return;
    const std::uint64_t flat = Patches::flat_index(result_.grids_[g], index);
    std::uint32_t* cell = nullptr;
    if (result_.grids_[g].is_dense) {
      cell = &result_.dense_[result_.grids_[g].dense_at + flat];
    } else {
      cell = &result_.sparse_.try_emplace({g, flat}, kNoPatch).first->second;
    }
    if (*cell == kNoPatch) {
      *cell = static_cast<std::uint32_t>(cell_is_double_sided_.size());
      cell_is_double_sided_.push_back(surfaces_.material(t).is_double_sided);
      count_ += sides(t);
    }
    if (result_.some_cell_[t] == kNoPatch) result_.some_cell_[t] = *cell;
    for (std::size_t k = 2; k < polygon.size(); ++k) {
      const std::array<Vec2, 3> corners = {polygon[0].uv, polygon[k - 1].uv, polygon[k].uv};
      const double part = 2 * surfaces_.areas[t] * signed_area(corners[0], corners[1], corners[2]);
      if (!(part > 0)) continue;
      result_.pieces_.push_back({t, corners, part});
      cell_of_piece_.push_back(*cell);
    }
  }

  /// Cuts cells along contacts, sorts pieces by patch (in order of triangles within one), sums areas, and numbers the
  /// back patches.
  void finish() {
    ContactCutter cutter(surfaces_, visibility_, groups_.group_of, result_);
    cutter.cut_cells(cell_of_piece_, cell_is_double_sided_, options_.max_patches - count_, options_.stop);
    const std::size_t num_cells = cell_is_double_sided_.size();
    std::vector<std::uint64_t>& first = result_.first_piece_;
    first.assign(num_cells + 1, 0);
    for (const std::uint32_t cell : cell_of_piece_) ++first[cell + 1];
    for (std::size_t c = 0; c < num_cells; ++c) first[c + 1] += first[c];
    std::vector<std::uint64_t> next(first.begin(), first.end() - 1);
    std::vector<Patches::Piece> sorted(result_.pieces_.size());
    for (std::size_t i = 0; i < sorted.size(); ++i) sorted[next[cell_of_piece_[i]]++] = result_.pieces_[i];
    result_.pieces_ = std::move(sorted);

    result_.areas_.resize(num_cells);
    for (std::size_t c = 0; c < num_cells; ++c) {
      double area = 0;
      for (std::uint64_t i = first[c]; i < first[c + 1]; ++i) {
        area += result_.pieces_[i].area_up_to;
        result_.pieces_[i].area_up_to = area;
      }
      result_.areas_[c] = area;
    }
    result_.back_of_cell_.assign(num_cells, kNoPatch);
    for (std::uint32_t c = 0; c < num_cells; ++c) {
      if (!cell_is_double_sided_[c]) continue;
      result_.back_of_cell_[c] = static_cast<std::uint32_t>(result_.areas_.size());
      result_.cell_of_back_.push_back(c);
      result_.areas_.push_back(result_.areas_[c]);
    }
    result_.make_quick_maps(surfaces_);
  }

  const Surfaces& surfaces_;
  const Visibility& visibility_;
  PatchOptions options_;
  SurfaceGroups groups_;
  std::vector<GroupPlane> planes_;   ///< [groups]
  std::size_t max_uncut_;            ///< patches before cells are cut along contacts
  std::size_t num_group_sides_ = 0;  ///< groups, both sides of sheets counted
  // Of the current attempt:
  Patches result_;
  std::vector<Vec3> cell_size_;               ///< [grids]
  std::vector<std::uint8_t> grid_is_merged_;  ///< [grids]
  std::vector<std::uint32_t> cell_of_piece_;
  std::vector<std::uint8_t> cell_is_double_sided_;
  std::size_t count_ = 0;
};

Patches make_patches(const Surfaces& surfaces, const Visibility& visibility, const PatchOptions& options) {
  RADBAKE_CHECK_LE(std::size_t{64}, options.max_patches);
  RADBAKE_CHECK_LT(0.0, options.edge);
  return PatchBuilder(surfaces, visibility, options).build();
}

}  // namespace radbake::radiosity
