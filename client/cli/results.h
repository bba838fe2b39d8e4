#pragma once

#include <optional>
#include <stop_token>

#include "client/api/client.h"
#include "client/cli/options.h"
#include "client/cli/report.h"
#include "client/cli/reporter.h"
#include "client/cli/result_folder.h"
#include "client/cli/scene_file.h"
#include "client/cli/stopwatch.h"

namespace radbake::cli {

/// What is known of a bake and what is wanted of it.
struct ResultRequest {
  const v1::Bake& bake;
  const std::optional<SceneReport>& report;
  const std::optional<BakedScene>& scene;  ///< absent: neither scene.glb nor lightmaps.json
  const FileChoices& files;
};

/// Downloads a finished bake and publishes it in a folder: lightmaps and their previews, scene.glb, lightmaps.json and
/// the report.
///
/// `stages` so far go into the report; this adds "download" and "write" (up to the report itself).
/// Errors: those of the download; kInternal for a result that makes no sense, or a file that cannot be written.
Result<void> write_results(api::Client& client, const ResultRequest& request, ResultFolder& folder, Stopwatch& stages,
                           Reporter& reporter, std::stop_token stop);

}  // namespace radbake::cli
