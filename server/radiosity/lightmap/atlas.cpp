#include "server/radiosity/lightmap/atlas.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

/// Triangles that cover less of a texel than this meet it by rounding only.
constexpr double kNegligibleCoverage = 1e-6;

/// Calls visit(x, least, most) for the columns of texels that a strip one texel high meets, with bounds on the area
/// that it has in them. Columns that it reaches into are measured. Those that it passes right through are not: the
/// height of a convex polygon is a concave function of x, so with an area A and a width W it has at least A / (4 W^2)
/// there.
template <typename Visit>
void for_each_column(const PlanePolygon& strip, double area, std::span<const std::uint8_t> is_known,
                     const Visit& visit) {
  double low = strip.corners[0].x, high = low;
  for (int corner = 1; corner < strip.size; ++corner) {
    low = std::min(low, strip.corners[corner].x);
    high = std::max(high, strip.corners[corner].x);
  }
  const int end = static_cast<int>(is_known.size());
  const int first = std::clamp(static_cast<int>(std::floor(low)), 0, end - 1);
  const int last = std::clamp(static_cast<int>(std::floor(high)), 0, end - 1);
  const double least_inside = area / (4 * (high - low) * (high - low));
  for (int x = first; x <= last; ++x) {
    if (is_known[static_cast<std::size_t>(x)]) continue;
    if (x > first && x < last) {
      visit(x, least_inside, 1.0);
    } else {
      const double own = clipped(clipped(strip, {1, 0}, x), {-1, 0}, -(x + 1)).area();
      visit(x, own, own);
    }
  }
}

}  // namespace

SurfacePoint Footprint::sample(double x, double y) const {
  const double wanted = x * area();
  auto piece = std::upper_bound(pieces.begin(), pieces.end(), wanted,
                                [](double a, const FootprintPiece& p) { return a < p.area_up_to; });
  if (piece == pieces.end()) --piece;
  const double before = piece == pieces.begin() ? 0 : (piece - 1)->area_up_to;
  const double within = std::clamp((wanted - before) / (piece->area_up_to - before), 0.0, 1.0);
  const double root = std::sqrt(within);
  const Vec2 p = piece->corners[0] * (1 - root) + piece->corners[1] * (root * (1 - y)) + piece->corners[2] * (root * y);
  return {piece->triangle, p.x, p.y};
}

Result<Atlas> Atlas::make(const Surfaces& surfaces, Layout layout) {
  Atlas atlas;
  atlas.surfaces_ = &surfaces;
  atlas.layout_ = std::move(layout);
  atlas.blocks_x_ = (atlas.width() + kBlock - 1) / kBlock;
  atlas.blocks_y_ = (atlas.num_rows() + kBlock - 1) / kBlock;
  atlas.measure_density();
  atlas.sort_into_blocks();
  atlas.count_texels();
  if (atlas.num_texels_ == 0) return invalid_argument("the layout covers no texel: every triangle has no area in it");
  return atlas;
}

void Atlas::measure_density() {
  std::vector<std::pair<double, double>> densities;  // texels a metre, world area
  double total = 0;
  for (std::uint32_t t = 0; t < surfaces_->size(); ++t) {
    const double area = surfaces_->areas[t] * surfaces_->metres_per_unit * surfaces_->metres_per_unit;
    densities.emplace_back(std::sqrt(std::fabs(twice_area(layout_.corners[t])) / 2 / area), area);
    total += area;
  }
  std::sort(densities.begin(), densities.end());
  double up_to = 0;
  for (const auto& [density, area] : densities) {
    up_to += area;
    texels_per_meter_ = density;
    if (2 * up_to >= total) break;
  }
}

void Atlas::sort_into_blocks() {
  const auto for_each_block = [&](std::uint32_t t, const auto& visit) {
    const PlaneTriangle& c = layout_.corners[t];
    if (twice_area(c) == 0) return;
    const auto block = [](double texel, int blocks) {
      return std::clamp(static_cast<int>(std::floor(texel / kBlock)), 0, blocks - 1);
    };
    const auto [low_x, high_x] = std::minmax({c[0].x, c[1].x, c[2].x});
    const auto [low_y, high_y] = std::minmax({c[0].y, c[1].y, c[2].y});
    for (int by = block(low_y, blocks_y_); by <= block(high_y, blocks_y_); ++by) {
      for (int bx = block(low_x, blocks_x_); bx <= block(high_x, blocks_x_); ++bx) {
        visit(static_cast<std::size_t>(by) * blocks_x_ + bx);
      }
    }
  };
  // Count, then fill.
  const auto num_triangles = static_cast<std::uint32_t>(surfaces_->size());
  first_in_block_.assign(static_cast<std::size_t>(blocks_x_) * blocks_y_ + 1, 0);
  for (std::uint32_t t = 0; t < num_triangles; ++t) {
    for_each_block(t, [&](std::size_t block) { ++first_in_block_[block + 1]; });
  }
  for (std::size_t b = 0; b + 1 < first_in_block_.size(); ++b) first_in_block_[b + 1] += first_in_block_[b];
  in_block_.resize(first_in_block_.back());
  std::vector<std::uint64_t> next(first_in_block_.begin(), first_in_block_.end() - 1);
  for (std::uint32_t t = 0; t < num_triangles; ++t) {
    for_each_block(t, [&](std::size_t block) { in_block_[next[block]++] = t; });
  }
}

void Atlas::footprint(int x, int y, Footprint& out) const {
  out.pieces.clear();
  out.coverage = 0;
  const std::size_t block = static_cast<std::size_t>(y / kBlock) * blocks_x_ + x / kBlock;
  for (std::uint64_t k = first_in_block_[block]; k < first_in_block_[block + 1]; ++k) {
    const std::uint32_t t = in_block_[k];
    const PlaneTriangle& c = layout_.corners[t];
    const auto [low_x, high_x] = std::minmax({c[0].x, c[1].x, c[2].x});
    const auto [low_y, high_y] = std::minmax({c[0].y, c[1].y, c[2].y});
    if (low_x >= x + 1 || high_x <= x || low_y >= y + 1 || high_y <= y) continue;
    PlanePolygon polygon;
    for (const Vec2 corner : c) polygon.add(corner);
    polygon = clipped(polygon, {1, 0}, x);
    polygon = clipped(polygon, {-1, 0}, -(x + 1));
    polygon = clipped(polygon, {0, 1}, y);
    polygon = clipped(polygon, {0, -1}, -(y + 1));

    // Barycentric weights of a point p: u = (p - c0) x (c2 - c0) / D, v = (c1 - c0) x (p - c0) / D.
    const double determinant = twice_area(c);
    const auto weights = [&](Vec2 p) {
      return Vec2{cross(p - c[0], c[2] - c[0]) / determinant, cross(c[1] - c[0], p - c[0]) / determinant};
    };
    for (int corner = 2; corner < polygon.size; ++corner) {
      const PlaneTriangle fan = {polygon.corners[0], polygon.corners[corner - 1], polygon.corners[corner]};
      const double covered = std::fabs(twice_area(fan)) / 2;
      if (covered < kNegligibleCoverage) continue;
      out.coverage += covered;
      const double area = surfaces_->areas[t] * 2 * covered / std::fabs(determinant);
      out.pieces.push_back({t, {weights(fan[0]), weights(fan[1]), weights(fan[2])}, out.area() + area});
    }
  }
  out.coverage = std::min(out.coverage, 1.0);
}

void Atlas::count_texels() {
  // Block row by block row, so that the sum does not depend on threads.
  std::vector<double> covered(static_cast<std::size_t>(blocks_y_), 0.0);
  std::vector<std::uint64_t> counts(covered.size(), 0);
  for_each_range(covered.size(), 1, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint8_t> is_covered;
    for (std::size_t by = begin; by < end; ++by) {
      covered[by] = cover_block_row(static_cast<int>(by), is_covered);
      counts[by] = static_cast<std::uint64_t>(std::count(is_covered.begin(), is_covered.end(), 1));
    }
  });
  double sum = 0;
  for (std::size_t by = 0; by < covered.size(); ++by) {
    num_texels_ += counts[by];
    sum += covered[by];
  }
  fill_ = sum / (static_cast<double>(width()) * num_rows());
}

double Atlas::cover_block_row(int by, std::vector<std::uint8_t>& is_covered) const {
  const int first_row = by * kBlock, end_row = std::min(first_row + kBlock, num_rows());
  is_covered.assign(static_cast<std::size_t>(end_row - first_row) * width(), 0);
  double sum = 0;
  Footprint footprint;
  for (int bx = 0; bx < blocks_x_; ++bx) {
    const std::size_t block = static_cast<std::size_t>(by) * blocks_x_ + bx;
    for (std::uint64_t k = first_in_block_[block]; k < first_in_block_[block + 1]; ++k) {
      const PlaneTriangle& c = layout_.corners[in_block_[k]];
      // A triangle counts in the first of the row's blocks that it lies in.
      const double low_x = std::min({c[0].x, c[1].x, c[2].x});
      if (std::clamp(static_cast<int>(std::floor(low_x / kBlock)), 0, blocks_x_ - 1) != bx) continue;
      PlanePolygon triangle;
      for (const Vec2 corner : c) triangle.add(corner);
      const auto [low_y, high_y] = std::minmax({c[0].y, c[1].y, c[2].y});
      const int begin_y = std::max(first_row, static_cast<int>(std::floor(std::max(low_y, 0.0))));
      const int end_y = std::min(end_row, static_cast<int>(std::ceil(std::max(high_y, 0.0))));
      for (int y = begin_y; y < end_y; ++y) {
        const PlanePolygon strip = clipped(clipped(triangle, {0, 1}, y), {0, -1}, -(y + 1));
        const double area = strip.area();
        if (area <= 0) continue;
        sum += area;
        const auto row = std::span(is_covered).subspan(static_cast<std::size_t>(y - first_row) * width(), width());
        for_each_column(strip, area, row, [&](int x, double least, double most) {
          if (most < kNegligibleCoverage) return;
          // A fan of up to five triangles: one of them is not negligible, or let the footprint say.
          constexpr int kMostInFan = 5;
          if (least < kMostInFan * kNegligibleCoverage) {
            this->footprint(x, y, footprint);
            row[x] = !footprint.is_empty();
          } else {
            row[x] = 1;
          }
        });
      }
    }
  }
  return sum;
}

}  // namespace radbake::radiosity
