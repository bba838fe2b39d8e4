#include "server/radiosity/bake/progress_meter.h"

#include <gtest/gtest.h>

namespace radbake::radiosity {
namespace {

class LastProgress final : public BakeObserver {
 public:
  void on_progress(const BakeProgress& progress) override { last = progress; }
  void on_tile(const Tile&) override {}
  BakeProgress last;
};

TEST(ProgressMeter, CountsNoRowsThatWereRecalledTowardsTheTimeLeft) {
  // Half of the rows were there, a tenth took most of a hundred seconds: four tenths take about four times that.
  constexpr double kSeconds = 100, kShareBesideRows = 0.1;
  const auto seconds_left_at = [](std::uint64_t rows_done) {
    LastProgress observer;
    ProgressMeter::Start start;
    start.wall -= std::chrono::seconds(static_cast<int>(kSeconds));
    ProgressMeter meter(observer, start, 0);
    meter.begin_pass(0, 1, 1000, 0);
    meter.recall_rows(0.5);
    meter.report(BakeStage::kFormFactors, rows_done, 100);
    return observer.last.seconds_left;
  };
  EXPECT_LT(seconds_left_at(50), 0);  // nobody knows yet
  EXPECT_NEAR(seconds_left_at(60), 4 * kSeconds, 4 * kSeconds * 2 * kShareBesideRows);
}

}  // namespace
}  // namespace radbake::radiosity
