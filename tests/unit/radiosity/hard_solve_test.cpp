// Hard cases of the solve: many terms, ties, light that is only for display. By the numbers of
// tests/docs/hard_cases.md.
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "server/radiosity/transport/sparse_operator.h"
#include "tests/record_figure.h"
#include "tests/unit/radiosity/solve_cases.h"

namespace radbake::radiosity {
namespace {

/// One patch that sees a million small ones, which see only it: F_0j = 1/n, F_j0 = 1. Closed and reciprocal.
///
/// Patch 0 adds a million equal terms. Its solution is closed, too, for any emission and reflectance:
///
///   B_0 = (E_0 + rho_0 mean E_j) / (1 - rho_0 mean rho_j),   B_j = E_j + rho_j B_0
class StarOfPatches final : public TransportOperator {
 public:
  StarOfPatches(std::uint32_t n, double small_area) : n_(n), areas_(n + 1, small_area) { areas_[0] = n * small_area; }

  void row(std::uint32_t i, std::vector<std::uint32_t>& patches, std::vector<double>& form_factors) const override {
    patches.clear();
    form_factors.clear();
    if (i > 0) return patches.push_back(0), form_factors.push_back(1);
    for (std::uint32_t j = 1; j <= n_; ++j) patches.push_back(j), form_factors.push_back(1.0 / n_);
  }
  void column(std::uint32_t j, std::vector<std::uint32_t>& patches, std::vector<double>& form_factors) const override {
    row(j, patches, form_factors);
    for (double& f : form_factors) f = j == 0 ? 1 : 1.0 / n_;
  }
  Vec3 gather_at(std::uint32_t i, std::span<const Vec3> radiosity) const override { return gathered(i, radiosity); }
  double gather_at(std::uint32_t i, std::span<const double> radiosity) const override { return gathered(i, radiosity); }
  double row_sum(std::uint32_t i) const override {
    if (i > 0) return 1;
    double sum = 0;
    for (std::uint32_t j = 1; j <= n_; ++j) sum += 1.0 / n_;
    return sum;
  }
  std::size_t row_length(std::uint32_t i) const override { return i > 0 ? 1 : n_; }
  std::span<const double> areas() const override { return areas_; }

 private:
  template <Channels C>
  C gathered(std::uint32_t i, std::span<const C> radiosity) const {
    if (i > 0) return radiosity[0];
    C sum{};
    for (std::uint32_t j = 1; j <= n_; ++j) sum += radiosity[j] * (1.0 / n_);
    return sum;
  }

  std::uint32_t n_;
  std::vector<double> areas_;
};

/// The same as a bake would estimate it: patch 0 sends a ray to each, the others all of their 64 rays to patch 0.
EstimatedRows star_as_rows(std::uint32_t n, double small_area) {
  EstimatedRows rows;
  rows.first = {0, n};
  for (std::uint32_t j = 1; j <= n; ++j) rows.entries.push_back({j, 1});
  rows.counted.assign(n + 1, 64);
  rows.counted[0] = n;
  rows.escaped.assign(n + 1, 0);
  rows.absorbed.assign(n + 1, 0);
  rows.areas.assign(n + 1, small_area);
  rows.areas[0] = n * small_area;
  for (std::uint32_t j = 1; j <= n; ++j) {
    rows.entries.push_back({0, 64});
    rows.first.push_back(rows.entries.size());
  }
  return rows;
}

constexpr std::uint32_t kMillion = 1'000'000;
constexpr double kSmallArea = 0.1;  // not a float

TEST(HardCase24MillionTerms, SumToOneInARowOfTheOperator) {
  constexpr double kAsked = 1e-12;
  const SparseOperator sparse(star_as_rows(kMillion, kSmallArea));
  EXPECT_NEAR(sparse.row_sum(0), 1, kAsked);
  EXPECT_NEAR(sparse.row_sum(kMillion), 1, kAsked);
  EXPECT_LE(sparse.repair().repaired_row_error_max, kAsked);
  tests::record_figure("row_sum_error", std::fabs(sparse.row_sum(0) - 1));
  const std::vector<Vec3> ones(kMillion + 1, {1, 1, 1});
  EXPECT_NEAR(sparse.gather_at(0, ones).x, 1, kAsked);
  // Single precision would not do: the same terms, added one after the other.
  float serial = 0;
  for (std::uint32_t j = 0; j < kMillion; ++j) serial += 1e-6f;
  EXPECT_GT(serial, 1.005f);
}

class MillionPatches : public testing::TestWithParam<Solver> {};

// Southwell and shooting are left out: they take a step a patch, a million a sweep.
INSTANTIATE_TEST_SUITE_P(HardCase24, MillionPatches,
                         testing::Values(Solver::kJacobi, Solver::kGaussSeidel, Solver::kKrylov), [](const auto& info) {
                           std::string name = solver_name(info.param);
                           std::erase(name, '-');
                           return name;
                         });

TEST_P(MillionPatches, FillAFurnaceToNineDigits) {
  constexpr double kAsked = 1e-9;
  const SparseOperator transport(star_as_rows(kMillion, kSmallArea));
  const RadiosityProblem problem{std::vector<Vec3>(kMillion + 1, {1, 2, 3}),
                                 std::vector<Vec3>(kMillion + 1, {0.5, 0.25, 0.125})};
  SolveOptions options;
  options.relative_tolerance = kAsked;
  const Solved solved = solve_from_dark(GetParam(), transport, problem, options);
  ASSERT_EQ(solved.report.status, SolveStatus::kConverged);
  double worst = 0;
  for (const Vec3& b : solved.radiosity) {
    worst = std::max({worst, std::fabs(b.x / 2 - 1), std::fabs(b.y / (8.0 / 3) - 1), std::fabs(b.z / (24.0 / 7) - 1)});
  }
  EXPECT_LE(worst, kAsked);
  tests::record_figure("relative_error", worst);
}

TEST_P(MillionPatches, MatchTheClosedFormOfAStarWithUnequalLight) {
  constexpr double kAsked = 1e-9;
  const StarOfPatches transport(kMillion, kSmallArea);
  std::mt19937_64 random(24);
  std::uniform_real_distribution<double> share(0, 1);
  RadiosityProblem problem;
  double emission = 0, reflectance = 0;
  for (std::uint32_t j = 0; j <= kMillion; ++j) {
    const double e = share(random), rho = 0.5 * share(random);
    problem.source.push_back({e, e, e});
    problem.reflectance.push_back({rho, rho, rho});
    if (j > 0) emission += e / kMillion, reflectance += rho / kMillion;
  }
  const double rho0 = problem.reflectance[0].x;
  const double centre = (problem.source[0].x + rho0 * emission) / (1 - rho0 * reflectance);
  SolveOptions options;
  options.relative_tolerance = 2 * kAsked;  // the bound takes a million roundings at their worst, 5e-10
  const Solved solved = solve_from_dark(GetParam(), transport, problem, options);
  ASSERT_EQ(solved.report.status, SolveStatus::kConverged);
  double worst = std::fabs(solved.radiosity[0].x - centre);
  for (std::uint32_t j = 1; j <= kMillion; ++j) {
    worst = std::max(worst, std::fabs(solved.radiosity[j].x - problem.source[j].x - problem.reflectance[j].x * centre));
  }
  EXPECT_LE(worst, kAsked * centre);
  EXPECT_LE(worst, solved.report.error_bound);
  tests::record_figure("error", worst);
}

/// The patch that each of the first steps relaxed.
std::vector<std::size_t> relaxed_patches(Solver solver, const TransportOperator& transport,
                                         const RadiosityProblem& problem) {
  SolveOptions options;
  options.relative_tolerance = 1e-13;
  std::vector<std::size_t> sequence;
  std::vector<Vec3> before(transport.size()), radiosity(transport.size());
  const auto report = solve(solver, transport, problem, options, radiosity,
                            [&](const SolveView& view) {
                              for (std::size_t i = 0; i < before.size(); ++i) {
                                if (!(view.radiosity[i] == before[i])) sequence.push_back(i);
                              }
                              before.assign(view.radiosity.begin(), view.radiosity.end());
                            },
                            {});
  EXPECT_TRUE(report.ok());
  return sequence;
}

TEST(HardCase26SouthwellTies, AreBrokenTheSameWayOnEveryRunAndAnyThreads) {
  // A furnace of 64 equal patches: every step chooses among equals.
  constexpr std::size_t kPatches = 64;
  const DenseOperator transport =
      dense(std::vector(kPatches, std::vector<double>(kPatches, 1.0 / kPatches)), std::vector<double>(kPatches, 1));
  const RadiosityProblem problem{std::vector<Vec3>(kPatches, {1, 1, 1}), std::vector<Vec3>(kPatches, {0.5, 0.5, 0.5})};
  const auto first = relaxed_patches(Solver::kSouthwell, transport, problem);
  ASSERT_GT(first.size(), kPatches);
  // The smallest of equals comes first. Steps are seen one by one up to the 50th.
  for (std::size_t k = 0; k < 50; ++k) EXPECT_EQ(first[k], k);
  for (const std::size_t threads : {1u, 2u, 8u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_EQ(relaxed_patches(Solver::kSouthwell, transport, problem), first) << threads << " threads";
  }
}

TEST(HardCase26SouthwellTies, LeaveASymmetricSceneSymmetric) {
  constexpr double kAsked = 1e-12;
  for (const Enclosure& c : verified_enclosures()) {
    if (c.id != "cube_ceiling_rho0.5" && c.id != "furnace_cube_rho0.9") continue;
    SolveOptions options;
    options.relative_tolerance = 1e-13;
    options.max_sweeps = 1'000'000;
    const Solved solved = solve_from_dark(Solver::kSouthwell, c.transport, c.problem, options);
    double worst = 0;
    for (std::size_t i = 0; i < c.exact.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (c.exact[i] == c.exact[j]) {
          worst = std::max(worst, std::fabs(solved.radiosity[i].x / solved.radiosity[j].x - 1));
        }
      }
    }
    EXPECT_LE(worst, kAsked) << c.id;
    tests::record_figure(c.id, worst);
  }
}

TEST(HardCase27AmbientDisplay, NeverReachesTheSolution) {
  const auto [transport, problem] = random_enclosure(60, 0.8, 27);
  SolveOptions tight;
  tight.relative_tolerance = 1e-12;
  const Solved exact = solve_from_dark(Solver::kLu, transport, problem, tight);
  ASSERT_EQ(exact.report.status, SolveStatus::kConverged);
  // Stopped early, where the ambient term is large; once shown at every step, once never.
  SolveOptions early;
  early.relative_tolerance = 1e-12;
  early.max_sweeps = 1;
  std::vector<Vec3> shown_to(60), plain(60);
  double largest_shown = 0;
  const auto with = solve(Solver::kShooting, transport, problem, early, shown_to,
                          [&](const SolveView& view) {
                            if (view.unshot.empty()) return;
                            const auto shown =
                                ambient_display(transport.areas(), problem.reflectance, view.radiosity, view.unshot);
                            for (std::size_t i = 0; i < shown.size(); ++i) {
                              largest_shown = std::max(largest_shown, shown[i].x - view.radiosity[i].x);
                            }
                          },
                          {});
  const auto without = solve(Solver::kShooting, transport, problem, early, plain, nullptr, {});
  ASSERT_TRUE(with.ok() && without.ok());
  EXPECT_GT(largest_shown, 0);
  EXPECT_EQ(shown_to, plain);
  // What is solved is light that was shot: never above the solution, and below it by what is unshot.
  ASSERT_EQ(without->status, SolveStatus::kIterationLimit);
  double missing = 0;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_LE(plain[i][c], exact.radiosity[i][c] + exact.report.error_bound) << i;
      missing = std::max(missing, exact.radiosity[i][c] - plain[i][c]);
    }
  }
  EXPECT_GT(missing, 100 * exact.report.error_bound);
}

}  // namespace
}  // namespace radbake::radiosity
