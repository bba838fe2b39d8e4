#include "client/cli/progress_line.h"

#include <gtest/gtest.h>

namespace radbake::cli {
namespace {

TEST(ProgressLine, ShowsStageBarPercentageAndTimeLeft) {
  EXPECT_EQ(format_progress({"gathering", 0.5, 65}, 200, false),
            "gathering       [###############...............]   50 %  1 min 05 s left");
}

TEST(ProgressLine, LeavesOutATimeThatIsNotKnown) {
  EXPECT_EQ(format_progress({"solving", 0.2}, 0, false), "solving          20 %");
}

TEST(ProgressLine, SaysAHundredPercentOnlyAtTheEnd) {
  EXPECT_EQ(format_progress({"writing", 0.999}, 0, false), "writing          99 %");
  EXPECT_EQ(format_progress({"writing", 1.2}, 0, false), "writing         100 %");
}

TEST(ProgressLine, HasNoPercentageForAStageOfUnknownLength) {
  EXPECT_EQ(format_progress({"reading"}, 200, false), "reading ...");
}

TEST(ProgressLine, StaysWithinTheTerminal) {
  for (int width = 50; width <= 200; ++width) {
    EXPECT_LT(format_progress({"form factors", 0.5, 86399}, width, false).size(), static_cast<std::size_t>(width));
  }
}

TEST(ProgressLine, ShowsTheErrorOfThePassesSoFar) {
  const ProgressView view{"pass 2", 0.5, 4, "error 3.1 % (2.8..3.5 %), asked 2 %"};
  EXPECT_EQ(format_progress(view, 100, false),
            "pass 2   [##############..............]   50 %  error 3.1 % (2.8..3.5 %), asked 2 %, about 4 s left");
  // Without room for a bar there is none, and what is too long is cut: a line that wraps cannot be drawn again.
  EXPECT_EQ(format_progress(view, 75, false), "pass 2    50 %  error 3.1 % (2.8..3.5 %), asked 2 %, about 4 s left");
  EXPECT_EQ(format_progress(view, 30, false), "pass 2    50 %  error 3.1 % (");
  EXPECT_EQ(format_progress(view, 0, false), format_progress(view, 75, false));
  for (int width = 20; width <= 200; ++width) {
    EXPECT_LT(format_progress(view, width, false).size(), static_cast<std::size_t>(width));
  }
}

TEST(ProgressLine, WritesTimesForPeople) {
  EXPECT_EQ(format_seconds(0.4), "0 s");
  EXPECT_EQ(format_seconds(59.6), "1 min 00 s");
  EXPECT_EQ(format_seconds(3600), "1 h 00 min");
  EXPECT_EQ(format_seconds(7500), "2 h 05 min");
}

}  // namespace
}  // namespace radbake::cli
