#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "client/gltf/write_gltf.h"
#include "common/base/result.h"

namespace radbake::gltf {

using FileTriangles = std::vector<std::array<std::uint32_t, 3>>;

/// The vertices of a primitive that is written: the file's own in their order, then copies of some of them.
struct WrittenVertices {
  std::vector<std::uint32_t> copied;  ///< vertex of the file that each copy copies
  /// [file vertices + copies]: the vertex of BakedMesh that says its light and its place in the lightmap, or kNoVertex
  /// where no baked triangle uses it.
  std::vector<std::uint32_t> baked;
  FileTriangles triangles;  ///< in the file's order, of the written vertices; empty where nothing is split

  bool is_split() const { return !triangles.empty(); }
};

/// Carries the splits of a baked mesh over to the vertices of its file.
///
/// A vertex of the bake stands for all vertices of the file that are equal in what the bake reads; they may differ in
/// what it does not read, so each pair (vertex of the file, copy in the bake) that a triangle has becomes a vertex.
/// Triangles that were not baked (of zero area) keep the file's vertices.
///
/// Errors: kInternal where the file's triangles, the scene's and the baked ones are not those of one mesh.
Result<WrittenVertices> written_vertices(const FileTriangles& file, std::span<const std::uint32_t> scene_vertex,
                                         const Mesh& scene_mesh, const BakedMesh& baked);

}  // namespace radbake::gltf
