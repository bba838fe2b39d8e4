#include "server/study/plot.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <vector>

#include "server/study/line_fit.h"

namespace radbake::study {
namespace {

namespace fs = std::filesystem;

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

Plot small_plot() {
  Plot plot;
  plot.panels.push_back({"it's a panel", "x", "y", {{"falls", {{1, 1}, {10, 0.1}, {100, 0}}}}});
  return plot;
}

fs::path new_folder(const std::string& name) {
  const fs::path folder = fs::path(testing::TempDir()) / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

TEST(Plot, IsDrawnAsSvgAndPng) {
  const fs::path folder = new_folder("plot_drawn");
  const Result<void> drawn = draw(small_plot(), folder, "small");
  if (!drawn.ok() && drawn.error().code == ErrorCode::kFailedPrecondition) GTEST_SKIP() << drawn.error().message;
  ASSERT_TRUE(drawn.ok()) << drawn.error().message;
  EXPECT_NE(read(folder / "small.svg").find("it's a panel"), std::string::npos);
  EXPECT_EQ(read(folder / "small.png").substr(1, 3), "PNG");
}

TEST(Plot, WithoutGnuplotNamesThePackage) {
  const fs::path folder = new_folder("plot_without");
  const Result<void> drawn = draw(small_plot(), folder, "small", "no-such-gnuplot");
  ASSERT_FALSE(drawn.ok());
  EXPECT_EQ(drawn.error().code, ErrorCode::kFailedPrecondition);
  EXPECT_NE(drawn.error().message.find("gnuplot-nox"), std::string::npos);
}

TEST(Plot, ThatFailsSaysWhatTheProgramSaid) {
  const fs::path folder = new_folder("plot_fails");
  const fs::path program = folder / "complains";
  std::ofstream(program) << "#!/bin/sh\necho out of ink >&2\nexit 3\n";
  fs::permissions(program, fs::perms::owner_all);
  const Result<void> drawn = draw(small_plot(), folder, "small", program.string());
  ASSERT_FALSE(drawn.ok());
  EXPECT_EQ(drawn.error().code, ErrorCode::kInternal);
  EXPECT_NE(drawn.error().message.find("out of ink"), std::string::npos);
}

TEST(Plot, LeavesOutPointsThatALogarithmCannotShow) {
  const fs::path folder = new_folder("plot_points");
  ASSERT_FALSE(draw(small_plot(), folder, "small", "no-such-gnuplot").ok());
  const std::string script = read(folder / "small.gnuplot");
  EXPECT_NE(script.find("\n10 0.1\n"), std::string::npos);
  EXPECT_EQ(script.find("\n100 0\n"), std::string::npos);
}

TEST(LineFit, FindsThePowerOfALaw) {
  constexpr double kRounding = 1e-12;
  std::vector<std::array<double, 2>> points;
  for (const double x : {1.0, 3.0, 10.0, 70.0}) points.push_back({x, 5 * std::pow(x, -1.5)});
  points.push_back({100, 0});  // left out
  const Estimate slope = log_log_slope(points);
  EXPECT_NEAR(slope.value, -1.5, kRounding);
  EXPECT_NEAR(slope.half_width, 0, 1e-6);  // the root of rounding
}

TEST(LineFit, StatesTheIntervalOfASlope) {
  // log2: x 0 1 2 3, y 0 1 1 2: slope 0.6, squares about the line 0.2, standard error sqrt(0.2 / 2 / 5).
  const std::array<std::array<double, 2>, 4> points = {{{1, 1}, {2, 2}, {4, 2}, {8, 4}}};
  constexpr double kTableOfStudent = 4.3027, kPrinted = 1e-4;
  const Estimate slope = log_log_slope(points);
  EXPECT_NEAR(slope.value, 0.6, 1e-12);
  EXPECT_NEAR(slope.half_width, kTableOfStudent * std::sqrt(0.2 / 2 / 5), kPrinted);
}

TEST(LineFit, KnowsStudentsTable) {
  constexpr double kHalfAPercent = 0.005;
  const std::pair<int, double> table[] = {{1, 12.706}, {2, 4.303},  {3, 3.182},  {4, 2.776},
                                          {7, 2.365},  {15, 2.131}, {30, 2.042}, {1000, 1.962}};
  for (const auto& [degrees, t] : table) EXPECT_NEAR(student_95(degrees) / t, 1, kHalfAPercent) << degrees;
  const double values[] = {1, 2, 3};
  EXPECT_NEAR(mean_of(values).value, 2, 1e-15);
  EXPECT_NEAR(mean_of(values).half_width, 4.303 / std::sqrt(3.0), 1e-3);
}

}  // namespace
}  // namespace radbake::study
