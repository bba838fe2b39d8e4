#include "server/radiosity/solve/solve.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "server/radiosity/solve/largest_key.h"
#include "tests/unit/radiosity/solve_cases.h"

namespace radbake::radiosity {
namespace {

TEST(GaussSeidel, SolvesEveryVerifiedEnclosureWithinItsBound) {
  for (const Enclosure& c : verified_enclosures()) {
    for (const double tolerance : {1e-3, 1e-6, 1e-9}) {
      SolveOptions options;
      options.relative_tolerance = tolerance;
      options.max_sweeps = 1'000'000;
      std::vector<Vec3> radiosity = c.problem.source;
      const SolveReport report =
          solve(Solver::kGaussSeidel, c.transport, c.problem, options, radiosity, nullptr, {}).value();
      EXPECT_EQ(report.status, SolveStatus::kConverged) << c.id;
      double error = 0;
      for (std::size_t i = 0; i < c.exact.size(); ++i) error = std::max(error, std::fabs(radiosity[i].y - c.exact[i]));
      EXPECT_LE(error, report.error_bound) << c.id << " at " << tolerance;
      EXPECT_LE(report.relative_error_bound, tolerance) << c.id;
    }
  }
}

TEST(GaussSeidel, SaysSoWhenTheSweepsDoNotSuffice) {
  SolveOptions options;
  options.max_sweeps = 3;
  const RadiosityProblem problem = two_mirrors(0.999);
  std::vector<Vec3> radiosity = problem.source;
  const SolveReport report =
      solve(Solver::kGaussSeidel, facing_pair(), problem, options, radiosity, nullptr, {}).value();
  EXPECT_EQ(report.status, SolveStatus::kIterationLimit);
  EXPECT_EQ(report.sweeps, 3);
  // The bound holds for what was reached, too: exact B = (1, rho) / (1 - rho^2).
  const double exact = 1 / (1 - 0.999 * 0.999);
  EXPECT_LE(std::fabs(radiosity[0].x - exact), report.error_bound);
}

TEST(GaussSeidel, IsObservedAfterEachSweep) {
  const RadiosityProblem problem = two_mirrors(0.9);
  std::vector<Vec3> radiosity = problem.source;
  std::vector<std::int64_t> sweeps;
  const auto observe = [&](const SolveView& view) { sweeps.push_back(view.step.steps); };
  const SolveReport report = solve(Solver::kGaussSeidel, facing_pair(), problem, {}, radiosity, observe, {}).value();
  // The first guess, then each sweep.
  ASSERT_EQ(sweeps.size(), static_cast<std::size_t>(report.sweeps) + 1);
  for (std::size_t k = 0; k < sweeps.size(); ++k) EXPECT_EQ(sweeps[k], static_cast<std::int64_t>(k));
}

TEST(Lu, IsRefusedAboveItsSizeUnlessAskedFor) {
  const auto [transport, problem] = random_enclosure(30, 0.5, 1);
  std::vector<Vec3> radiosity(30);
  SolveOptions options;
  EXPECT_EQ(options.max_lu_patches, 1000u);
  options.max_lu_patches = 29;
  const auto refused = solve(Solver::kLu, transport, problem, options, radiosity, nullptr, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_NE(refused.error().message.find("30"), std::string::npos) << refused.error().message;
  options.max_lu_patches = 30;
  EXPECT_TRUE(solve(Solver::kLu, transport, problem, options, radiosity, nullptr, {}).ok());
}

TEST(Lu, EndsWhereNoRefinementGainsAnyMore) {
  const auto [transport, problem] = random_enclosure(30, 0.9, 1);
  SolveOptions options;
  options.relative_tolerance = 1e-18;  // below rounding
  const Solved solved = solve_from_dark(Solver::kLu, transport, problem, options);
  EXPECT_EQ(solved.report.status, SolveStatus::kIterationLimit);
  EXPECT_LE(solved.report.steps, 5);
}

TEST(Solvers, AreKnownByName) {
  for (const Solver solver : kAllSolvers) {
    const auto found = solver_by_name(solver_name(solver));
    ASSERT_TRUE(found.ok());
    EXPECT_EQ(*found, solver);
  }
  const auto unknown = solver_by_name("gauss");
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().message.find("gauss-seidel"), std::string::npos);
}

TEST(Solvers, DefaultToKrylovWhereReflectanceIsHigh) {
  EXPECT_EQ(default_solver(0.95), Solver::kGaussSeidel);
  EXPECT_EQ(default_solver(0.951), Solver::kKrylov);
}

/// Sums of few terms in another order.
constexpr double kReordered = 1e-12;

// Gortler, Cohen & Slusallek 1993: shooting is Southwell with another choice of the next patch, one gather ahead.
TEST(SouthwellAndShooting, AgreeWithinTheirBounds) {
  const auto [transport, problem] = random_enclosure(60, 0.9, 4);
  SolveOptions options;
  options.relative_tolerance = 1e-9;
  const Solved southwell = solve_from_dark(Solver::kSouthwell, transport, problem, options);
  const Solved shooting = solve_from_dark(Solver::kShooting, transport, problem, options);
  ASSERT_EQ(southwell.report.status, SolveStatus::kConverged);
  ASSERT_EQ(shooting.report.status, SolveStatus::kConverged);
  EXPECT_LE(largest_difference(southwell.radiosity, shooting.radiosity),
            southwell.report.error_bound + shooting.report.error_bound);
}

TEST(Southwell, RelaxesTheLargestResidualAndBreaksTiesByTheSmallestPatch) {
  // Residuals are the sources 1, 2, 2 at first: patch 1 comes first, and only it has changed after one step.
  const DenseOperator transport = dense({{0, 0.5, 0.5}, {0.5, 0, 0.5}, {0.5, 0.5, 0}}, {1, 1, 1});
  RadiosityProblem problem{{{1, 1, 1}, {2, 2, 2}, {2, 2, 2}}, std::vector<Vec3>(3, {0.5, 0.5, 0.5})};
  std::vector<std::vector<Vec3>> seen;
  std::vector<Vec3> radiosity(3);
  SolveOptions options;
  options.max_sweeps = 1;  // three steps
  const auto report =
      solve(Solver::kSouthwell, transport, problem, options, radiosity,
            [&](const SolveView& view) { seen.emplace_back(view.radiosity.begin(), view.radiosity.end()); }, {});
  ASSERT_TRUE(report.ok());
  ASSERT_GE(seen.size(), 4u);
  EXPECT_EQ(seen[1], (std::vector<Vec3>{{0, 0, 0}, {2, 2, 2}, {0, 0, 0}}));
  // r = 1.5, 0, 2.5, then 2.125, 0.625, 0
  EXPECT_EQ(seen[2], (std::vector<Vec3>{{0, 0, 0}, {2, 2, 2}, {2.5, 2.5, 2.5}}));
  EXPECT_EQ(seen[3], (std::vector<Vec3>{{2.125, 2.125, 2.125}, {2, 2, 2}, {2.5, 2.5, 2.5}}));
}

TEST(Southwell, GivesASymmetricSceneSymmetricLight) {
  for (const Enclosure& c : verified_enclosures()) {
    if (c.id != "cube_ceiling_rho0.5") continue;
    SolveOptions options;
    options.relative_tolerance = 1e-13;
    const Solved solved = solve_from_dark(Solver::kSouthwell, c.transport, c.problem, options);
    for (std::size_t i = 0; i < c.exact.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (c.exact[i] != c.exact[j]) continue;
        EXPECT_NEAR(solved.radiosity[i].x, solved.radiosity[j].x, kReordered);
      }
    }
  }
}

TEST(Shooting, ShootsTheLargestUnshotFluxFirst) {
  // Patch 1 is brighter, patch 0 sends more: A dB is 3 against 2.
  const DenseOperator transport = dense({{0, 1.0 / 3}, {1, 0}}, {3, 1});
  RadiosityProblem problem{{{1, 1, 1}, {2, 2, 2}}, std::vector<Vec3>(2, {0.5, 0.5, 0.5})};
  SolveOptions options;
  options.relative_tolerance = 1e-12;
  std::vector<std::vector<Vec3>> seen, unshot;
  std::vector<Vec3> radiosity(2);
  const auto report = solve(Solver::kShooting, transport, problem, options, radiosity,
                            [&](const SolveView& view) {
                              seen.emplace_back(view.radiosity.begin(), view.radiosity.end());
                              unshot.emplace_back(view.unshot.begin(), view.unshot.end());
                            },
                            {});
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->status, SolveStatus::kConverged);
  ASSERT_GE(seen.size(), 2u);
  EXPECT_EQ(seen[1], (std::vector<Vec3>{{1, 1, 1}, {2.5, 2.5, 2.5}}));
  EXPECT_EQ(unshot[1], (std::vector<Vec3>{{0, 0, 0}, {2.5, 2.5, 2.5}}));
}

TEST(Shooting, KeepsEveryLumenInShotOrUnshotLight) {
  // In a closed scene each shot only moves light: sum A (B - dB) (1 - rho) + sum A dB = sum A E at any time.
  auto [transport, problem] = random_enclosure(25, 0.8, 12);
  problem.reflectance.assign(25, {0.8, 0.5, 0.1});
  double emitted = 0;
  for (std::size_t i = 0; i < 25; ++i) emitted += transport.areas()[i] * problem.source[i].x;
  std::vector<Vec3> radiosity(25);
  SolveOptions options;
  options.relative_tolerance = 1e-6;
  int num_checked = 0;
  const auto report =
      solve(Solver::kShooting, transport, problem, options, radiosity,
            [&](const SolveView& view) {
              if (view.unshot.empty()) return;
              double total = 0;
              for (std::size_t i = 0; i < 25; ++i) {
                total += transport.areas()[i] * (0.2 * (view.radiosity[i].x - view.unshot[i].x) + view.unshot[i].x);
              }
              EXPECT_NEAR(total, emitted, kReordered * emitted);
              ++num_checked;
            },
            {});
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report->status, SolveStatus::kConverged);
  EXPECT_GT(num_checked, 10);
}

TEST(AmbientDisplay, IsExactInAFurnaceBeforeAnythingIsShot) {
  // All patches are alike, so spreading light evenly is right: E + rho E / (1 - rho) = E / (1 - rho).
  const std::vector<double> areas{1, 2, 3};
  const std::vector<Vec3> reflectance(3, {0.5, 0.75, 0}), emission(3, {1, 1, 1});
  for (const Vec3& shown : ambient_display(areas, reflectance, emission, emission)) {
    EXPECT_NEAR(shown.x, 2, kReordered);
    EXPECT_NEAR(shown.y, 4, kReordered);
    EXPECT_NEAR(shown.z, 1, kReordered);
  }
}

TEST(AmbientDisplay, IsNearerToTheSolutionEarlyOnAndVanishesInTheEnd) {
  const auto [transport, problem] = random_enclosure(60, 0.8, 4);
  SolveOptions options;
  options.relative_tolerance = 1e-10;
  const Solved exact = solve_from_dark(Solver::kShooting, transport, problem, options);
  ASSERT_EQ(exact.report.status, SolveStatus::kConverged);
  // The report's unshot light is what is left: showing it changes nothing.
  EXPECT_LE(
      largest_difference(ambient_display(transport.areas(), problem.reflectance, exact.radiosity, exact.report.unshot),
                         exact.radiosity),
      1e-7);
  const auto mean_error = [&](std::span<const Vec3> radiosity) {
    double error = 0;
    for (std::size_t i = 0; i < radiosity.size(); ++i) {
      error += transport.areas()[i] * std::fabs(radiosity[i].x - exact.radiosity[i].x);
    }
    return error;
  };
  std::vector<Vec3> radiosity(60);
  int num_early = 0;
  const auto report = solve(Solver::kShooting, transport, problem, options, radiosity,
                            [&](const SolveView& view) {
                              if (view.unshot.empty() || view.step.steps > 30) return;
                              const auto shown =
                                  ambient_display(transport.areas(), problem.reflectance, view.radiosity, view.unshot);
                              EXPECT_LT(mean_error(shown), mean_error(view.radiosity)) << view.step.steps;
                              ++num_early;
                            },
                            {});
  ASSERT_TRUE(report.ok());
  EXPECT_GT(num_early, 5);
}

TEST(Krylov, NeedsFewDirectionsWhereSweepsNeedThousands) {
  const auto [transport, problem] = random_enclosure(200, 0.9999, 6);
  SolveOptions options;
  options.relative_tolerance = 1e-6;
  options.max_sweeps = 1'000'000;
  const Solved krylov = solve_from_dark(Solver::kKrylov, transport, problem, options);
  ASSERT_EQ(krylov.report.status, SolveStatus::kConverged);
  EXPECT_LE(krylov.report.steps, 60);
}

// Rows as they were sampled are not reciprocal: conjugate directions do not fit them, and sweeps end the work.
TEST(Krylov, StillSolvesAnOperatorThatIsNotReciprocal) {
  std::mt19937_64 random(9);
  std::uniform_real_distribution<double> share(0, 1);
  constexpr std::size_t kPatches = 30;
  std::vector<std::vector<double>> rows(kPatches, std::vector<double>(kPatches));
  for (auto& row : rows) {
    double sum = 0;
    for (double& f : row) sum += f = std::pow(share(random), 8);
    for (double& f : row) f /= sum;
  }
  const DenseOperator transport = dense(rows, std::vector<double>(kPatches, 1));
  RadiosityProblem problem;
  problem.source.assign(kPatches, {});
  problem.source[3] = {1, 1, 1};
  problem.reflectance.assign(kPatches, {0.99, 0.9, 0.5});
  SolveOptions options;
  options.relative_tolerance = 1e-9;
  options.max_sweeps = 100'000;
  const Solved krylov = solve_from_dark(Solver::kKrylov, transport, problem, options);
  const Solved exact = solve_from_dark(Solver::kLu, transport, problem, options);
  ASSERT_EQ(krylov.report.status, SolveStatus::kConverged);
  EXPECT_LE(largest_difference(krylov.radiosity, exact.radiosity),
            krylov.report.error_bound + exact.report.error_bound);
}

TEST(Solvers, GiveEqualBitsForAnyNumberOfThreads) {
  const auto [transport, problem] = random_enclosure(700, 0.99, 17);
  for (const Solver solver : kAllSolvers) {
    std::vector<Vec3> first;
    double first_bound = 0;
    for (const std::size_t threads : {1u, 2u, 8u}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      SolveOptions options;
      options.max_sweeps = 5;
      const Solved solved = solve_from_dark(solver, transport, problem, options);
      if (threads == 1) {
        first = solved.radiosity;
        first_bound = solved.report.error_bound;
      }
      EXPECT_EQ(solved.radiosity, first) << solver_name(solver) << ", " << threads << " threads";
      EXPECT_EQ(solved.report.error_bound, first_bound) << solver_name(solver);
    }
  }
}

TEST(LargestKey, AgreesWithAScanWhileKeysChange) {
  std::mt19937_64 random(3);
  for (const std::size_t n : {1u, 2u, 3u, 64u, 100u}) {
    LargestKey tournament(n);
    std::vector<double> keys(n, 0);
    for (int round = 0; round < 200; ++round) {
      std::vector<std::uint32_t> changed;
      std::vector<double> values;
      for (std::uint32_t i = 0; i < n; ++i) {
        if (random() % 3 != 0) continue;
        changed.push_back(i);
        values.push_back(static_cast<double>(random() % 10));  // few values: many ties
        keys[i] = values.back();
      }
      tournament.set(changed, values);
      // max_element gives the first of equals.
      EXPECT_EQ(tournament.largest(), std::max_element(keys.begin(), keys.end()) - keys.begin());
    }
  }
}

/// Every other patch is the back of the one before it, and lets through a share of its own.
RandomEnclosure translucent_enclosure(std::size_t n, std::uint64_t seed) {
  RandomEnclosure enclosure = random_enclosure(n, 0.5, seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0, 0.45);
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t other = i % 2 == 0 ? i + 1 : i - 1;
    enclosure.problem.other_side.push_back(other < n ? other : i);
    const bool is_opaque = other >= n || i / 2 % 3 == 0;
    enclosure.problem.transmittance.push_back(is_opaque ? Vec3{} : Vec3{share(random), share(random), share(random)});
  }
  return enclosure;
}

// r = source + rho F B + tau (F B)_opp - B, written out.
double largest_residual(const RandomEnclosure& enclosure, const std::vector<Vec3>& radiosity) {
  std::vector<Vec3> irradiance(radiosity.size());
  enclosure.transport.gather(radiosity, irradiance);
  double largest = 0;
  for (std::size_t i = 0; i < radiosity.size(); ++i) {
    const RadiosityProblem& p = enclosure.problem;
    const Vec3 r = p.source[i] + scaled_by(p.reflectance[i], irradiance[i]) +
                   scaled_by(p.transmittance[i], irradiance[p.other_side[i]]) - radiosity[i];
    largest = std::max(largest, std::max(std::fabs(r.x), std::max(std::fabs(r.y), std::fabs(r.z))));
  }
  return largest;
}

TEST(EverySolver, LetsLightThroughScattered) {
  const RandomEnclosure enclosure = translucent_enclosure(41, 5);
  SolveOptions options;
  options.relative_tolerance = 1e-9;
  options.max_sweeps = 100'000;
  const Solved exact = solve_from_dark(Solver::kLu, enclosure.transport, enclosure.problem, options);
  EXPECT_LE(largest_residual(enclosure, exact.radiosity), 1e-9);
  for (const Solver solver : kAllSolvers) {
    const Solved solved = solve_from_dark(solver, enclosure.transport, enclosure.problem, options);
    EXPECT_EQ(solved.report.status, SolveStatus::kConverged) << solver_name(solver);
    EXPECT_LE(largest_difference(solved.radiosity, exact.radiosity),
              solved.report.error_bound + exact.report.error_bound)
        << solver_name(solver);
  }
  // And it matters.
  RadiosityProblem opaque = enclosure.problem;
  opaque.transmittance.clear();
  opaque.other_side.clear();
  const Solved without = solve_from_dark(Solver::kLu, enclosure.transport, opaque, options);
  EXPECT_GT(largest_difference(without.radiosity, exact.radiosity), 0.1);
}

}  // namespace
}  // namespace radbake::radiosity
