#pragma once

#include "client/cli/options.h"
#include "common/base/digest.h"
#include "radbake/v1/bake.pb.h"

namespace radbake::cli {

/// What a command line asks of a server for a scene that is uploaded. A submit has a fresh request id.
v1::SubmitBakeRequest submit_request(const CommandLine& line, const Digest& manifest);
v1::PlanBakeRequest plan_request(const CommandLine& line, const Digest& manifest);

}  // namespace radbake::cli
