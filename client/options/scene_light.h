#pragma once

#include <optional>

#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::options {

/// Adds the command line's sky and sun to a scene.
void add_sky_and_sun(const std::optional<Vec3>& sky, const std::optional<DirectionalLight>& sun, Scene& scene);

/// Whether anything shines: a sky, a lamp, or a material that emits and that a triangle has.
bool has_light(const Scene& scene);

/// Refuses a scene that would bake to black. Errors: kInvalidArgument says how to add a light.
Result<void> require_light(const Scene& scene, const std::string& scene_name);

}  // namespace radbake::options
