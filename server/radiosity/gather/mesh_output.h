#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/radiosity/gather/vertex_groups.h"
#include "server/radiosity/lightmap/layout.h"

namespace radbake::radiosity {

/// What a bake gives one scene mesh: its place in the lightmaps, and its light by vertex.
/// The first vertices are the mesh's own, in its order; copies follow.
/// Shapes: source_vertices [n], triangles [scene triangles], both empty where nothing is split; uvs, irradiance [n] or
/// empty.
struct MeshOutput {
  MeshPlacement placement;
  std::uint32_t num_vertices = 0;
  std::vector<std::uint32_t> source_vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<float, 2>> uvs;         ///< where the mesh was unwrapped
  std::vector<std::array<float, 3>> irradiance;  ///< lx
};

/// Light by vertex, as make_mesh_outputs() takes it.
struct VertexLight {
  const VertexGroups& groups;
  std::span<const Vec3> irradiance;  ///< [groups]
};

/// Splits vertices between charts and at creases. `layout`, `light`: null where there is none.
/// Shapes: returns [scene meshes].
std::vector<MeshOutput> make_mesh_outputs(const Surfaces& surfaces, const Layout* layout, const VertexLight* light);

}  // namespace radbake::radiosity
