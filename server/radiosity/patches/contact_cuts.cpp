#include "server/radiosity/patches/contact_cuts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "server/radiosity/patches/grid_polygon.h"
#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

/// Lines that cut one cell; further contacts of the same cell are left alone.
constexpr std::size_t kMaxCuts = 6;
/// A contact shorter than this share of a cell, or a part smaller than this share of it, comes from rounding.
constexpr double kNegligible = 1e-5;

/// A straight piece of one triangle in the plane of another, as that one's barycentric weights.
struct Contact {
  Vec2 a, b;
};

/// Where a triangle meets the plane of another in a segment. Corners within `tolerance` of the plane lie in it; a
/// triangle that lies in it altogether meets it in no segment.
std::optional<std::array<Vec3, 2>> segment_in_plane(const std::array<Vec3, 3>& corners, Vec3 on_plane, Vec3 normal,
                                                    double tolerance) {
  std::array<double, 3> height;
  int above = 0, below = 0;
  for (int k = 0; k < 3; ++k) {
    height[k] = dot(corners[k] - on_plane, normal);
    if (std::fabs(height[k]) <= tolerance) height[k] = 0;
    above += height[k] > 0;
    below += height[k] < 0;
  }
  // Apart, in one corner only, or in the plane.
  if (above == 3 || below == 3 || above + below == 0) return {};
  if (above + below == 2 && (above == 0 || below == 0)) return {};
  std::array<Vec3, 2> ends;
  int found = 0;
  for (int k = 0; k < 3 && found < 2; ++k) {
    const int next = (k + 1) % 3;
    if (height[k] == 0) ends[found++] = corners[k];
    if (height[k] * height[next] < 0 && found < 2) {
      ends[found++] = corners[k] + (corners[next] - corners[k]) * (height[k] / (height[k] - height[next]));
    }
  }
  if (found < 2) return {};
  return ends;
}

/// Cuts a segment to where an affine function is not below -tolerance; false where nothing is left.
bool cut_to(Contact& segment, double at_a, double at_b, double tolerance) {
  at_a += tolerance;
  at_b += tolerance;
  if (at_a < 0 && at_b < 0) return false;
  if (at_a >= 0 && at_b >= 0) return true;
  const Vec2 cut = segment.a + (segment.b - segment.a) * (at_a / (at_a - at_b));
  (at_a < 0 ? segment.a : segment.b) = cut;
  return true;
}

/// What corners span, each side wider by what contacts are let slip and by `tolerance`.
struct Box {
  Vec3 low, high;

  Box(const std::array<Vec3, 3>& corners, double tolerance) {
    double size = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const auto [least, most] = std::minmax({corners[0][axis], corners[1][axis], corners[2][axis]});
      low[axis] = least;
      high[axis] = most;
      size = std::max(size, most - least);
    }
    const double slip = 4 * kNegligible * size + tolerance;
    low -= Vec3{slip, slip, slip};
    high += Vec3{slip, slip, slip};
  }
  bool meets(const Box& other) const {
    return low.x <= other.high.x && other.low.x <= high.x && low.y <= other.high.y && other.low.y <= high.y &&
           low.z <= other.high.z && other.low.z <= high.z;
  }
};

/// Whether the segment from a to b runs through the unit cell at (column, row) by more than a rounding.
bool runs_through_cell(Vec2 a, Vec2 b, double column, double row) {
  const Vec2 d = b - a;
  double enter = 0, leave = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const double from = axis == 0 ? a.x - column : a.y - row, along = axis == 0 ? d.x : d.y;
    if (std::fabs(along) < kNegligible) {
      if (from < 0 || from > 1) return false;
      continue;
    }
    const double t0 = -from / along, t1 = (1 - from) / along;
    enter = std::max(enter, std::min(t0, t1));
    leave = std::min(leave, std::max(t0, t1));
  }
  return (leave - enter) * std::sqrt(dot(d, d)) > kNegligible;
}

}  // namespace

void ContactCutter::cut_cells(std::vector<std::uint32_t>& cell_of_piece, std::vector<std::uint8_t>& is_double_sided,
                              std::size_t max_new, const std::stop_token& stop) {
  // Sort the pieces by cell, in order within one.
  const std::size_t num_cells = is_double_sided.size();
  std::vector<std::size_t> first(num_cells + 1, 0);
  for (const std::uint32_t cell : cell_of_piece) ++first[cell + 1];
  for (std::size_t c = 0; c < num_cells; ++c) first[c + 1] += first[c];
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  std::vector<Piece> sorted(patches_.pieces_.size());
  for (std::size_t i = 0; i < sorted.size(); ++i) sorted[next[cell_of_piece[i]]++] = patches_.pieces_[i];

  // Cut each cell by itself.
  const auto pieces_of = [&](std::size_t c) {
    return std::span<const Piece>(&sorted[first[c]], first[c + 1] - first[c]);
  };
  std::vector<CellCuts> cells(num_cells);
  constexpr std::size_t kCellsPerTask = 16;
  for_each_range(num_cells, kCellsPerTask, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> near;
    for (std::size_t c = begin; c < end; ++c) cells[c] = cut_cell(pieces_of(c), stop.stop_requested(), near);
  });

  // Number the parts in the order of cells and of their sides.
  std::vector<std::uint8_t> is_part_double_sided;
  patches_.pieces_.clear();
  cell_of_piece.clear();
  patches_.first_part_.assign(1, 0);
  patches_.first_cut_.assign(1, 0);
  for (std::size_t c = 0; c < num_cells; ++c) {
    auto& [cuts, parts, sides] = cells[c];
    const std::size_t added = (sides.size() - 1) * (is_double_sided[c] ? 2 : 1);
    if (added > max_new) {
      ++patches_.num_uncut_;
      cuts.clear();
      sides.assign(1, 0);
      parts.clear();
      for (const Piece& piece : pieces_of(c)) parts.emplace_back(0, piece);
    } else {
      max_new -= added;
    }
    for (const auto& [side, piece] : parts) {
      const auto part = std::lower_bound(sides.begin(), sides.end(), side) - sides.begin();
      patches_.pieces_.push_back(piece);
      cell_of_piece.push_back(static_cast<std::uint32_t>(patches_.part_sides_.size() + part));
    }
    patches_.part_sides_.insert(patches_.part_sides_.end(), sides.begin(), sides.end());
    is_part_double_sided.insert(is_part_double_sided.end(), sides.size(), is_double_sided[c]);
    patches_.cuts_.insert(patches_.cuts_.end(), cuts.begin(), cuts.end());
    patches_.first_part_.push_back(static_cast<std::uint32_t>(patches_.part_sides_.size()));
    patches_.first_cut_.push_back(static_cast<std::uint32_t>(patches_.cuts_.size()));
    cells[c] = {};
  }
  is_double_sided = std::move(is_part_double_sided);
}

ContactCutter::CellCuts ContactCutter::cut_cell(std::span<const Piece> pieces, bool is_whole,
                                                std::vector<std::uint32_t>& near) const {
  CellCuts cell;
  if (!is_whole) find_cuts(pieces, near, cell.cuts);
  for (const Piece& piece : pieces) split(piece, cell.cuts, cell.parts);
  cell.sides.reserve(cell.parts.size());
  for (const auto& part : cell.parts) cell.sides.push_back(part.first);
  std::sort(cell.sides.begin(), cell.sides.end());
  cell.sides.erase(std::unique(cell.sides.begin(), cell.sides.end()), cell.sides.end());
  return cell;
}

void ContactCutter::find_cuts(std::span<const Piece> pieces, std::vector<std::uint32_t>& near,
                              std::vector<Cut>& cuts) const {
  // Merged groups have no grid to cut in: their coordinates do not vary.
  const auto& map = patches_.maps_[pieces.front().triangle];
  if (dot(map.per_u, map.per_u) == 0 && dot(map.per_v, map.per_v) == 0) return;

  // A ball around the cell.
  Vec3 low, high;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 p = surfaces_.position({pieces[i].triangle, pieces[i].corners[k].x, pieces[i].corners[k].y});
      if (i == 0 && k == 0) low = high = p;
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], p[axis]);
        high[axis] = std::max(high[axis], p[axis]);
      }
    }
  }
  visibility_.triangles_near((low + high) * 0.5, length(high - low) / 2, near);
  // Only triangles of other groups whose boxes overlap can meet.
  const auto box_of = [this](std::uint32_t t) { return Box(surfaces_.corners[t], 2 * surfaces_.ray_offsets[t]); };
  const std::uint32_t group = group_of_[pieces.front().triangle];
  std::vector<std::pair<std::uint32_t, Box>> others;
  for (const std::uint32_t other : near) {
    if (group_of_[other] != group) others.emplace_back(other, box_of(other));
  }
  std::uint32_t last = kNoPatch;
  for (const Piece& piece : pieces) {
    if (piece.triangle == last) continue;
    last = piece.triangle;
    const Box own = box_of(piece.triangle);
    for (const auto& [other, box] : others) {
      if (own.meets(box)) add_contact(piece, other, near, cuts);
    }
  }
}

void ContactCutter::add_contact(const Piece& piece, std::uint32_t other, Near near, std::vector<Cut>& cuts) const {
  const std::uint32_t t = piece.triangle;
  const auto& c = surfaces_.corners[t];
  const Vec3 n = surfaces_.normals[t];
  const double tolerance = std::max(surfaces_.ray_offsets[t], surfaces_.ray_offsets[other]);
  const auto segment = segment_in_plane(surfaces_.corners[other], c[0], n, tolerance);
  if (!segment || cuts.size() == kMaxCuts) return;

  // The part of the segment within the triangle, by barycentric weights: u = ((p - c0) x e2).n / |e1 x e2|.
  const Vec3 e1 = c[1] - c[0], e2 = c[2] - c[0];
  const double twice_area = 2 * surfaces_.areas[t];
  const auto weights = [&](Vec3 p) {
    return Vec2{dot(cross(p - c[0], e2), n) / twice_area, dot(cross(e1, p - c[0]), n) / twice_area};
  };
  Contact contact{weights((*segment)[0]), weights((*segment)[1])};
  for (int side = 0; side < 3; ++side) {
    const auto height = [side](Vec2 p) { return side == 0 ? p.x : side == 1 ? p.y : 1 - p.x - p.y; };
    const double at_a = height(contact.a), at_b = height(contact.b);
    if (!cut_to(contact, at_a, at_b, kNegligible)) return;
    // Along a side of the triangle: another surface's border, unless this surface goes on beyond it.
    if (std::max(std::fabs(at_a), std::fabs(at_b)) <= kNegligible && !goes_on_beyond(t, side, near)) return;
  }

  const auto& map = patches_.maps_[t];
  std::array<Vec2, 2> ends;
  for (int k = 0; k < 2; ++k) {
    const Vec2 w = k == 0 ? contact.a : contact.b;
    const Vec3 grid = map.origin + map.per_u * w.x + map.per_v * w.y;
    ends[k] = {grid.x, grid.y};
  }
  const Vec2 middle = (piece.corners[0] + piece.corners[1] + piece.corners[2]) * (1.0 / 3);
  const Vec3 inside = map.origin + map.per_u * middle.x + map.per_v * middle.y;
  if (!runs_through_cell(ends[0], ends[1], std::floor(inside.x), std::floor(inside.y))) return;

  const Vec2 along = ends[1] - ends[0];
  const double size = std::sqrt(dot(along, along));
  Cut cut{{-along.y / size, along.x / size}, 0};
  cut.offset = dot(cut.normal, ends[0]);
  // The two triangles of a wall meet the floor in one line; it need not be cut twice.
  for (const Cut& known : cuts) {
    const double cosine = dot(known.normal, cut.normal);
    if (std::fabs(cosine) > 1 - kNegligible &&
        std::fabs(known.offset * (cosine < 0 ? -1 : 1) - cut.offset) < kNegligible) {
      return;
    }
  }
  cuts.push_back(cut);
}

bool ContactCutter::goes_on_beyond(std::uint32_t triangle, int side, Near near) const {
  // Side 0 is u = 0, between corners 0 and 2; side 1 is v = 0; side 2 lies opposite corner 0.
  const auto& c = surfaces_.corners[triangle];
  const Vec3 a = side == 2 ? c[1] : c[0], b = side == 1 ? c[1] : c[2];
  const auto has = [](const std::array<Vec3, 3>& corners, Vec3 p) {
    return corners[0] == p || corners[1] == p || corners[2] == p;
  };
  return std::any_of(near.begin(), near.end(), [&](std::uint32_t other) {
    return other != triangle && group_of_[other] == group_of_[triangle] && has(surfaces_.corners[other], a) &&
           has(surfaces_.corners[other], b);
  });
}

void ContactCutter::split(const Piece& piece, std::span<const Cut> cuts,
                          std::vector<std::pair<std::uint32_t, Piece>>& parts) const {
  const auto& map = patches_.maps_[piece.triangle];
  GridPolygon whole;
  for (const Vec2 uv : piece.corners) whole.push_back({uv, map.origin + map.per_u * uv.x + map.per_v * uv.y});
  std::vector<std::pair<std::uint32_t, GridPolygon>> polygons = {{0, whole}};
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    const Cut& cut = cuts[k];
    const auto height = [&cut](Vec3 grid) { return cut.normal.x * grid.x + cut.normal.y * grid.y - cut.offset; };
    std::vector<std::pair<std::uint32_t, GridPolygon>> halves;
    for (const auto& [sides, polygon] : polygons) {
      GridPolygon beyond = clipped(polygon, height);
      GridPolygon before = clipped(polygon, [&](Vec3 grid) { return -height(grid); });
      // A line along the border of the polygon cuts nothing off.
      const double whole_area = area_in_uv(polygon);
      const double cut_off = kNegligible * whole_area;
      if (area_in_uv(beyond) <= cut_off) {
        halves.emplace_back(sides, polygon);
      } else if (area_in_uv(before) <= cut_off) {
        halves.emplace_back(sides | 1u << k, polygon);
      } else {
        halves.emplace_back(sides | 1u << k, std::move(beyond));
        halves.emplace_back(sides, std::move(before));
      }
    }
    polygons = std::move(halves);
  }
  for (const auto& [sides, polygon] : polygons) {
    for (std::size_t k = 2; k < polygon.size(); ++k) {
      Piece part = piece;
      part.corners = {polygon[0].uv, polygon[k - 1].uv, polygon[k].uv};
      part.area_up_to =
          2 * surfaces_.areas[piece.triangle] * signed_area(part.corners[0], part.corners[1], part.corners[2]);
      if (part.area_up_to > 0) parts.emplace_back(sides, part);
    }
  }
}

}  // namespace radbake::radiosity
