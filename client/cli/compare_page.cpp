#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "client/cli/compare.h"
#include "client/cli/proto_json.h"

namespace radbake::cli {
namespace {

[[gnu::format(printf, 1, 2)]] std::string line(const char* format, ...) {
  char text[300];
  va_list values;
  va_start(values, format);
  std::vsnprintf(text, sizeof text, format, values);
  va_end(values);
  return std::string(text) + "\n";
}

}  // namespace

std::string comparison_text(const Comparison& comparison) {
  const image::MapDifference& d = comparison.difference;
  std::string text =
      line("texels %llu, mean of the reference %.6g %.6g %.6g", static_cast<unsigned long long>(d.num_texels),
           d.mean[0], d.mean[1], d.mean[2]) +
      line("rrmse %.5f, per_texel %.5f, p95 %.5f, bias %.5f", d.relative_rmse, d.per_texel, d.p95, d.bias) +
      line("texels' relative error: 50 %% %.5f, 90 %% %.5f, 95 %% %.5f, 99 %% %.5f, max %.5f at %d,%d (%+.5f)", d.p50,
           d.p90, d.p95, d.p99, std::abs(d.worst.relative), d.worst.x, d.worst.y, d.worst.relative);
  if (d.num_not_covered > 0) {
    text += line("%llu of these texels are not covered by the map", static_cast<unsigned long long>(d.num_not_covered));
  }
  if (comparison.calibration) {
    const image::Calibration& c = *comparison.calibration;
    text += line("standard errors: %.2f %% within 1.96, standardised error %.3f RMS, stated rrmse %.5f",
                 100 * c.within_95, c.standardised_rms, c.stated);
    if (c.num_without > 0) {
      text += line("%llu of these texels state no error", static_cast<unsigned long long>(c.num_without));
    }
  }
  if (!comparison.picture.empty()) {
    text += comparison.picture + line(": blue darker, red brighter than the reference, full colours at %g %%",
                                      100 * comparison.picture_limit);
  }
  return text;
}

nlohmann::ordered_json comparison_json(const Comparison& comparison) {
  const image::MapDifference& d = comparison.difference;
  nlohmann::ordered_json json = {{"texels", d.num_texels},
                                 {"texels_not_covered", d.num_not_covered},
                                 {"mean", d.mean},
                                 {"rrmse", d.relative_rmse},
                                 {"per_texel", d.per_texel},
                                 {"p95", d.p95},
                                 {"bias", d.bias},
                                 {"percentiles", {{"50", d.p50}, {"90", d.p90}, {"95", d.p95}, {"99", d.p99}}},
                                 {"worst", {{"x", d.worst.x}, {"y", d.worst.y}, {"relative", d.worst.relative}}}};
  if (comparison.calibration) {
    const image::Calibration& c = *comparison.calibration;
    json["standard_errors"] = {{"within_95", c.within_95},
                               {"standardised_rms", c.standardised_rms},
                               {"stated_rrmse", c.stated},
                               {"texels_without", c.num_without}};
  }
  if (!comparison.picture.empty()) {
    json["picture"] = {{"file", to_utf8(comparison.picture)}, {"limit", comparison.picture_limit}};
  }
  return json;
}

}  // namespace radbake::cli
