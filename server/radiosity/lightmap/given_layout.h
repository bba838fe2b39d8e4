#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/radiosity/lightmap/plane_triangles.h"
#include "server/radiosity/survey/mesh_edges.h"
#include "server/radiosity/survey/surfaces.h"

namespace radbake::radiosity {

/// A triangle's TEXCOORD_1. Precondition: its mesh has it.
PlaneTriangle given_corners(const Surfaces& surfaces, std::uint32_t triangle);

/// Why a mesh's TEXCOORD_1 cannot serve as it is, to follow its name: "has no TEXCOORD_1"; empty where it can, as far
/// as the mesh alone shows.
std::string given_fault(const Surfaces& surfaces, std::uint32_t mesh, const MeshRange& range);

/// Where triangles lie on each other in TEXCOORD_1.
struct GivenOverlap {
  double share = 0;   ///< of the covered area; a lower bound, where it is above kToleratedOverlap
  std::string names;  ///< of the first few pairs of meshes: "'a' with 'b', 'c' with itself"
};

/// Artists' charts that touch may share slivers; layouts that overlap share much.
inline constexpr double kToleratedOverlap = 0.002;

/// Tests the triangles of some meshes against each other. Precondition: given_fault() is empty for all.
GivenOverlap given_overlap(const Surfaces& surfaces, const std::vector<MeshRange>& ranges);

}  // namespace radbake::radiosity
