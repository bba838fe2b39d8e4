#pragma once

#include <cstdint>
#include <vector>

#include "common/scene/scene.h"

namespace radbake::gltf {

/// A mesh with every vertex once, and where the file's vertices went.
struct WeldedMesh {
  Mesh mesh;
  std::vector<std::uint32_t> scene_vertex;  ///< [vertices before]: the vertex of mesh, or kNoVertex
  std::uint64_t num_triangles_dropped = 0;  ///< of zero area
};

/// Drops triangles of zero area and makes vertices one that are equal in all attributes, bit for bit, numbered in the
/// order in which the triangles first use them: the ways in which files spell one surface become one mesh.
WeldedMesh weld_vertices(const Mesh& mesh);

/// A triangle's area times its unit normal; the front is where its vertices turn counter-clockwise.
Vec3 area_vector(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle);

}  // namespace radbake::gltf
