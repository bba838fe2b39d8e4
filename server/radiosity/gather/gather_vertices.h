#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "server/radiosity/gather/receive.h"
#include "server/radiosity/gather/vertex_groups.h"

namespace radbake::radiosity {

/// Light by vertex group. Shapes: irradiance [groups], lx.
struct GatheredVertices {
  std::vector<Vec3> irradiance;
  std::uint64_t num_filled = 0;  ///< buried groups that took their neighbours' mean, or 0 where they have none
  std::uint64_t num_rays = 0;
  std::uint64_t num_light_rays = 0;
  double mean_irradiance = 0;  ///< interpolated over the triangles, weighted by area, mean of the channels, lx
  bool is_cancelled = false;
};

/// Final gather: receive() over the quarter of each incident triangle that lies next to the vertex.
///
/// on_done is called from any thread with the number of groups done.
GatheredVertices gather_vertices(const GatherScene& scene, const VertexGroups& groups,
                                 const std::function<void(std::uint64_t)>& on_done, std::stop_token stop);

}  // namespace radbake::radiosity
