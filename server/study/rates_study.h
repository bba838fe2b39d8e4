#pragma once

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/study/plot.h"

namespace radbake::study {

/// How far the sampled estimators go.
struct RateLimits {
  int max_rays = 1 << 20;           ///< of a replicate, a power of 4 times 16
  int max_resolution = 512;         ///< of hemicubes at a place, a power of two
  int max_resolution_of_pair = 64;  ///< of hemicubes over a polygon: as many places as pixels a side
  int num_replicates = 16;
};

/// What is sampled, and against what.
enum class RateKind {
  kHemisphere,     ///< rays over the whole of `from`, over their number
  kHemicubePlace,  ///< a hemicube against the form factor of the place that it stands on, over its resolution
  kHemicubePair,   ///< r hemicubes over `from`, over r
};
inline constexpr RateKind kAllRateKinds[] = {RateKind::kHemisphere, RateKind::kHemicubePlace, RateKind::kHemicubePair};
const char* rate_kind_name(RateKind kind);

/// How hard a pair is. Touching: parts of the polygons are nearer to each other than a hundredth of their perimeter.
enum class PairGroup { kApart, kTouching, kOccluded };
inline constexpr PairGroup kAllPairGroups[] = {PairGroup::kApart, PairGroup::kTouching, PairGroup::kOccluded};
const char* pair_group_name(PairGroup group);

/// Root mean square error of the replicates of one case, over rays or resolution.
struct RateCurve {
  std::string id;
  PairGroup group = PairGroup::kApart;
  double form_factor = 0;
  RateKind kind = RateKind::kHemisphere;
  std::vector<std::array<double, 2>> points;
};

struct RateStudy {
  std::vector<RateCurve> curves;
  std::vector<std::string> left_out;  ///< cases and why: refused, or a form factor within 1e-3 of 0 or 1
};

/// Measures the errors of rays and hemicubes against the analytic form factor, case by case.
///
/// Cases as of study_form_factors(); `exact` is not used. Errors are those of single replicates, not of their mean.
/// Cost: some 10 seconds a case at the limits by default.
RateStudy study_rates(const nlohmann::ordered_json& cases, const RateLimits& limits);

/// case,group,form_factor,estimator,size,rms_error; size: rays, or pixels along a side.
std::string rate_csv(const RateStudy& study);

/// Slopes by estimator and group, mean over the cases with its interval of 95 %, beside what theory says.
std::string rate_table(const RateStudy& study);

/// Geometric means over the cases of a group, and the reference slopes.
Plot rate_plot(const RateStudy& study);

}  // namespace radbake::study
