#pragma once

#include <cstdint>
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

/// Checks what a request says of the error to reach and of the time it may take: an error is a share of 1, a time at
/// most kMaxTimeBudgetMs, and both choose the rays themselves. Empty: nothing is wrong.
std::optional<FieldProblem> find_target_problem(const v1::BakeSettings& settings);

/// Checks what the bake itself would refuse: fewer rays or patches, wider texels than its least, layers where there is
/// no lightmap. Empty: nothing is wrong.
std::optional<FieldProblem> find_size_problem(const v1::BakeSettings& settings);

inline constexpr std::uint64_t kMaxTimeBudgetMs = std::uint64_t{30} * 24 * 3600 * 1000;

}  // namespace radbake::settings
