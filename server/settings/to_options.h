#pragma once

#include <optional>
#include <string>

#include "radbake/v1/plan.pb.h"
#include "radbake/v1/settings.pb.h"
#include "server/radiosity/plan/plan.h"

namespace radbake::settings {

/// What the wire asks for as the numeric library's options. Words that this version does not know mean: choose.
radiosity::BakeOptions to_options(const v1::BakeSettings& settings, const v1::RunOptions& run);

radiosity::HostCosts to_costs(const v1::HostCosts& costs);

/// What is wrong with a field of a request.
struct FieldProblem {
  std::string field, description;
};

/// Checks what a request says of effects and layers: known names, each once, known choices, an ambient occlusion
/// distance that is a length. Empty: nothing is wrong.
std::optional<FieldProblem> find_effect_problem(const v1::BakeSettings& settings);

}  // namespace radbake::settings
