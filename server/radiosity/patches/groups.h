#pragma once

#include <cstdint>
#include <vector>

#include "server/radiosity/survey/surfaces.h"

namespace radbake::radiosity {

/// Connected triangles of one material whose normals lie within 20 degrees of the first one's.
struct SurfaceGroups {
  std::vector<std::uint32_t> group_of;  ///< [triangles]
  std::uint32_t num_groups = 0;
};

/// Grows groups over shared edges (vertices at exactly one position count as one), in the order of the triangles.
SurfaceGroups group_surfaces(const Surfaces& surfaces);

}  // namespace radbake::radiosity
