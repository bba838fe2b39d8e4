#pragma once

#include <string>

#include "radbake/v1/bake.pb.h"
#include "radbake/v1/plan.pb.h"
#include "radbake/v1/result.pb.h"
#include "server/radiosity/bake/bake.h"

namespace radbake::worker {

/// The library's plain structs to the wire, field for field.

/// Without the prediction.
v1::Plan to_message(const radiosity::BakePlan& plan);
v1::Prediction to_message(const radiosity::Prediction& prediction);
v1::HostCosts to_message(const radiosity::HostCosts& costs);
v1::Progress to_message(const radiosity::BakeProgress& progress);
v1::LayerTile to_message(const radiosity::Tile& tile);
/// Without the blob, which is named when it has been sent.
v1::Layer to_message(const radiosity::Layer& layer);
/// A mesh's result, and its data appended to those of the meshes before it.
v1::MeshResult to_message(const radiosity::MeshOutput& mesh, std::string& data);
/// Without the engine's version and without `run`, which the library does not know.
v1::BakeReport to_message(const radiosity::BakeReport& report);

}  // namespace radbake::worker
