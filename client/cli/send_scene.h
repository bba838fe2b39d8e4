#pragma once

#include "client/api/client.h"
#include "client/cli/commands.h"
#include "client/cli/report.h"
#include "client/cli/stopwatch.h"
#include "client/gltf/read_gltf.h"
#include "common/base/result.h"
#include "common/codec/scene_codec.h"

namespace radbake::cli {

/// The settings that a server would refuse, named by the option that asks for them.
Result<void> check_limits(const BakeChoices& bake, const v1::Limits& limits);

/// A scene that is ready to be sent.
struct ReadScene {
  gltf::GltfScene scene;  ///< with the command line's lights
  EncodedScene encoded;
  SceneReport report;
};

/// Reads the scene of the command line, adds its lights, refuses it without any, and encodes it. `stages` gets "read"
/// and "encode".
/// Errors: those of the readers and the encoder; kCancelled after Ctrl-C.
Result<ReadScene> read_and_encode(const CommandContext& context, Stopwatch& stages);

/// Uploads what the server has not got. `stages` gets "upload".
Result<void> upload(const CommandContext& context, api::Client& client, const EncodedScene& encoded, Stopwatch& stages);

}  // namespace radbake::cli
