#include "server/radiosity/lightmap/given_layout.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

namespace radbake::radiosity {
namespace {

/// Coordinates may leave 0..1 by this much: quantisation on the wire moves them by up to 0.01 texel of 4096.
constexpr double kBorderTolerance = 0.05 / 4096;
/// Share of a mesh that may lie without area in the layout and then stay without light of its own.
constexpr double kToleratedWithoutArea = 0.01;
constexpr std::size_t kNamedPairs = 3;

}  // namespace

PlaneTriangle given_corners(const Surfaces& surfaces, std::uint32_t triangle) {
  const auto& texcoord = surfaces.mesh(triangle).texcoord1;
  const auto& vertices = surfaces.vertices(triangle);
  return {texcoord[vertices[0]], texcoord[vertices[1]], texcoord[vertices[2]]};
}

std::string given_fault(const Surfaces& surfaces, std::uint32_t mesh, const MeshRange& range) {
  if (surfaces.scene->meshes[mesh].texcoord1.empty()) return "has no TEXCOORD_1";
  double all = 0, without_area = 0;
  for (std::uint32_t t = range.begin; t < range.end; ++t) {
    const PlaneTriangle corners = given_corners(surfaces, t);
    for (const Vec2 corner : corners) {
      if (std::min(corner.x, corner.y) >= -kBorderTolerance && std::max(corner.x, corner.y) <= 1 + kBorderTolerance) {
        continue;
      }
      return "has a TEXCOORD_1 (" + std::to_string(corner.x) + ", " + std::to_string(corner.y) + ") outside 0..1";
    }
    all += surfaces.areas[t];
    if (twice_area(corners) == 0) without_area += surfaces.areas[t];
  }
  if (without_area <= kToleratedWithoutArea * all) return {};
  return "has a TEXCOORD_1 that gives " + std::to_string(static_cast<int>(std::round(100 * without_area / all))) +
         " % of it no area";
}

GivenOverlap given_overlap(const Surfaces& surfaces, const std::vector<MeshRange>& ranges) {
  std::vector<PlaneTriangle> corners;
  std::vector<std::uint32_t> triangles;
  double covered = 0;
  for (const MeshRange& range : ranges) {
    for (std::uint32_t t = range.begin; t < range.end; ++t) {
      corners.push_back(given_corners(surfaces, t));
      triangles.push_back(t);
      covered += std::fabs(twice_area(corners.back())) / 2;
    }
  }
  GivenOverlap overlap;
  if (!(covered > 0)) return overlap;
  double shared = 0;
  std::set<std::pair<std::uint32_t, std::uint32_t>> named;
  PlaneGrid grid(corners);
  // Rounding and quantisation let neighbours share slivers: those are not worth a name.
  constexpr double kNamedShare = 1e-3;
  for (std::uint32_t k = 0; k < corners.size(); ++k) {
    grid.for_each_near(corners[k], [&](std::uint32_t other) {
      const double both = shared_area(corners[k], corners[other]);
      shared += both;
      const double smaller = std::min(std::fabs(twice_area(corners[k])), std::fabs(twice_area(corners[other]))) / 2;
      const auto pair = std::pair(surfaces.meshes[triangles[other]], surfaces.meshes[triangles[k]]);
      if (both > kNamedShare * smaller && named.size() < kNamedPairs && named.insert(pair).second) {
        const auto name = [&](std::uint32_t mesh) { return "'" + surfaces.scene->meshes[mesh].name + "'"; };
        overlap.names += (overlap.names.empty() ? "" : ", ") + name(pair.first) + " with " +
                         (pair.first == pair.second ? "itself" : name(pair.second));
      }
      return true;
    });
    // Many instances of one layout: enough is known.
    if (named.size() == kNamedPairs && shared > kToleratedOverlap * covered) break;
    grid.insert(k, corners[k]);
  }
  overlap.share = shared / covered;
  return overlap;
}

}  // namespace radbake::radiosity
