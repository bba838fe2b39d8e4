#include "server/radiosity/gather/texel_roles.h"

#include <algorithm>
#include <cmath>

#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

/// A texel is wholly covered up to this.
constexpr double kWhole = 1 - 1e-3;
/// Normals of a smooth square are within 11 degrees of each other.
constexpr double kSmoothCosine = 0.98;
/// How far texels may lie off the plane through the nodes, in lengths of the square's side.
constexpr double kFlat = 0.1;

/// Where a triangle's edges meet the line y = at: the interval of x, empty (low > high) beside it.
struct Interval {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
};
Interval on_line(const PlaneTriangle& c, double at) {
  Interval interval;
  for (int k = 0; k < 3; ++k) {
    const Vec2 a = c[k], b = c[(k + 1) % 3];
    if ((a.y < at && b.y < at) || (a.y > at && b.y > at)) continue;
    const auto include = [&interval](double x) {
      interval.low = std::min(interval.low, x);
      interval.high = std::max(interval.high, x);
    };
    if (a.y == b.y) {
      include(a.x);
      include(b.x);
    } else {
      include(a.x + (at - a.y) / (b.y - a.y) * (b.x - a.x));
    }
  }
  return interval;
}

}  // namespace

TexelRoles::TexelRoles(const Surfaces& surfaces, const Atlas& atlas, const Visibility& shadows, int spacing)
    : surfaces_(surfaces),
      atlas_(atlas),
      shadows_(shadows),
      spacing_(spacing),
      width_(atlas.width()),
      height_(atlas.height()) {
  find_homes();
  if (spacing_ <= 1) return;
  nodes_x_ = (width_ + spacing_ - 1) / spacing_;
  nodes_y_ = (atlas.num_rows() + spacing_ - 1) / spacing_;
  is_plain_.assign(static_cast<std::size_t>(nodes_x_) * nodes_y_, 0);
  is_node_.assign(is_plain_.size(), 0);
  for_each_range(static_cast<std::size_t>(nodes_y_), 1, [&](std::size_t begin, std::size_t end) {
    Footprint footprint;
    std::vector<Ray> segments;
    std::vector<std::uint8_t> is_blocked;
    for (std::size_t j = begin; j < end; ++j) {
      for (int i = 0; i < nodes_x_; ++i) {
        is_plain_[index_of(i, static_cast<int>(j))] =
            looks_plain(i, static_cast<int>(j), footprint, segments, is_blocked);
      }
    }
  });
  for_each_plain_square([this](int i, int j) {
    for (const std::size_t node : {index_of(i, j), index_of(i + 1, j), index_of(i, j + 1), index_of(i + 1, j + 1)}) {
      is_node_[node] = 1;
    }
  });
}

void TexelRoles::find_homes() {
  homes_.assign(static_cast<std::size_t>(atlas_.num_rows()) * width_, kNoTriangle);
  const auto& corners = atlas_.layout().corners;
  for (std::uint32_t t = 0; t < corners.size(); ++t) {
    const PlaneTriangle& c = corners[t];
    if (twice_area(c) == 0) continue;
    const auto [low, high] = std::minmax({c[0].y, c[1].y, c[2].y});
    const int first = std::max(0, static_cast<int>(std::ceil(low)));
    const int end = std::min(atlas_.num_rows(), static_cast<int>(std::floor(high)));
    for (int y = first; y < end; ++y) {
      // Inside are texels whose upper and lower sides are.
      const Interval above = on_line(c, y), below = on_line(c, y + 1);
      const int left = std::max(0, static_cast<int>(std::ceil(std::max(above.low, below.low))));
      const int right = std::min(width_, static_cast<int>(std::floor(std::min(above.high, below.high))));
      for (int x = left; x < right; ++x) homes_[static_cast<std::size_t>(y) * width_ + x] = t;
    }
  }
}

SurfacePoint TexelRoles::point_on(std::uint32_t triangle, Vec2 at) const {
  const PlaneTriangle& c = atlas_.layout().corners[triangle];
  const double determinant = twice_area(c);
  const Vec2 p = at - c[0];
  return {triangle, cross(p, c[2] - c[0]) / determinant, cross(c[1] - c[0], p) / determinant};
}

SurfacePoint TexelRoles::point_at_home(int x, int y, double dx, double dy) const {
  return point_on(home(x, y), {x + dx, y + dy});
}

std::optional<SurfacePoint> TexelRoles::middle(int x, int y, Footprint& footprint) const {
  if (home(x, y) != kNoTriangle) return point_at_home(x, y, 0.5, 0.5);
  atlas_.footprint(x, y, footprint);
  if (footprint.coverage < kWhole) return std::nullopt;
  return point_on(footprint.pieces.front().triangle, {x + 0.5, y + 0.5});
}

bool TexelRoles::looks_plain(int i, int j, Footprint& footprint, std::vector<Ray>& segments,
                             std::vector<std::uint8_t>& is_blocked) const {
  constexpr int kMostAcross = 9;
  const int across = spacing_ + 1, left = i * spacing_, top = j * spacing_;
  if (left + spacing_ >= width_ || top % height_ + spacing_ >= height_ || across > kMostAcross) return false;
  std::array<Vec3, kMostAcross * kMostAcross> positions;
  std::array<std::uint32_t, kMostAcross * kMostAcross> triangles;
  // Corners first: most squares that are not plain fail there.
  const auto at = [across](int dx, int dy) { return static_cast<std::size_t>(dy * across + dx); };
  Vec3 normal;
  const auto take = [&](int dx, int dy) {
    const auto point = middle(left + dx, top + dy, footprint);
    // What receives on both sides gathers alone.
    if (!point || surfaces_.is_translucent(point->triangle)) return false;
    positions[at(dx, dy)] = surfaces_.position(*point);
    triangles[at(dx, dy)] = point->triangle;
    const Vec3 own = surfaces_.shading_normal(*point);
    if (dx == 0 && dy == 0) normal = own;
    return dot(own, normal) >= kSmoothCosine && dot(surfaces_.normals[point->triangle], own) >= kSmoothCosine;
  };
  for (const auto& [dx, dy] : {std::pair{0, 0}, {spacing_, 0}, {0, spacing_}, {spacing_, spacing_}}) {
    if (!take(dx, dy)) return false;
  }
  const Vec3 origin = positions[0], along = positions[at(spacing_, 0)] - origin,
             down = positions[at(0, spacing_)] - origin;
  const double limit = kFlat * std::max(length(along), length(down));
  if (!(limit > 0)) return false;
  double deviation = 0;
  for (int dy = 0; dy < across; ++dy) {
    for (int dx = 0; dx < across; ++dx) {
      if (!take(dx, dy)) return false;
      const Vec3 flat =
          origin + along * (static_cast<double>(dx) / spacing_) + down * (static_cast<double>(dy) / spacing_);
      deviation = std::max(deviation, length(positions[at(dx, dy)] - flat));
      if (deviation > limit) return false;
    }
  }

  // Whether anything stands there: seen along every row and column of texels, just above the surface.
  segments.clear();
  const auto add = [&](std::size_t from, std::size_t to) {
    const auto lifted = [&](std::size_t k) {
      const Vec3 facing = surfaces_.normals[triangles[k]];
      return lifted_origin(surfaces_, positions[k] + facing * (2 * deviation), facing, triangles[k]);
    };
    const auto a = lifted(from), b = lifted(to);
    segments.push_back({a, {b[0] - a[0], b[1] - a[1], b[2] - a[2]}, 1.0f});
  };
  for (int k = 0; k < across; ++k) {
    add(at(0, k), at(spacing_, k));
    add(at(k, 0), at(k, spacing_));
  }
  is_blocked.resize(segments.size());
  shadows_.blocked(segments, is_blocked);
  return std::find(is_blocked.begin(), is_blocked.end(), 1) == is_blocked.end();
}

std::optional<TexelRoles::Between> TexelRoles::between(int x, int y) const {
  if (spacing_ <= 1) return std::nullopt;
  const int i = x / spacing_, j = y / spacing_, dx = x % spacing_, dy = y % spacing_;
  // A texel in line with nodes lies at the border of two squares, a node at that of four.
  for (int up = 0; up <= (dy == 0 && j > 0 ? 1 : 0); ++up) {
    for (int back = 0; back <= (dx == 0 && i > 0 ? 1 : 0); ++back) {
      const int bi = i - back, bj = j - up;
      if (!is_plain(bi, bj)) continue;
      const double fx = back ? 1 : static_cast<double>(dx) / spacing_, fy = up ? 1 : static_cast<double>(dy) / spacing_;
      return Between{{index_of(bi, bj), index_of(bi + 1, bj), index_of(bi, bj + 1), index_of(bi + 1, bj + 1)},
                     {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy}};
    }
  }
  return std::nullopt;
}

}  // namespace radbake::radiosity
