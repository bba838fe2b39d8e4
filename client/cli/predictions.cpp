#include "client/cli/predictions.h"

#include <nlohmann/json.hpp>

#include "client/cli/quantities.h"
#include "common/base/check.h"

namespace radbake::cli {
namespace {

using Json = nlohmann::ordered_json;

Json compared(const v1::StagePrediction& predicted, const Json& actual) {
  return {{"predicted_cpu_seconds", predicted.cpu_seconds()},
          {"low", predicted.cpu_seconds_low()},
          {"high", predicted.cpu_seconds_high()},
          {"actual_cpu_seconds", actual}};
}

Json actual_seconds(const v1::RunReport& run, const std::string& name) {
  for (const v1::StageSeconds& stage : run.cpu_stages()) {
    if (stage.stage() == name) return stage.seconds();
  }
  return {};
}

}  // namespace

Json prediction_table(const v1::RunReport& run) {
  RADBAKE_CHECK(run.has_prediction());
  Json table = {{"stages", Json::array()}};
  for (const v1::StagePrediction& stage : run.prediction().stages()) {
    Json row = {{"stage", stage.stage()}};
    row.update(compared(stage, actual_seconds(run, stage.stage())));
    table["stages"].push_back(std::move(row));
  }
  table["total"] = compared(run.prediction().total(), run.cpu_seconds());
  table["memory"] = {{"predicted_bytes", run.prediction().total().memory_bytes()},
                     {"actual_bytes", run.peak_memory_bytes()}};
  return table;
}

std::string prediction_line(const v1::RunReport& run) {
  const std::string took = "took " + duration(run.cpu_seconds()) + " of CPU time",
                    memory = bytes(run.peak_memory_bytes());
  if (!run.has_prediction()) return took + " and " + memory + " of memory";
  const v1::StagePrediction& predicted = run.prediction().total();
  return took + ", predicted " + duration(predicted.cpu_seconds()) + " (" + duration(predicted.cpu_seconds_low()) +
         " to " + duration(predicted.cpu_seconds_high()) + "), and " + memory + " of memory, predicted " +
         bytes(predicted.memory_bytes());
}

}  // namespace radbake::cli
