#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/radiosity/patches/groups.h"

namespace radbake::radiosity {

/// A group's plane, which its grid is laid in.
struct GroupPlane {
  std::array<Vec3, 3> axes;  ///< along the grid's columns, along its rows, and the mean normal
  Vec3 low, high;            ///< extent along the axes
  Vec3 centroid;
  double area = 0;
  std::uint32_t first_triangle = 0;

  Vec3 coordinates(Vec3 p) const { return {dot(p, axes[0]), dot(p, axes[1]), dot(p, axes[2])}; }
};

/// The plane of each group: its columns run along the longest edge that meets another one of its triangle at a right
/// angle (the side of a rectangle, not its diagonal), or along the longest edge of all.
std::vector<GroupPlane> group_planes(const Surfaces& surfaces, const SurfaceGroups& groups);

}  // namespace radbake::radiosity
