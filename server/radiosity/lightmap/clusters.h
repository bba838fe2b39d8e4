#pragma once

#include <cstdint>
#include <vector>

#include "server/radiosity/survey/surfaces.h"

namespace radbake::radiosity {

/// Neighbouring triangles that face about one way.
struct Cluster {
  std::vector<std::uint32_t> triangles;  ///< ascending
  Vec3 axis;                             ///< unit length
  double half_angle = 0;                 ///< every normal lies within it of the axis, radians
};

/// Merges triangles [begin, end) across their shared edges, the flattest and most compact pair first, as long as all
/// normals of a cluster lie within max_half_angle of an axis. Edges folded by more than max_fold are never crossed.
/// Clusters come in the order of their first triangles.
/// Source: Garland, Willmott & Heckbert 2001, "Hierarchical face clustering on polygonal surfaces".
std::vector<Cluster> cluster_triangles(const Surfaces& surfaces, std::uint32_t begin, std::uint32_t end,
                                       double max_half_angle, double max_fold);

}  // namespace radbake::radiosity
