#include "server/radiosity/lightmap/atlas.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <set>
#include <string>

#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

constexpr int kMinAtlas = 64, kMaxAtlas = 4096;
/// Coordinates may leave 0..1 by this much, in texels: quantisation on the wire moves them by up to 0.01.
constexpr double kBorderTolerance = 0.05;
/// Triangles that cover less of a texel than this meet it by rounding only.
constexpr double kNegligibleCoverage = 1e-6;

double twice_area(const std::array<Vec2, 3>& c) { return cross(c[1] - c[0], c[2] - c[0]); }

/// A convex polygon of at most 3 + 4 corners.
struct Polygon {
  std::array<Vec2, 8> corners;
  int size = 0;
  void add(Vec2 p) { corners[size++] = p; }
};

/// The part where sign * (p[axis] - bound) >= 0. Source: Sutherland & Hodgman 1974.
Polygon clipped(const Polygon& polygon, int axis, double bound, double sign) {
  Polygon inside;
  const auto distance = [&](Vec2 p) { return sign * ((axis == 0 ? p.x : p.y) - bound); };
  for (int k = 0; k < polygon.size; ++k) {
    const Vec2 a = polygon.corners[k], b = polygon.corners[(k + 1) % polygon.size];
    const double da = distance(a), db = distance(b);
    if (da >= 0) inside.add(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) inside.add(a + (b - a) * (da / (da - db)));
  }
  return inside;
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

std::array<Vec2, 3> lightmap_corners(const Surfaces& surfaces, std::uint32_t triangle) {
  const auto& texcoord = surfaces.mesh(triangle).texcoord1;
  const auto& vertices = surfaces.vertices(triangle);
  return {texcoord[vertices[0]], texcoord[vertices[1]], texcoord[vertices[2]]};
}

int atlas_size_for_density(const Surfaces& surfaces, double texels_per_meter) {
  double in_atlas = 0, in_world = 0;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    if (surfaces.mesh(t).texcoord1.empty()) continue;
    in_atlas += std::fabs(twice_area(lightmap_corners(surfaces, t))) / 2;
    in_world += surfaces.areas[t] * surfaces.metres_per_unit * surfaces.metres_per_unit;
  }
  int size = kMinAtlas;
  while (size < kMaxAtlas && size * std::sqrt(in_atlas) < texels_per_meter * std::sqrt(in_world)) size *= 2;
  return size;
}

Result<Atlas> Atlas::make(const Surfaces& surfaces, int size) {
  Atlas atlas;
  atlas.surfaces_ = &surfaces;
  atlas.size_ = size;
  atlas.blocks_ = (size + kBlock - 1) / kBlock;
  atlas.corners_.resize(surfaces.size());
  std::vector<std::pair<double, double>> densities;  // texels a metre, world area
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    const Mesh& mesh = surfaces.mesh(t);
    if (mesh.texcoord1.empty()) {
      return invalid_argument("mesh '" + mesh.name +
                              "' has no TEXCOORD_1: the lightmap's layout must cover every mesh");
    }
    std::array<Vec2, 3> corners = lightmap_corners(surfaces, t);
    for (Vec2& corner : corners) {
      corner = corner * size;
      if (std::min(corner.x, corner.y) < -kBorderTolerance || std::max(corner.x, corner.y) > size + kBorderTolerance) {
        return invalid_argument("mesh '" + mesh.name + "': TEXCOORD_1 (" + std::to_string(corner.x / size) + ", " +
                                std::to_string(corner.y / size) + ") lies outside 0..1");
      }
    }
    atlas.corners_[t] = corners;
    const double area = surfaces.areas[t] * surfaces.metres_per_unit * surfaces.metres_per_unit;
    densities.emplace_back(std::sqrt(std::fabs(twice_area(corners)) / 2 / area), area);
  }
  std::sort(densities.begin(), densities.end());
  double total = 0, up_to = 0;
  for (const auto& density : densities) total += density.second;
  for (const auto& density : densities) {
    up_to += density.second;
    atlas.texels_per_meter_ = density.first;
    if (2 * up_to >= total) break;
  }

  // Sort the triangles into blocks of texels: count, then fill.
  const auto for_each_block = [&](std::uint32_t t, const auto& visit) {
    const auto& c = atlas.corners_[t];
    if (twice_area(c) == 0) return;
    const auto block = [&](double texel) {
      return std::clamp(static_cast<int>(std::floor(texel / kBlock)), 0, atlas.blocks_ - 1);
    };
    const auto [low_x, high_x] = std::minmax({c[0].x, c[1].x, c[2].x});
    const auto [low_y, high_y] = std::minmax({c[0].y, c[1].y, c[2].y});
    for (int by = block(low_y); by <= block(high_y); ++by) {
      for (int bx = block(low_x); bx <= block(high_x); ++bx) visit(static_cast<std::size_t>(by) * atlas.blocks_ + bx);
    }
  };
  atlas.first_in_block_.assign(static_cast<std::size_t>(atlas.blocks_) * atlas.blocks_ + 1, 0);
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    for_each_block(t, [&](std::size_t block) { ++atlas.first_in_block_[block + 1]; });
  }
  for (std::size_t b = 0; b + 1 < atlas.first_in_block_.size(); ++b) {
    atlas.first_in_block_[b + 1] += atlas.first_in_block_[b];
  }
  atlas.in_block_.resize(atlas.first_in_block_.back());
  std::vector<std::uint64_t> next(atlas.first_in_block_.begin(), atlas.first_in_block_.end() - 1);
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    for_each_block(t, [&](std::size_t block) { atlas.in_block_[next[block]++] = t; });
  }
  RADBAKE_RETURN_IF_ERROR(atlas.check_overlap());
  atlas.count_texels();
  if (atlas.num_texels_ == 0) return invalid_argument("TEXCOORD_1 covers no texel: every triangle has no area in it");
  return atlas;
}

void Atlas::footprint(int x, int y, Footprint& out) const {
  out.pieces.clear();
  out.coverage = 0;
  const std::size_t block = static_cast<std::size_t>(y / kBlock) * blocks_ + x / kBlock;
  for (std::uint64_t k = first_in_block_[block]; k < first_in_block_[block + 1]; ++k) {
    const std::uint32_t t = in_block_[k];
    const auto& c = corners_[t];
    const auto [low_x, high_x] = std::minmax({c[0].x, c[1].x, c[2].x});
    const auto [low_y, high_y] = std::minmax({c[0].y, c[1].y, c[2].y});
    if (low_x >= x + 1 || high_x <= x || low_y >= y + 1 || high_y <= y) continue;
    Polygon polygon;
    for (const Vec2 corner : c) polygon.add(corner);
    polygon = clipped(polygon, 0, x, 1);
    polygon = clipped(polygon, 0, x + 1, -1);
    polygon = clipped(polygon, 1, y, 1);
    polygon = clipped(polygon, 1, y + 1, -1);

    // Barycentric weights of a point p: u = (p - c0) x (c2 - c0) / D, v = (c1 - c0) x (p - c0) / D.
    const double determinant = twice_area(c);
    const auto weights = [&](Vec2 p) {
      return Vec2{cross(p - c[0], c[2] - c[0]) / determinant, cross(c[1] - c[0], p - c[0]) / determinant};
    };
    for (int corner = 2; corner < polygon.size; ++corner) {
      const std::array<Vec2, 3> fan = {polygon.corners[0], polygon.corners[corner - 1], polygon.corners[corner]};
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
  std::atomic<std::uint64_t> total = 0;
  for_each_range(static_cast<std::size_t>(size_), kBlock, [&](std::size_t begin, std::size_t end) {
    std::uint64_t count = 0;
    Footprint footprint;
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < size_; ++x) {
        this->footprint(x, y, footprint);
        count += !footprint.is_empty();
      }
    }
    total += count;
  });
  num_texels_ = total;
}

Result<void> Atlas::check_overlap() const {
  // A grid of points, no finer than texels: a point strictly inside two triangles lies on two surfaces.
  constexpr std::uint32_t kNobody = 0xffffffffu;
  std::vector<std::uint32_t> owner(static_cast<std::size_t>(size_) * size_, kNobody);
  std::uint64_t covered = 0, shared = 0;
  std::set<std::pair<std::string, std::string>> guilty;
  for (std::uint32_t t = 0; t < corners_.size(); ++t) {
    const auto& c = corners_[t];
    const double determinant = twice_area(c);
    if (determinant == 0) continue;
    const auto [low_x, high_x] = std::minmax({c[0].x, c[1].x, c[2].x});
    const auto [low_y, high_y] = std::minmax({c[0].y, c[1].y, c[2].y});
    const auto texel = [this](double at) { return std::clamp(static_cast<int>(at), 0, size_ - 1); };
    for (int y = texel(low_y); y <= texel(high_y); ++y) {
      for (int x = texel(low_x); x <= texel(high_x); ++x) {
        const Vec2 p{x + 0.5, y + 0.5};
        constexpr double kStrictlyInside = 1e-3;
        const double u = cross(p - c[0], c[2] - c[0]) / determinant, v = cross(c[1] - c[0], p - c[0]) / determinant;
        if (u < kStrictlyInside || v < kStrictlyInside || u + v > 1 - kStrictlyInside) continue;
        std::uint32_t& first = owner[static_cast<std::size_t>(y) * size_ + x];
        if (first == kNobody) {
          first = t;
          ++covered;
        } else {
          ++shared;
          if (guilty.size() < 3) guilty.emplace(surfaces_->mesh(first).name, surfaces_->mesh(t).name);
        }
      }
    }
  }
  // Charts packed without padding may share single texels at a small atlas; layouts that overlap share many.
  constexpr double kTolerated = 0.002;
  if (static_cast<double>(shared) <= kTolerated * static_cast<double>(covered)) return {};
  std::string names;
  for (const auto& [a, b] : guilty) {
    names += (names.empty() ? "" : ", ") + (a == b ? "'" + a + "' with itself" : "'" + a + "' with '" + b + "'");
  }
  return invalid_argument("TEXCOORD_1 overlaps on " + std::to_string(shared) + " of " + std::to_string(covered) +
                          " texels: " + names + "; one layout must hold the whole scene");
}

}  // namespace radbake::radiosity
