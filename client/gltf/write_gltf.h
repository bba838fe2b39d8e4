#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/gltf/read_gltf.h"
#include "common/base/result.h"
#include "common/geometry/vector.h"

namespace radbake::gltf {

/// What a bake gives one mesh of GltfScene::scene. Vertices are the mesh's own, or its own followed by copies.
/// Shapes: source_vertices [n] or empty (not split); triangles [m] of indices below n, empty where not split; uvs [n]
/// or empty; irradiance [n] or empty.
struct BakedMesh {
  int lightmap = -1;                           ///< index into LightmappedScene::lightmaps; -1: in none
  Vec2 uv_scale{1, 1}, uv_offset;              ///< where uvs is empty: final TEXCOORD_1 = scale * own + offset
  std::vector<std::uint32_t> source_vertices;  ///< which vertex of the primitive each one copies
  /// Of the output's vertices: the triangles that were baked, in any order, each from any of its corners.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::array<float, 2>> uvs;         ///< final TEXCOORD_1
  std::vector<std::array<float, 3>> irradiance;  ///< lx

  bool operator==(const BakedMesh&) const = default;
};

/// A lightmap as it is attached: an image of irradiance / intensity, linear (loaders of MOZ_lightmap do not convert).
struct LightmapImage {
  std::string name;      ///< lightmap_0
  std::string png;       ///< the file's bytes
  double intensity = 1;  ///< lx: the map's maximum
};

struct WriteOptions {
  bool vertex_colors = false;  ///< also COLOR_0, where a primitive has irradiance: irradiance / the scene's maximum
};

/// Writes the scene with its light as a .glb: the input with nothing lost, the final TEXCOORD_1, vertices split where
/// the bake split them, an own mesh and material where instances need them, lightmaps as MOZ_lightmap, irradiance by
/// vertex as _IRRADIANCE.
///
/// `source`: the file that read_gltf() read as `scene`. Shapes: baked [scene.scene.meshes].
/// Errors: kInvalidArgument as read_gltf(); kInternal where baked does not fit the scene, or the file is not written.
Result<void> write_gltf(const std::filesystem::path& path, const std::filesystem::path& source, const GltfScene& scene,
                        const std::vector<BakedMesh>& baked, const std::vector<LightmapImage>& lightmaps,
                        const WriteOptions& options);

/// The nodes' names as the file says them, empty where it does not. Errors: kInvalidArgument, as read_gltf().
Result<std::vector<std::string>> read_node_names(const std::filesystem::path& path);

}  // namespace radbake::gltf
