#include "client/cli/predictions.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace radbake::cli {
namespace {

v1::RunReport run_report() {
  v1::RunReport run;
  run.set_cpu_seconds(12.3);
  run.set_peak_memory_bytes(512 << 20);
  for (const char* name : {"form_factors", "solving"}) {
    v1::StagePrediction& stage = *run.mutable_prediction()->add_stages();
    stage.set_stage(name);
    stage.set_cpu_seconds(5);
    stage.set_cpu_seconds_low(4);
    stage.set_cpu_seconds_high(6);
  }
  v1::StagePrediction& total = *run.mutable_prediction()->mutable_total();
  total.set_cpu_seconds(10.9);
  total.set_cpu_seconds_low(9.8);
  total.set_cpu_seconds_high(13.1);
  total.set_memory_bytes(480 << 20);
  v1::StageSeconds& actual = *run.add_cpu_stages();
  actual.set_stage("form_factors");
  actual.set_seconds(5.5);
  return run;
}

TEST(Predictions, StandBesideWhatCameOfThem) {
  EXPECT_EQ(prediction_table(run_report()).dump(),
            R"({"stages":[{"stage":"form_factors","predicted_cpu_seconds":5.0,"low":4.0,"high":6.0,)"
            R"("actual_cpu_seconds":5.5},{"stage":"solving","predicted_cpu_seconds":5.0,"low":4.0,"high":6.0,)"
            R"("actual_cpu_seconds":null}],"total":{"predicted_cpu_seconds":10.9,"low":9.8,"high":13.1,)"
            R"("actual_cpu_seconds":12.3},"memory":{"predicted_bytes":503316480,"actual_bytes":536870912}})");
}

TEST(Predictions, FitOneLine) {
  EXPECT_EQ(prediction_line(run_report()),
            "took 12 s of CPU time, predicted 11 s (9.8 s to 13 s), and 512 MB of memory, predicted 480 MB");
  v1::RunReport unpredicted;
  unpredicted.set_cpu_seconds(3.7);
  unpredicted.set_peak_memory_bytes(41 << 20);
  EXPECT_EQ(prediction_line(unpredicted), "took 3.7 s of CPU time and 41 MB of memory");
}

}  // namespace
}  // namespace radbake::cli
