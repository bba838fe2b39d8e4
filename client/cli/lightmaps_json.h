#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "client/cli/mesh_results.h"
#include "client/cli/options.h"
#include "client/gltf/read_gltf.h"
#include "radbake/v1/result.pb.h"

namespace radbake::cli {

/// The file's name of a layer in an encoding: lightmap_0.exr, lightmap_0.hdr, lightmap_0_rgbm.png.
std::string image_name(const std::string& layer, Encoding encoding);

/// Whether a layer holds the standard errors of a lightmap: error_N.
bool is_error_map(const v1::Layer& layer);

/// The encodings of a layer's files: standard errors are numbers and stay float32.
std::vector<Encoding> encodings_of(const v1::Layer& layer, const FileChoices& files);

/// A lightmap of a result folder.
struct LightmapFiles {
  v1::Layer layer;
  double max_irradiance = 0;  ///< over all texels and channels, in the layer's unit
  double intensity = 1;       ///< lx that 1 stands for in RGBM and in MOZ_lightmap; positive
};

/// lightmaps.json: which primitive of which node lies where in which file, and what the numbers in the files mean.
/// Every key is described in client/cli/docs/lightmaps.md.
///
/// `extra_layers`: lightmap_N_direct and the like, and error_N, listed under the lightmap_N whose layout they share.
/// `node_names`: of the file, [nodes]. Equal bakes give equal bytes.
nlohmann::ordered_json make_lightmaps_json(const std::vector<LightmapFiles>& lightmaps,
                                           const std::vector<LightmapFiles>& extra_layers, const FileChoices& files,
                                           const gltf::GltfScene& scene, const std::vector<std::string>& node_names,
                                           const MeshResults& results);

}  // namespace radbake::cli
