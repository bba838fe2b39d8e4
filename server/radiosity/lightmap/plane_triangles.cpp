#include "server/radiosity/lightmap/plane_triangles.h"

#include <algorithm>
#include <cmath>

namespace radbake::radiosity {
namespace {

constexpr double kMaxCellsAlongSide = 1024;
/// Entries a triangle, on average, that the grid may take.
constexpr double kEntriesPerTriangle = 8;

struct Box {
  Vec2 low, high;
};

Box box_of(const PlaneTriangle& c) {
  const auto [low_x, high_x] = std::minmax({c[0].x, c[1].x, c[2].x});
  const auto [low_y, high_y] = std::minmax({c[0].y, c[1].y, c[2].y});
  return {{low_x, low_y}, {high_x, high_y}};
}

}  // namespace

double PlanePolygon::area() const {
  double sum = 0;
  for (int k = 2; k < size; ++k) sum += cross(corners[k - 1] - corners[0], corners[k] - corners[0]);
  return std::fabs(sum) / 2;
}

PlanePolygon clipped(const PlanePolygon& polygon, Vec2 normal, double offset) {
  PlanePolygon inside;
  for (int k = 0; k < polygon.size; ++k) {
    const Vec2 a = polygon.corners[k], b = polygon.corners[(k + 1) % polygon.size];
    const double da = dot(normal, a) - offset, db = dot(normal, b) - offset;
    if (da >= 0) inside.add(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) inside.add(a + (b - a) * (da / (da - db)));
  }
  return inside;
}

double shared_area(const PlaneTriangle& a, const PlaneTriangle& b) {
  const double turn = twice_area(a);
  if (turn == 0) return 0;
  // Most neighbours lie beyond one of its sides altogether.
  for (int k = 0; k < 3; ++k) {
    const Vec2 edge = a[(k + 1) % 3] - a[k];
    const auto is_beyond = [&](Vec2 p) { return (turn > 0 ? 1 : -1) * cross(edge, p - a[k]) <= 0; };
    if (is_beyond(b[0]) && is_beyond(b[1]) && is_beyond(b[2])) return 0;
  }
  PlanePolygon rest;
  for (const Vec2 corner : b) rest.add(corner);
  for (int k = 0; k < 3; ++k) {
    const Vec2 edge = a[(k + 1) % 3] - a[k];
    const Vec2 inward = turn > 0 ? Vec2{-edge.y, edge.x} : Vec2{edge.y, -edge.x};
    rest = clipped(rest, inward, dot(inward, a[k]));
    if (rest.size < 3) return 0;
  }
  return rest.area();
}

PlaneGrid::PlaneGrid(const std::vector<PlaneTriangle>& expected) {
  if (expected.empty()) return;
  Box all = box_of(expected[0]);
  double boxes = 0, edges = 0;
  for (const PlaneTriangle& triangle : expected) {
    const Box box = box_of(triangle);
    all.low = {std::min(all.low.x, box.low.x), std::min(all.low.y, box.low.y)};
    all.high = {std::max(all.high.x, box.high.x), std::max(all.high.y, box.high.y)};
    boxes += (box.high.x - box.low.x) * (box.high.y - box.low.y);
    edges += box.high.x - box.low.x + box.high.y - box.low.y;
  }
  low_ = all.low;
  const double extent = std::max(all.high.x - all.low.x, all.high.y - all.low.y);
  if (!(extent > 0)) return;
  // A box of w x h lies in about (w/c + 1) (h/c + 1) cells of edge c: boxes/c^2 + edges/c + n in all.
  const auto n = static_cast<double>(expected.size());
  const double cell =
      std::max({extent / kMaxCellsAlongSide, extent / std::sqrt(n) / 2,
                std::sqrt(2 * boxes / (kEntriesPerTriangle * n)), 2 * edges / (kEntriesPerTriangle * n)});
  cells_per_unit_ = 1 / cell;
  cells_.reserve(std::min(expected.size() * 4, static_cast<std::size_t>(std::pow(extent / cell + 1, 2))));
}

PlaneGrid::Range PlaneGrid::cells_of(const PlaneTriangle& triangle) const {
  const Box box = box_of(triangle);
  const auto cell = [this](double x, double low) {
    return static_cast<std::int64_t>(std::floor(std::clamp((x - low) * cells_per_unit_, -1e9, 1e9)));
  };
  return {cell(box.low.x, low_.x), cell(box.low.y, low_.y), cell(box.high.x, low_.x), cell(box.high.y, low_.y)};
}

void PlaneGrid::insert(std::uint32_t id, const PlaneTriangle& triangle) {
  const Range range = cells_of(triangle);
  for (std::int64_t y = range.low_y; y <= range.high_y; ++y) {
    for (std::int64_t x = range.low_x; x <= range.high_x; ++x) {
      cells_[key(x, y)].push_back({id, range.low_x, range.low_y});
    }
  }
}

}  // namespace radbake::radiosity
