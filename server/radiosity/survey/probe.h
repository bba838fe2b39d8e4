#pragma once

#include "server/radiosity/survey/survey.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// Rays that an escape share is estimated by: half a 95 % interval is 0.8 % at most.
inline constexpr int kNumProbeRays = 16384;

/// Fills in the share of cosine-distributed rays from all fronts, by area, that meet nothing, with half of its Wilson
/// interval. The rays are the same each time.
/// Source: Wilson 1927 (an interval that is right at shares of 0 and 1 too).
void probe_escape(const Surfaces& surfaces, const Visibility& visibility, Survey& survey);

}  // namespace radbake::radiosity
