#pragma once

#include <filesystem>
#include <functional>

#include "client/options/bake_options.h"
#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::options {

/// Reads a sky of every direction, image::read_environment(). Injected, so that this library needs no image library.
using EnvironmentReader = std::function<Result<TexturePlane>(const std::filesystem::path& file, double scale)>;

/// Adds the command line's sky and sun to a scene.
/// Errors: those of the reader, which is called only where a sky image was chosen.
Result<void> add_sky_and_sun(const BakeChoices& choices, const EnvironmentReader& read_environment, Scene& scene);

/// Whether anything shines: a sky, a lamp, or a material that emits and that a triangle has.
bool has_light(const Scene& scene);

/// Refuses a scene that would bake to black. Errors: kInvalidArgument says how to add a light.
Result<void> require_light(const Scene& scene, const std::string& scene_name);

}  // namespace radbake::options
