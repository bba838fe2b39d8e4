#pragma once

#include <stop_token>

#include "server/radiosity/bake/bake.h"
#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/plan/predict.h"

namespace radbake::radiosity {

/// What a pilot may take: a share of the bake that it predicts, and CPU seconds.
inline constexpr double kPilotShare = 0.03, kPilotSeconds = 1;
/// A bake that stored costs predict to be shorter needs no pilot.
inline constexpr double kNoPilotSeconds = 1;

/// Predicts the rest of a bake from a few of its rows and receivers, spread over the scene by a fixed pattern.
///
/// They are traced as the bake will, timed each on its thread, and thrown away: a bake's bytes are the same with and
/// without. Where the costs in the options predict under a second nothing is traced.
/// `preparing_seconds`: CPU that the preparation took. Stopped early, the prediction means nothing.
Prediction predict_bake(const Preparation& prepared, double preparing_seconds, const std::stop_token& stop);

/// What things cost by the stages of a bake that has ended; 0 of what it did not do.
HostCosts measured_costs(const BakeReport& report);

}  // namespace radbake::radiosity
