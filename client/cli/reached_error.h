#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "radbake/v1/bake.pb.h"
#include "radbake/v1/result.pb.h"

namespace radbake::cli {

// The error of a bake in words, and as report.json has it.

/// Two digits that count: "3.1 %", "0.25 %", "12 %".
std::string error_percent(double share);

/// "error 3.1 % (2.8..3.5 %), asked 2 %", as far as it is known; empty where no error is known yet.
std::string progress_words(const v1::Progress& progress);

/// Why a bake stopped before it had reached what was asked: ErrorReport.limited_by in words.
std::string limit_words(const std::string& limited_by);

/// "error 1.9 % (1.7..2.1 %), asked 2 %; worst 1 % of the texels 12 %, most of them near (3, 4) of lightmap_0 on
/// 'wall'", with the reason where what was asked was not reached.
std::string reached_line(const v1::ErrorReport& error);

/// {relative_rmse, interval95: [low, high], algebraic, sampling, discretisation,
///  worst_1_percent: {error, lightmap, x, y, mesh}, asked, predicted, reached, limited_by, texels}
///
/// Fractions. asked, predicted and limited_by are null where there is none.
nlohmann::ordered_json error_json(const v1::ErrorReport& error);

}  // namespace radbake::cli
