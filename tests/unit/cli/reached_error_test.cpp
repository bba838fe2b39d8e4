#include "client/cli/reached_error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace radbake::cli {
namespace {

using Json = nlohmann::ordered_json;

v1::ErrorReport error_report() {
  v1::ErrorReport error;
  error.set_relative_rmse(0.019);
  error.set_interval_low(0.0172);
  error.set_interval_high(0.0213);
  error.set_algebraic(0.001);
  error.set_sampling(0.015);
  error.set_discretisation(0.011);
  v1::WorstTexels& worst = *error.mutable_worst_1_percent();
  worst.set_error(0.121);
  worst.set_lightmap(1);
  worst.set_x(30);
  worst.set_y(40);
  worst.set_mesh("room/wall#0");
  error.set_num_texels(1000);
  return error;
}

TEST(ReachedError, HasTwoDigitsThatCount) {
  EXPECT_EQ(error_percent(0.0312), "3.1 %");
  EXPECT_EQ(error_percent(0.02), "2 %");
  EXPECT_EQ(error_percent(0.00251), "0.25 %");
  EXPECT_EQ(error_percent(0.0996), "10 %");
  EXPECT_EQ(error_percent(0.123), "12 %");
  EXPECT_EQ(error_percent(1.5), "150 %");
}

TEST(ReachedError, IsToldWhileTheBakeRunsAsFarAsItIsKnown) {
  v1::Progress progress;
  progress.set_asked_error(0.02);
  EXPECT_EQ(progress_words(progress), "");
  progress.set_relative_error(0.031);
  progress.set_relative_error_low(0.028);
  progress.set_relative_error_high(0.0352);
  EXPECT_EQ(progress_words(progress), "error 3.1 % (2.8..3.5 %), asked 2 %");
  progress.set_asked_error(0);
  EXPECT_EQ(progress_words(progress), "error 3.1 % (2.8..3.5 %)");
}

TEST(ReachedError, IsToldInTheEndWithTheWorstTexels) {
  v1::ErrorReport error = error_report();
  const std::string worst = "; worst 1 % of the texels 12 %, most of them near (30, 40) of lightmap_1 on 'room/wall#0'";
  EXPECT_EQ(reached_line(error), "error 1.9 % (1.7..2.1 %)" + worst);
  error.set_asked(0.02);
  error.set_reached(true);
  EXPECT_EQ(reached_line(error), "error 1.9 % (1.7..2.1 %), asked 2 %" + worst);
  error.clear_worst_1_percent();
  EXPECT_EQ(reached_line(error), "error 1.9 % (1.7..2.1 %), asked 2 %");
}

TEST(ReachedError, SaysWhyWhatWasAskedWasNotReached) {
  v1::ErrorReport error = error_report();
  error.clear_worst_1_percent();
  error.set_asked(0.01);
  for (const auto& [limit, words] : {std::pair{"time", "the time was up"},
                                     {"stopped", "the bake was asked to finish"},
                                     {"memory", "more takes too much memory"},
                                     {"discretisation", "the patches cannot be finer"},
                                     {"passes", "the passes are used up"},
                                     {"weather", "weather"}}) {
    error.set_limited_by(limit);
    EXPECT_EQ(reached_line(error), std::string("error 1.9 % (1.7..2.1 %), asked 1 %, not reached: ") + words);
  }
}

TEST(ReachedError, IsInTheReportAsFractionsAndNullsForWhatIsNotThere) {
  v1::ErrorReport error = error_report();
  EXPECT_EQ(error_json(error).dump(),
            R"({"relative_rmse":0.019,"interval95":[0.0172,0.0213],"algebraic":0.001,"sampling":0.015,)"
            R"("discretisation":0.011,"worst_1_percent":{"error":0.121,"lightmap":1,"x":30,"y":40,)"
            R"("mesh":"room/wall#0"},"asked":null,"predicted":null,"reached":false,"limited_by":null,)"
            R"("texels":1000})");
  error.set_asked(0.02);
  error.set_predicted(0.018);
  error.set_reached(true);
  error.set_limited_by("time");
  const Json json = error_json(error);
  EXPECT_EQ(json["asked"], 0.02);
  EXPECT_EQ(json["predicted"], 0.018);
  EXPECT_EQ(json["reached"], true);
  EXPECT_EQ(json["limited_by"], "time");
}

}  // namespace
}  // namespace radbake::cli
