#pragma once

#include <string>
#include <vector>

#include "client/gltf/write_gltf.h"
#include "common/base/result.h"
#include "common/scene/scene.h"
#include "radbake/v1/result.pb.h"

namespace radbake::cli {

/// What a bake gave the scene's meshes.
struct MeshResults {
  std::vector<gltf::BakedMesh> meshes;   ///< [scene.meshes]; of what was not sent: nothing baked
  std::vector<v1::UvSource> uv_sources;  ///< [scene.meshes]
  double max_irradiance = 0;             ///< over all vertices and channels, lx; 0 without light by vertex
};

/// Whether a layer is a lightmap of all light, lightmap_N, and not one of its parts.
bool is_lightmap(const std::string& layer);

/// Reads the meshes of a result and the arrays that they point to. A server is not trusted: every count is held against
/// the bytes that are there, every index against its list, and no number may be NaN or infinite.
///
/// `data`: the blob BakeResult.mesh_data; `scene_meshes`: EncodedScene::scene_meshes. The lightmap of a mesh is the
/// place of the one that is called lightmap_N among the result's lightmaps.
/// Errors: kInternal, naming the mesh and the value.
Result<MeshResults> read_mesh_results(const v1::BakeResult& result, const std::string& data, const Scene& scene,
                                      const std::vector<int>& scene_meshes);

}  // namespace radbake::cli
