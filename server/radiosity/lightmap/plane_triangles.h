#pragma once

#include <array>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "common/geometry/vector.h"

namespace radbake::radiosity {

/// A triangle in the plane of a layout.
using PlaneTriangle = std::array<Vec2, 3>;

/// Twice the signed area: positive where the corners turn from +x to +y.
inline double twice_area(const PlaneTriangle& c) { return cross(c[1] - c[0], c[2] - c[0]); }

/// A convex polygon of few corners.
struct PlanePolygon {
  std::array<Vec2, 8> corners;
  int size = 0;
  void add(Vec2 p) { corners[size++] = p; }
  double area() const;
};

/// The part of a convex polygon where dot(normal, p) >= offset. Precondition: at most seven corners.
/// Source: Sutherland & Hodgman 1974.
PlanePolygon clipped(const PlanePolygon& polygon, Vec2 normal, double offset);

/// Area that two triangles share, whichever way they turn.
double shared_area(const PlaneTriangle& a, const PlaneTriangle& b);

/// Triangles sorted into square cells, to find those that may meet one.
class PlaneGrid {
 public:
  /// Chooses cells for these triangles, so that few triangles lie in many cells. None is inserted yet.
  explicit PlaneGrid(const std::vector<PlaneTriangle>& expected);

  void insert(std::uint32_t id, const PlaneTriangle& triangle);

  /// Calls visit(id) for every inserted triangle whose box shares a cell with this one's, each once; stops when visit
  /// returns false.
  template <typename Visit>
  void for_each_near(const PlaneTriangle& triangle, const Visit& visit) const {
    const Range range = cells_of(triangle);
    for (std::int64_t y = range.low_y; y <= range.high_y; ++y) {
      for (std::int64_t x = range.low_x; x <= range.high_x; ++x) {
        const auto cell = cells_.find(key(x, y));
        if (cell == cells_.end()) continue;
        for (const Entry& entry : cell->second) {
          // Of the cells that both lie in, only the first counts.
          if (x != std::max(range.low_x, entry.low_x) || y != std::max(range.low_y, entry.low_y)) continue;
          if (!visit(entry.id)) return;
        }
      }
    }
  }

 private:
  struct Range {
    std::int64_t low_x, low_y, high_x, high_y;
  };
  struct Entry {
    std::uint32_t id;
    std::int64_t low_x, low_y;
  };
  Range cells_of(const PlaneTriangle& triangle) const;
  static std::uint64_t key(std::int64_t x, std::int64_t y) {
    return static_cast<std::uint64_t>(x) << 32 ^ (static_cast<std::uint64_t>(y) & 0xffffffffu);
  }

  Vec2 low_;
  double cells_per_unit_ = 1;
  std::unordered_map<std::uint64_t, std::vector<Entry>> cells_;
};

}  // namespace radbake::radiosity
