#pragma once

#include <filesystem>
#include <vector>

#include "client/options/bake_options.h"
#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::study {

/// A scene as `radbake submit` would send it, before meshes are quantised for the way.
struct StudyScene {
  Scene scene;
  std::vector<Warning> warnings;
};

/// Reads a .glb or .gltf file, and adds the sky and the sun that were asked for.
/// Errors: kInvalidArgument as read_gltf(); a scene without any light is refused.
Result<StudyScene> read_study_scene(const std::filesystem::path& path, const options::BakeChoices& choices);

}  // namespace radbake::study
