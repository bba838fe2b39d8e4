#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "radbake/v1/result.pb.h"

namespace radbake::cli {

/// What was predicted of a bake beside what it took:
///
///   {"stages": [{stage, predicted_cpu_seconds, low, high, actual_cpu_seconds}], "total": {the same without stage},
///    "memory": {predicted_bytes, actual_bytes}}
///
/// low to high is the 95 % interval. actual_cpu_seconds of a stage that the server does not tell is null.
/// Precondition: run.has_prediction().
nlohmann::ordered_json prediction_table(const v1::RunReport& run);

/// The totals of the same in one line; without a prediction what the bake took.
std::string prediction_line(const v1::RunReport& run);

}  // namespace radbake::cli
