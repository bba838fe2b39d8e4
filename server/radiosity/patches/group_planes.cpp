#include "server/radiosity/patches/group_planes.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace radbake::radiosity {
namespace {

/// Cosine below which two edges count as being at a right angle.
constexpr double kRightAngle = 1e-6;

/// The best edge so far for a grid to run along.
struct Guide {
  Vec3 edge;
  double squared = 0;
  bool is_straight = false;  ///< meets another edge at a right angle

  void offer(Vec3 other, bool other_is_straight) {
    const double other_squared = dot(other, other);
    if (is_straight && !other_is_straight) return;
    if (is_straight == other_is_straight && other_squared <= squared) return;
    *this = {other, other_squared, other_is_straight};
  }
};

}  // namespace

std::vector<GroupPlane> group_planes(const Surfaces& surfaces, const SurfaceGroups& groups) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr std::uint32_t kNone = 0xffffffffu;
  std::vector<GroupPlane> planes(groups.num_groups);
  std::vector<Guide> guides(groups.num_groups);
  for (GroupPlane& plane : planes) plane.first_triangle = kNone;

  // Sum up normals and centroids, and look for an edge to follow.
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    GroupPlane& plane = planes[groups.group_of[t]];
    plane.first_triangle = std::min(plane.first_triangle, t);
    const auto& c = surfaces.corners[t];
    plane.axes[2] += surfaces.normals[t] * surfaces.areas[t];
    plane.centroid += (c[0] + c[1] + c[2]) * (surfaces.areas[t] / 3);
    plane.area += surfaces.areas[t];
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = c[(k + 1) % 3] - c[k], b = c[(k + 2) % 3] - c[k];
      const bool is_right_angle = std::fabs(dot(a, b)) <= kRightAngle * length(a) * length(b);
      guides[groups.group_of[t]].offer(dot(a, a) >= dot(b, b) ? a : b, is_right_angle);
    }
  }
  for (std::uint32_t g = 0; g < groups.num_groups; ++g) {
    GroupPlane& plane = planes[g];
    plane.centroid = plane.centroid / plane.area;
    plane.axes[2] = normalized(plane.axes[2]);
    const Vec3 in_plane = guides[g].edge - plane.axes[2] * dot(guides[g].edge, plane.axes[2]);
    // The normal of a needle is rounding and may lie along its edge.
    plane.axes[0] = length(in_plane) > 0 ? normalized(in_plane) : Frame(plane.axes[2]).s;
    plane.axes[1] = cross(plane.axes[2], plane.axes[0]);
    plane.low = {kInfinity, kInfinity, kInfinity};
    plane.high = -plane.low;
  }

  // Measure the extents.
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    GroupPlane& plane = planes[groups.group_of[t]];
    for (const Vec3 corner : surfaces.corners[t]) {
      const Vec3 at = plane.coordinates(corner);
      for (int axis = 0; axis < 3; ++axis) {
        plane.low[axis] = std::min(plane.low[axis], at[axis]);
        plane.high[axis] = std::max(plane.high[axis], at[axis]);
      }
    }
  }
  return planes;
}

}  // namespace radbake::radiosity
