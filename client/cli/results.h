#pragma once

#include <optional>
#include <stop_token>

#include "client/api/client.h"
#include "client/cli/report.h"
#include "client/cli/reporter.h"
#include "client/cli/result_folder.h"
#include "client/cli/stopwatch.h"

namespace radbake::cli {

/// Downloads a finished bake's layers and publishes them in a folder as EXR, preview and report.
///
/// `stages` so far go into the report; this adds "download" and "write" (up to the report itself).
/// Errors: those of the download; kInternal for a file that cannot be written.
Result<void> write_results(api::Client& client, const v1::Bake& bake, const std::optional<SceneReport>& scene,
                           ResultFolder& folder, Stopwatch& stages, Reporter& reporter, std::stop_token stop);

}  // namespace radbake::cli
