#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene.h"
#include "server/radiosity/bake/bake.h"

namespace radbake::study {

/// A bake in this process, and the time that it took: without server, transfer and files.
struct TimedBake {
  radiosity::BakeOutcome outcome;
  double seconds = 0;
};

/// Errors: as bake_scene().
Result<TimedBake> bake_timed(const Scene& scene, const radiosity::BakeOptions& options);

/// Seconds by stage, and what was done.
std::string bake_table(const TimedBake& bake);

/// Writes each lightmap as DIR/NAME.exr. Errors: kInternal with the file's name.
Result<void> write_lightmaps(const radiosity::BakeOutcome& outcome, const std::filesystem::path& folder);

}  // namespace radbake::study
