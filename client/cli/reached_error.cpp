#include "client/cli/reached_error.h"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "client/cli/proto_json.h"

namespace radbake::cli {
namespace {

using Json = nlohmann::ordered_json;

/// The digits of error_percent.
std::string digits(double share) {
  char text[40];
  std::snprintf(text, sizeof text, share < 0.0995 ? "%.2g" : "%.0f", 100 * share);
  return text;
}

std::string with_interval(double error, double low, double high) {
  return "error " + error_percent(error) + " (" + digits(low) + ".." + error_percent(high) + ")";
}

Json number_or_null(double value) { return value > 0 ? Json(value) : Json(); }

}  // namespace

std::string error_percent(double share) { return digits(share) + " %"; }

std::string progress_words(const v1::Progress& progress) {
  std::string text;
  if (progress.relative_error() > 0) {
    text = with_interval(progress.relative_error(), progress.relative_error_low(), progress.relative_error_high());
    if (progress.asked_error() > 0) text += ", asked " + error_percent(progress.asked_error());
  }
  return text;
}

std::string limit_words(const std::string& limited_by) {
  if (limited_by == "time") return "the time was up";
  if (limited_by == "stopped") return "the bake was asked to finish";
  if (limited_by == "memory") return "more takes too much memory";
  if (limited_by == "discretisation") return "the patches cannot be finer";
  if (limited_by == "passes") return "the passes are used up";
  return limited_by;
}

std::string reached_line(const v1::ErrorReport& error) {
  std::string text = with_interval(error.relative_rmse(), error.interval_low(), error.interval_high());
  if (error.asked() > 0) {
    text += ", asked " + error_percent(error.asked());
    if (!error.reached()) text += ", not reached";
  }
  if (!error.limited_by().empty()) text += ": " + limit_words(error.limited_by());
  const v1::WorstTexels& worst = error.worst_1_percent();
  if (worst.error() > 0) {
    text += "; worst 1 % of the texels " + error_percent(worst.error()) + ", most of them near (" +
            std::to_string(worst.x()) + ", " + std::to_string(worst.y()) + ") of lightmap_" +
            std::to_string(worst.lightmap());
    if (!worst.mesh().empty()) text += " on '" + to_utf8(worst.mesh()) + "'";
  }
  return text;
}

Json error_json(const v1::ErrorReport& error) {
  return {{"relative_rmse", error.relative_rmse()},
          {"interval95", {error.interval_low(), error.interval_high()}},
          {"algebraic", error.algebraic()},
          {"sampling", error.sampling()},
          {"discretisation", error.discretisation()},
          {"worst_1_percent", to_json(error.worst_1_percent())},
          {"asked", number_or_null(error.asked())},
          {"predicted", number_or_null(error.predicted())},
          {"reached", error.reached()},
          {"limited_by", error.limited_by().empty() ? Json() : Json(error.limited_by())},
          {"texels", error.num_texels()}};
}

}  // namespace radbake::cli
