#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/unit/radiosity/solve_cases.h"

namespace radbake::radiosity {
namespace {

/// What is asked of every solver on the verified enclosures, patch by patch.
constexpr double kAskedRelativeError = 1e-10;
/// A bound above that many times the error is an empty claim.
constexpr double kMostPessimism = 100;
/// Errors of fewer roundings than that, amplified by 1/(1 - rho), are rounding and may lie far below their bound.
constexpr double kRoundings = 100 * 2.2e-16;

class EverySolver : public testing::TestWithParam<Solver> {};

INSTANTIATE_TEST_SUITE_P(Enclosures, EverySolver, testing::ValuesIn(kAllSolvers), [](const auto& info) {
  std::string name = solver_name(info.param);
  std::erase(name, '-');
  return name;
});

SolveOptions patient(double tolerance) {
  SolveOptions options;
  options.relative_tolerance = tolerance;
  options.max_sweeps = 2'000'000;  // Jacobi at rho 0.9999: ln(1e-11) / ln(0.9999) = 250 000
  return options;
}

double largest_error(const std::vector<Vec3>& radiosity, const std::vector<double>& exact) {
  double error = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    for (int c = 0; c < 3; ++c) error = std::max(error, std::fabs(radiosity[i][c] - exact[i]));
  }
  return error;
}

TEST_P(EverySolver, SolvesEveryVerifiedEnclosureToTenDigits) {
  const auto enclosures = verified_enclosures();
  ASSERT_EQ(enclosures.size(), 15u);
  for (const Enclosure& c : enclosures) {
    const Solved solved = solve_from_dark(GetParam(), c.transport, c.problem, patient(5e-11));
    EXPECT_EQ(solved.report.status, SolveStatus::kConverged)
        << c.id << ": " << solved.report.relative_error_bound << " after " << solved.report.steps;
    EXPECT_LE(largest_error(solved.radiosity, c.exact), solved.report.error_bound) << c.id;
    for (std::size_t i = 0; i < c.exact.size(); ++i) {
      EXPECT_NEAR(solved.radiosity[i].y, c.exact[i], kAskedRelativeError * c.exact[i]) << c.id << ", patch " << i;
    }
  }
}

TEST_P(EverySolver, StatesABoundThatHoldsAndIsNotEmpty) {
  double worst = 0;
  int num_runs = 0;
  for (const Enclosure& c : verified_enclosures()) {
    double rho = 0;
    for (const Vec3& r : c.problem.reflectance) rho = std::max(rho, r.x);
    const double largest = *std::max_element(c.exact.begin(), c.exact.end());
    for (const double tolerance : {10.0, 1.0, 0.3, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8}) {
      const Solved solved = solve_from_dark(GetParam(), c.transport, c.problem, patient(tolerance));
      ASSERT_EQ(solved.report.status, SolveStatus::kConverged) << c.id << " at " << tolerance;
      EXPECT_LE(solved.report.relative_error_bound, tolerance);
      const double error = largest_error(solved.radiosity, c.exact);
      EXPECT_LE(error, solved.report.error_bound) << c.id << " at " << tolerance;
      if (error <= kRoundings / (1 - rho) * largest) continue;  // stopped in rounding
      EXPECT_LE(solved.report.error_bound, kMostPessimism * error) << c.id << " at " << tolerance;
      worst = std::max(worst, solved.report.error_bound / error);
      ++num_runs;
    }
  }
  RecordProperty("largest_bound_over_error", std::to_string(worst));
  // A direct solver never stops above rounding; the others do on most runs.
  if (GetParam() != Solver::kLu) {
    EXPECT_GT(num_runs, 10);
  }
}

TEST_P(EverySolver, BoundsTheErrorOfRunsThatStopAtAnyStep) {
  for (const Enclosure& c : verified_enclosures()) {
    double rho = 0;
    for (const Vec3& r : c.problem.reflectance) rho = std::max(rho, r.x);
    const double largest = *std::max_element(c.exact.begin(), c.exact.end());
    for (const int steps : {0, 1, 2, 3, 5, 20}) {
      SolveOptions options = patient(1e-15);
      options.max_sweeps = steps;
      const Solved solved = solve_from_dark(GetParam(), c.transport, c.problem, options);
      const double error = largest_error(solved.radiosity, c.exact);
      EXPECT_LE(error, solved.report.error_bound) << c.id << " after " << steps;
      if (error > kRoundings / (1 - rho) * largest) {
        EXPECT_LE(solved.report.error_bound, kMostPessimism * error) << c.id << " after " << steps;
      }
    }
  }
}

// E = 1 and rho = 0.9999 everywhere: B = 1/(1 - rho), whatever the form factors.
TEST_P(EverySolver, FillsARandomFurnaceOfReflectance9999) {
  auto [transport, problem] = random_enclosure(10, 0.9999, 5);
  problem.source.assign(10, {1, 1, 1});
  problem.reflectance.assign(10, {0.9999, 0.9999, 0.9999});
  constexpr double kAsked = 1e-6;
  const Solved solved = solve_from_dark(GetParam(), transport, problem, patient(kAsked));
  ASSERT_EQ(solved.report.status, SolveStatus::kConverged);
  for (const Vec3& b : solved.radiosity) EXPECT_NEAR(b.z, 1e4, kAsked * 1e4);
}

TEST_P(EverySolver, AgreesWithEliminationOnRandomReciprocalEnclosures) {
  for (const double rho : {0.5, 0.95, 0.999}) {
    for (const std::size_t n : {1u, 2u, 9u, 40u}) {
      const auto [transport, problem] = random_enclosure(n, rho, 100 + n);
      constexpr double kTight = 1e-9;
      const Solved exact = solve_from_dark(Solver::kLu, transport, problem, patient(kTight));
      const Solved solved = solve_from_dark(GetParam(), transport, problem, patient(1e-8));
      ASSERT_EQ(solved.report.status, SolveStatus::kConverged) << n << " patches of reflectance " << rho;
      ASSERT_EQ(exact.report.status, SolveStatus::kConverged);
      EXPECT_LE(largest_difference(solved.radiosity, exact.radiosity),
                solved.report.error_bound + exact.report.error_bound)
          << n << " patches of reflectance " << rho;
    }
  }
}

// One light a thousand million times another: apart and together are the same.
TEST_P(EverySolver, IsLinearOverFifteenOrdersOfMagnitude) {
  for (const Enclosure& c : verified_enclosures()) {
    if (c.id != "cube_dynamic") continue;
    std::vector<Vec3> sum(c.exact.size());
    for (std::size_t lit = 0; lit < c.exact.size(); ++lit) {
      RadiosityProblem problem = c.problem;
      for (std::size_t i = 0; i < c.exact.size(); ++i) {
        if (i != lit) problem.source[i] = {};
      }
      const Solved solved = solve_from_dark(GetParam(), c.transport, problem, patient(1e-13));
      ASSERT_EQ(solved.report.status, SolveStatus::kConverged);
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += solved.radiosity[i];
    }
    constexpr double kAsked = 1e-12;
    for (std::size_t i = 0; i < sum.size(); ++i) EXPECT_NEAR(sum[i].x, c.exact[i], kAsked * c.exact[i]);
  }
}

TEST_P(EverySolver, EndsADivergingSystemAsDiverged) {
  SolveOptions options;
  EXPECT_EQ(solve_from_dark(GetParam(), facing_pair(1.2), two_mirrors(0.9), options).report.status,
            SolveStatus::kDiverged);
  RadiosityProblem not_a_number = two_mirrors(0.5);
  not_a_number.source[1].y = std::nan("");
  EXPECT_EQ(solve_from_dark(GetParam(), facing_pair(), not_a_number, options).report.status, SolveStatus::kDiverged);
  not_a_number = two_mirrors(0.5);
  not_a_number.reflectance[0].z = std::nan("");
  EXPECT_EQ(solve_from_dark(GetParam(), facing_pair(), not_a_number, options).report.status, SolveStatus::kDiverged);
}

TEST_P(EverySolver, LeavesADarkSceneExactlyDark) {
  RadiosityProblem dark = two_mirrors(0.5);
  dark.source.assign(2, {});
  const Solved solved = solve_from_dark(GetParam(), facing_pair(), dark);
  EXPECT_EQ(solved.report.status, SolveStatus::kConverged);
  EXPECT_EQ(solved.radiosity, std::vector<Vec3>(2));
}

// Patch 2 sees nothing and sends nothing; patch 3 is black: B = E for both, and no patch gets light from patch 2.
TEST_P(EverySolver, GivesEmptyRowsAndBlackPatchesTheirOwnLight) {
  const DenseOperator transport =
      dense({{0, 0.5, 0, 0.5}, {0.5, 0, 0, 0.5}, {0, 0, 0, 0}, {0.5, 0.5, 0, 0}}, {1, 1, 1, 1});
  const RadiosityProblem problem{{{1, 1, 1}, {0, 0, 0}, {7, 7, 7}, {3, 3, 3}},
                                 {{0.5, 0.5, 0.5}, {0.5, 0.5, 0.5}, {0.9, 0.9, 0.9}, {0, 0, 0}}};
  const Solved solved = solve_from_dark(GetParam(), transport, problem, patient(1e-12));
  ASSERT_EQ(solved.report.status, SolveStatus::kConverged);
  EXPECT_EQ(solved.radiosity[2].x, 7);
  EXPECT_EQ(solved.radiosity[3].x, 3);
  // B0 = 1 + (B1 + 3)/4, B1 = (B0 + 3)/4: B0 = 31/15, B1 = 19/15.
  EXPECT_NEAR(solved.radiosity[0].x, 31.0 / 15, solved.report.error_bound);
  EXPECT_NEAR(solved.radiosity[1].x, 19.0 / 15, solved.report.error_bound);
}

TEST_P(EverySolver, SolvesASceneWithoutReflectionInItsFirstSteps) {
  auto [transport, problem] = random_enclosure(12, 0, 3);
  const Solved solved = solve_from_dark(GetParam(), transport, problem, patient(1e-12));
  EXPECT_EQ(solved.report.status, SolveStatus::kConverged);
  EXPECT_EQ(solved.radiosity, problem.source);
  EXPECT_LE(solved.report.sweeps, 1);
}

TEST_P(EverySolver, StartsFromAGuessAndStopsAtOnceWhereItIsTheSolution) {
  const auto [transport, problem] = random_enclosure(20, 0.9, 8);
  Solved solved = solve_from_dark(GetParam(), transport, problem, patient(1e-9));
  const std::vector<Vec3> before = solved.radiosity;
  const auto again = solve(GetParam(), transport, problem, patient(1e-9), solved.radiosity, nullptr, {});
  ASSERT_TRUE(again.ok());
  EXPECT_EQ(again->status, SolveStatus::kConverged);
  EXPECT_EQ(again->steps, 0);
  EXPECT_EQ(solved.radiosity, before);
  // A guess far above the solution: residuals are negative.
  std::vector<Vec3> bright(20, {1e3, 1e3, 1e3});
  const auto from_above = solve(GetParam(), transport, problem, patient(1e-9), bright, nullptr, {});
  EXPECT_EQ(from_above->status, SolveStatus::kConverged);
  EXPECT_LE(largest_difference(bright, before), from_above->error_bound + solved.report.error_bound);
}

TEST_P(EverySolver, ReturnsAtOnceWhenCancelled) {
  const auto [transport, problem] = random_enclosure(40, 0.9999, 2);
  std::stop_source stopped;
  stopped.request_stop();
  std::vector<Vec3> radiosity = problem.source;
  const auto before = solve(GetParam(), transport, problem, patient(1e-10), radiosity, nullptr, stopped.get_token());
  EXPECT_EQ(before->status, SolveStatus::kCancelled);
  EXPECT_EQ(before->work, 0);
  EXPECT_EQ(radiosity, problem.source);
  EXPECT_FALSE(std::isfinite(before->error_bound));  // nothing was looked at

  // From within: no step follows the one that saw the request.
  std::stop_source stop;
  const auto during = solve(
      GetParam(), transport, problem, patient(1e-10), radiosity, [&](const SolveView&) { stop.request_stop(); },
      stop.get_token());
  EXPECT_EQ(during->status, SolveStatus::kCancelled);
  EXPECT_EQ(during->steps, 0);
  EXPECT_EQ(during->history.size(), 1u);
}

TEST_P(EverySolver, SaysSoWhenStepsOrTimeAreUsedUp) {
  if (GetParam() == Solver::kLu) GTEST_SKIP() << "is done after one step";
  const auto [transport, problem] = random_enclosure(40, 0.999, 2);
  SolveOptions few = patient(1e-10);
  few.max_sweeps = 2;
  const Solved limited = solve_from_dark(GetParam(), transport, problem, few);
  EXPECT_EQ(limited.report.status, SolveStatus::kIterationLimit);
  EXPECT_EQ(limited.report.sweeps, 2);
  SolveOptions hurried = patient(1e-10);
  hurried.time_budget_seconds = 0;
  const Solved late = solve_from_dark(GetParam(), transport, problem, hurried);
  EXPECT_EQ(late.report.status, SolveStatus::kTimeBudget);
  // Each states what it reached.
  const Solved exact = solve_from_dark(Solver::kLu, transport, problem, patient(1e-10));
  EXPECT_LE(largest_difference(limited.radiosity, exact.radiosity),
            limited.report.error_bound + exact.report.error_bound);
  EXPECT_LE(largest_difference(late.radiosity, exact.radiosity), late.report.error_bound + exact.report.error_bound);
}

TEST_P(EverySolver, RecordsAHistoryThatEndsWhereItsReportDoes) {
  const auto [transport, problem] = random_enclosure(30, 0.7, 21);
  std::vector<Vec3> radiosity(30), last;
  std::size_t num_seen = 0;
  const auto report = solve(GetParam(), transport, problem, patient(1e-8), radiosity,
                            [&](const SolveView& view) {
                              ++num_seen;
                              last.assign(view.radiosity.begin(), view.radiosity.end());
                            },
                            {});
  ASSERT_TRUE(report.ok());
  const auto& history = report->history;
  ASSERT_GE(history.size(), 2u);
  EXPECT_GE(num_seen, history.size());
  EXPECT_EQ(last, radiosity);
  EXPECT_EQ(history.front().steps, 0);
  for (std::size_t k = 1; k < history.size(); ++k) {
    EXPECT_GT(history[k].steps, history[k - 1].steps);
    EXPECT_GE(history[k].work, history[k - 1].work);
    EXPECT_GE(history[k].seconds, history[k - 1].seconds);
  }
  EXPECT_EQ(history.back().steps, report->steps);
  EXPECT_EQ(history.back().residual, report->residual);
  EXPECT_EQ(history.back().error_bound, report->error_bound);
}

}  // namespace
}  // namespace radbake::radiosity
