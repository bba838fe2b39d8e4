#pragma once

#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::radiosity {

/// Every check of a scene's values that needs no geometry: indices, finite numbers, physical ranges.
/// Errors: as survey_scene().
Result<void> check_scene_values(const Scene& scene);

}  // namespace radbake::radiosity
