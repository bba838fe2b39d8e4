#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/scene/scene.h"
#include "radbake/v1/bake.pb.h"
#include "radbake/v1/result.pb.h"

namespace radbake::cli {

/// What only the client that read the scene knows.
struct SceneReport {
  std::uint64_t num_triangles_dropped = 0;  ///< by the reader, of zero area
  std::vector<Warning> warnings;            ///< of the reader
  v1::MeshTransfer mesh_transfer;
};

/// A file of a result folder and the layer that it shows.
struct LayerFiles {
  v1::Layer layer;
  std::string image;    ///< lightmap_0.exr
  std::string preview;  ///< lightmap_0.png; empty: none
};

/// report.json: the server's report, and the client's part of it.
///
/// Everything that may differ between equal bakes stands under `run`, the last key.
/// `scene`: absent where the results of a bake are downloaded later. `client_stages`: seconds of the client's stages.
nlohmann::ordered_json make_report(const v1::Bake& bake, const std::vector<LayerFiles>& layers,
                                   const std::optional<SceneReport>& scene,
                                   const std::vector<v1::StageSeconds>& client_stages);

}  // namespace radbake::cli
