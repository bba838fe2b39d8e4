#include <algorithm>
#include <numeric>
#include <tuple>

#include "server/radiosity/survey/facts.h"
#include "server/radiosity/survey/mesh_edges.h"

namespace radbake::radiosity {
namespace {

/// Dot products that may be spent: under half a second, and a sphere of 16,000 triangles.
constexpr std::size_t kMaxWork = 400'000'000;
/// Planes that are held against all corners; vertices at one place are then made one.
constexpr std::size_t kFewPlanes = 8;

std::vector<Vec3> all_corners(const Surfaces& surfaces) {
  std::vector<Vec3> corners;
  corners.reserve(3 * surfaces.size());
  for (const auto& triangle : surfaces.corners) corners.insert(corners.end(), triangle.begin(), triangle.end());
  return corners;
}

void remove_doubles(std::vector<Vec3>& places) {
  const auto key = [](Vec3 p) { return std::tuple(p.x, p.y, p.z); };
  std::sort(places.begin(), places.end(), [&](Vec3 a, Vec3 b) { return key(a) < key(b); });
  places.erase(std::unique(places.begin(), places.end()), places.end());
}

}  // namespace

ScenePlanes find_scene_planes(const Surfaces& surfaces) {
  ScenePlanes found;
  found.is_convex = found.is_exposed = true;
  // Large triangles first: their planes are the most certain, and small ones in them need none of their own.
  std::vector<std::uint32_t> by_area(surfaces.size());
  std::iota(by_area.begin(), by_area.end(), 0);
  std::stable_sort(by_area.begin(), by_area.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return surfaces.areas[a] > surfaces.areas[b]; });
  std::vector<Vec3> vertices = all_corners(surfaces);
  std::size_t work = 0;
  for (const std::uint32_t t : by_area) {
    const Vec3 normal = surfaces.normals[t];
    const bool is_known = std::any_of(found.planes.begin(), found.planes.end(), [&](const ScenePlanes::Plane& plane) {
      return dot(plane.normal, normal) > 0 &&
             std::all_of(surfaces.corners[t].begin(), surfaces.corners[t].end(), [&](Vec3 corner) {
               return std::fabs(dot(plane.normal, corner) - plane.offset) <= kPlaneTolerance;
             });
    });
    work += found.planes.size();
    if (is_known) continue;

    // Hold a new plane against all vertices, until one tells.
    const double offset = dot(normal, surfaces.corners[t][0]);
    for (const Vec3 vertex : vertices) {
      const double height = dot(normal, vertex) - offset;
      found.is_convex &= height >= -kPlaneTolerance;
      found.is_exposed &= height <= kPlaneTolerance;
      if (!found.is_convex && !found.is_exposed) return found;
    }
    found.planes.push_back({normal, offset});
    work += vertices.size();
    if (found.planes.size() == kFewPlanes) remove_doubles(vertices);
    if (work > kMaxWork) {
      found.is_convex = found.is_exposed = false;
      return found;
    }
  }
  return found;
}

bool is_watertight(const Surfaces& surfaces) {
  const auto size = static_cast<std::uint32_t>(surfaces.size());
  return 2 * shared_edges(surfaces, 0, size).size() == 3 * surfaces.size();
}

}  // namespace radbake::radiosity
