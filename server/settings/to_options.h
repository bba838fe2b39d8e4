#pragma once

#include "radbake/v1/settings.pb.h"
#include "server/radiosity/plan/plan.h"

namespace radbake::settings {

/// What the wire asks for as the numeric library's options. Words that this version does not know mean: choose.
radiosity::BakeOptions to_options(const v1::BakeSettings& settings, const v1::RunOptions& run);

}  // namespace radbake::settings
