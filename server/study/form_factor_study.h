#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace radbake::study {

/// analytic: by formula; hemicube, hemisphere: sampled, until the stated error is within the tolerance or their limits
/// (sampled_pair.h) end it; adaptive: by formula where the pair is near or subtends much, else by rays.
enum class PairEstimator { kAnalytic, kHemicube, kHemisphere, kAdaptive };

/// Errors: kInvalidArgument that lists the names.
Result<PairEstimator> pair_estimator_by_name(std::string_view name);

/// Form factors of polygon pairs, case by case.
///
/// A case: {"id", "polygons": [[[x, y, z], ...], ...], "from", "to", "occluders": [indices], "exact" (optional)}.
/// Returns {"cases": [{id, form_factor, stated_error, true_error, microseconds, method, pass}]}. `true_error` and
/// `pass` are null without `exact`; a case that is refused has a null form_factor and an `error`, and the others go on.
/// pass: the true error is within the stated one (or 1e-12) and within the tolerance, and the stated one within ten
/// times the tolerance.
nlohmann::ordered_json study_form_factors(const nlohmann::ordered_json& cases, PairEstimator estimator,
                                          double tolerance);

/// The result as a table for people, with a line of totals.
std::string form_factor_table(const nlohmann::ordered_json& result);

}  // namespace radbake::study
