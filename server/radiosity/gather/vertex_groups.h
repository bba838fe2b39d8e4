#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "server/radiosity/survey/surfaces.h"

namespace radbake::radiosity {

inline constexpr std::uint32_t kNoGroup = std::numeric_limits<std::uint32_t>::max();

/// The corners of triangles that receive one light: those that meet at one place of a mesh without a crease between.
///
/// Where the mesh has normals, corners belong together that have about the same one (a texture seam splits nothing);
/// where it has none, those whose triangles are joined by edges that are not sharper than 40 degrees.
struct VertexGroups {
  std::vector<std::array<std::uint32_t, 3>> of_corner;  ///< [triangles]
  std::vector<std::uint32_t> first_corner;              ///< [groups + 1], into corners
  std::vector<std::uint32_t> corners;                   ///< 3 * triangle + corner, ascending in each group

  std::size_t size() const { return first_corner.size() - 1; }
};

/// Groups are numbered by their first corner.
VertexGroups group_vertices(const Surfaces& surfaces);

}  // namespace radbake::radiosity
