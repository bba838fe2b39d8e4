#include "server/radiosity/patches/patches.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace radbake::radiosity {

std::uint32_t Patches::cell_at(std::uint32_t group, const std::array<std::int32_t, 3>& at) const {
  const Grid& grid = grids_[group];
  const std::uint64_t flat = flat_index(grid, at);
  if (grid.is_dense) return dense_[grid.dense_at + flat];
  const auto found = sparse_.find({group, flat});
  return found == sparse_.end() ? kNoPatch : found->second;
}

std::uint32_t Patches::cell_of(std::uint32_t triangle, Vec3 grid) const {
  const std::uint32_t group = group_of_[triangle];
  std::array<std::int32_t, 3> at;
  for (int axis = 0; axis < 3; ++axis) {
    at[axis] = std::clamp(static_cast<std::int32_t>(grid[axis]), 0, grids_[group].cells[axis] - 1);
  }
  return cell_at(group, at);
}

std::uint32_t Patches::find(std::uint32_t triangle, double u, double v, bool is_back) const {
  const GridMap& map = maps_[triangle];
  const Vec3 position = map.origin + map.per_u * u + map.per_v * v;
  std::uint32_t cell = cell_of(triangle, position);
  if (cell == kNoPatch) cell = some_cell_[triangle];
  const std::uint32_t front = part_at(cell, position);
  return is_back ? back_of_cell_[front] : front;
}

namespace {

// A ray is followed back to a few times the height of ray origins, but not far where it grazes.
constexpr double kHeights = 4;
constexpr double kLeastCosine = 1.0 / 256;

}  // namespace

void Patches::make_quick_maps(const Surfaces& surfaces) {
  constexpr std::int32_t kMostCells = 1 << 12;  // grid coordinates keep 11 bits below 1 in single precision
  quick_maps_.resize(maps_.size());
  for (std::size_t t = 0; t < maps_.size(); ++t) {
    const GridMap& map = maps_[t];
    const Grid& grid = grids_[group_of_[t]];
    QuickMap& quick = quick_maps_[t];
    for (int axis = 0; axis < 3; ++axis) quick.normal[axis] = static_cast<float>(surfaces.normals[t][axis]);
    double steepest = 0;
    for (int axis = 0; axis < 2; ++axis) {
      quick.origin[axis] = static_cast<float>(map.origin[axis]);
      quick.per_u[axis] = static_cast<float>(map.per_u[axis]);
      quick.per_v[axis] = static_cast<float>(map.per_v[axis]);
      quick.cells[axis] = grid.cells[axis];
      steepest = std::max(steepest, length(weights_[t][0] * map.per_u[axis] + weights_[t][1] * map.per_v[axis]));
    }
    const bool is_flat = grid.cells[2] == 1 && grid.cells[0] <= kMostCells && grid.cells[1] <= kMostCells;
    const bool fits = grid.is_dense && grid.dense_at <= 0xffffffffu;
    quick.dense_at = static_cast<std::uint32_t>(grid.dense_at);
    quick.shift = is_flat && fits ? static_cast<float>(kHeights * surfaces.ray_offsets[t] * steepest)
                                  : std::numeric_limits<float>::infinity();
  }
}

Patches::Meeting Patches::meet(const Hit& hit, const std::array<float, 3>& direction, const Surfaces& surfaces) const {
  const QuickMap& quick = quick_maps_[hit.triangle];
  const float cosine = direction[0] * quick.normal[0] + direction[1] * quick.normal[1] + direction[2] * quick.normal[2];
  // Where neither the way back nor rounding can reach the border of a cell, and no contact cuts it, this is its patch.
  constexpr float kBorder = 0x1p-8f;
  const float slack = std::fabs(cosine) * kBorder;
  const float x = quick.origin[0] + quick.per_u[0] * hit.u + quick.per_v[0] * hit.v;
  const float y = quick.origin[1] + quick.per_u[1] * hit.u + quick.per_v[1] * hit.v;
  if (quick.shift <= slack && std::fabs(cosine) > static_cast<float>(kLeastCosine) && x > 0 && y > 0) {
    const auto column = static_cast<std::int32_t>(x), row = static_cast<std::int32_t>(y);
    const float across = x - static_cast<float>(column), down = y - static_cast<float>(row);
    const bool is_inside = across > 2 * kBorder && across < 1 - 2 * kBorder && down > 2 * kBorder &&
                           down < 1 - 2 * kBorder && column < quick.cells[0] && row < quick.cells[1];
    if (is_inside) {
      const std::uint32_t cell = dense_[quick.dense_at + static_cast<std::uint32_t>(row * quick.cells[0] + column)];
      if (cell != kNoPatch && first_part_[cell + 1] - first_part_[cell] == 1) {
        const std::uint32_t front = first_part_[cell];
        return {cosine > 0 ? back_of_cell_[front] : front, cosine > 0};
      }
    }
  }
  const Vec3 exactly{direction[0], direction[1], direction[2]};
  return {met_by(hit, exactly, surfaces), dot(exactly, surfaces.normals[hit.triangle]) > 0};
}

std::uint32_t Patches::met_by(const Hit& hit, Vec3 direction, const Surfaces& surfaces) const {
  const double cosine = dot(direction, surfaces.normals[hit.triangle]);
  const bool is_back = cosine > 0;
  const Vec3 back =
      direction * (-kHeights * surfaces.ray_offsets[hit.triangle] / std::max(std::fabs(cosine), kLeastCosine));
  const double u = hit.u + dot(weights_[hit.triangle][0], back), v = hit.v + dot(weights_[hit.triangle][1], back);
  const GridMap& map = maps_[hit.triangle];
  const Vec3 position = map.origin + map.per_u * u + map.per_v * v;
  const std::uint32_t cell = cell_of(hit.triangle, position);
  // Beyond the border of the surface there is no cell.
  if (cell == kNoPatch) return find(hit.triangle, hit.u, hit.v, is_back);
  const std::uint32_t front = part_at(cell, position);
  return is_back ? back_of_cell_[front] : front;
}

std::uint32_t Patches::part_at(std::uint32_t cell, Vec3 grid) const {
  const std::uint32_t begin = first_part_[cell], end = first_part_[cell + 1];
  if (end - begin == 1) return begin;
  std::uint32_t sides = 0;
  for (std::uint32_t k = first_cut_[cell]; k < first_cut_[cell + 1]; ++k) {
    if (cuts_[k].is_beyond(grid)) sides |= 1u << (k - first_cut_[cell]);
  }
  // A part too small to be a patch belongs to the one that differs by the fewest cuts.
  std::uint32_t best = begin;
  for (std::uint32_t part = begin; part < end; ++part) {
    if (std::popcount(part_sides_[part] ^ sides) < std::popcount(part_sides_[best] ^ sides)) best = part;
  }
  return best;
}

std::vector<std::uint32_t> Patches::twice_as_large() const {
  std::vector<std::uint32_t> larger(size());
  for (std::uint32_t patch = 0; patch < size(); ++patch) larger[patch] = patch;
  // The first front of each larger cell stands for it.
  std::unordered_map<SparseCell, std::uint32_t, SparseCellHash> first;
  const auto join = [&](std::uint32_t group, std::uint64_t flat, std::uint32_t cell, bool can_take) {
    const Grid& grid = grids_[group];
    if (first_part_[cell + 1] - first_part_[cell] != 1) return;
    const auto across = static_cast<std::uint64_t>(grid.cells[0]), down = static_cast<std::uint64_t>(grid.cells[1]);
    const std::uint64_t x = flat % across / 2, y = flat / across % down / 2, z = flat / across / down / 2;
    const auto [entry, is_new] = first.try_emplace({group, (z * (down / 2 + 1) + y) * (across / 2 + 1) + x}, kNoPatch);
    if (!can_take) {
      entry->second = std::min(entry->second, first_part_[cell]);
    } else {
      larger[first_part_[cell]] = entry->second;
    }
  };
  for (const bool can_take : {false, true}) {
    for (std::uint32_t group = 0; group < grids_.size(); ++group) {
      const Grid& grid = grids_[group];
      if (!grid.is_dense) continue;
      const std::uint64_t num_cells = static_cast<std::uint64_t>(grid.cells[0]) * grid.cells[1] * grid.cells[2];
      for (std::uint64_t flat = 0; flat < num_cells; ++flat) {
        const std::uint32_t cell = dense_[grid.dense_at + flat];
        if (cell != kNoPatch) join(group, flat, cell, can_take);
      }
    }
    for (const auto& [at, cell] : sparse_) join(at.group, at.flat, cell, can_take);
  }
  for (auto patch = static_cast<std::uint32_t>(num_cells()); patch < size(); ++patch) {
    const std::uint32_t back = back_of_cell_[larger[front_of(patch)]];
    if (back != kNoPatch) larger[patch] = back;
  }
  return larger;
}

SurfacePoint Patches::sample(std::uint32_t patch, double x, double y) const {
  const std::uint32_t cell = is_back(patch) ? cell_of_back_[patch - num_cells()] : patch;
  // Choose a piece by area, and use what is left of x within it.
  const auto begin = pieces_.begin() + static_cast<std::ptrdiff_t>(first_piece_[cell]);
  const auto end = pieces_.begin() + static_cast<std::ptrdiff_t>(first_piece_[cell + 1]);
  const double wanted = x * (end - 1)->area_up_to;
  auto piece = std::upper_bound(begin, end, wanted, [](double a, const Piece& p) { return a < p.area_up_to; });
  if (piece == end) --piece;
  const double before = piece == begin ? 0 : (piece - 1)->area_up_to;
  const double within = std::clamp((wanted - before) / (piece->area_up_to - before), 0.0, 1.0);
  // Map the square to the triangle with uniform density: (1 - sqrt(s), y sqrt(s)).
  const double root = std::sqrt(within);
  const Vec2 p = piece->corners[0] * (1 - root) + piece->corners[1] * (root * (1 - y)) + piece->corners[2] * (root * y);
  return {piece->triangle, p.x, p.y};
}

}  // namespace radbake::radiosity
