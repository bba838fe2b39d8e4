#include <gtest/gtest.h>

#include <Eigen/LU>
#include <atomic>
#include <cmath>
#include <random>

#include "server/radiosity/solve/solve.h"
#include "server/radiosity/transport/streamed_operator.h"

namespace radbake::radiosity {
namespace {

/// Rows of n patches as rays would give them: counts that are not reciprocal, some of the rays escaped.
struct NoisyRows {
  std::vector<std::vector<EstimatedRows::Entry>> entries;
  RowSums sums;
  std::vector<std::vector<double>> by_rows, by_columns;  ///< both systems, written out

  NoisyRows(std::uint32_t n, unsigned seed) : by_columns(n, std::vector<double>(n, 0)) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> area(0.5, 2);
    for (std::uint32_t i = 0; i < n; ++i) sums.areas.push_back(area(random));
    for (std::uint32_t i = 0; i < n; ++i) {
      std::discrete_distribution<std::uint32_t> target(sums.areas.begin(), sums.areas.end());
      std::vector<int> counts(n, 0);
      constexpr int kRays = 200;
      const int escaped = static_cast<int>(random() % 20);
      for (int k = escaped; k < kRays; ++k) ++counts[target(random)];
      std::vector<double> row;
      entries.emplace_back();
      for (std::uint32_t j = 0; j < n; ++j) {
        row.push_back(counts[j] / static_cast<double>(kRays));
        if (counts[j] > 0) entries[i].push_back({j, static_cast<float>(counts[j])});
      }
      sums.measured.push_back(1 - escaped / static_cast<double>(kRays));
      sums.lengths.push_back(static_cast<std::uint32_t>(entries[i].size()));
      by_rows.push_back(row);
    }
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; j < n; ++j) by_columns[i][j] = by_rows[j][i] * sums.areas[j] / sums.areas[i];
    }
  }

  StreamedOperator streamed(StreamedSystem system) const {
    return {sums, [this](std::uint32_t i, std::vector<EstimatedRows::Entry>& row) { row = entries[i]; }, system};
  }
  const std::vector<std::vector<double>>& matrix(StreamedSystem system) const {
    return system == StreamedSystem::kByRows ? by_rows : by_columns;
  }
};

/// Sums of few terms in another order.
constexpr double kReordered = 1e-13;

TEST(StreamedOperator, GathersWithTheMatrixOfItsSystem) {
  const NoisyRows rows(300, 5);
  std::vector<Vec3> radiosity, gathered(300);
  for (int j = 0; j < 300; ++j) radiosity.push_back({j + 1.0, 1.0, 0.5 * j});
  for (const StreamedSystem system : {StreamedSystem::kByRows, StreamedSystem::kByColumns}) {
    const StreamedOperator streamed = rows.streamed(system);
    streamed.gather(radiosity, gathered);
    for (std::size_t i = 0; i < 300; ++i) {
      Vec3 expected;
      for (std::size_t j = 0; j < 300; ++j) expected += radiosity[j] * rows.matrix(system)[i][j];
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(gathered[i][c], expected[c], kReordered * expected[c]);
    }
  }
}

TEST(StreamedOperator, ScalesRowsToTheirMeasuredSums) {
  NoisyRows rows(20, 6);
  // Rows by formula do not sum to the measured sum exactly.
  for (auto& row : rows.entries) {
    for (auto& entry : row) entry.weight *= 1.001f;
  }
  const StreamedOperator streamed = rows.streamed(StreamedSystem::kByRows);
  std::vector<std::uint32_t> patches;
  std::vector<double> form_factors;
  for (std::uint32_t i = 0; i < 20; ++i) {
    streamed.row(i, patches, form_factors);
    double sum = 0;
    for (const double f : form_factors) sum += f;
    EXPECT_NEAR(sum, rows.sums.measured[i], kReordered);
    EXPECT_EQ(streamed.row_sum(i), rows.sums.measured[i]);
  }
}

TEST(StreamedOperator, EstimatesARowAnewForEachUse) {
  const NoisyRows rows(10, 7);
  std::atomic<int> num_estimated = 0;
  const StreamedOperator streamed(
      rows.sums,
      [&](std::uint32_t i, std::vector<EstimatedRows::Entry>& row) {
        ++num_estimated;
        row = rows.entries[i];
      },
      StreamedSystem::kByRows);
  const std::vector<Vec3> radiosity(10, Vec3{1, 1, 1});
  std::vector<Vec3> gathered(10);
  streamed.gather(radiosity, gathered);
  streamed.gather(radiosity, gathered);
  EXPECT_EQ(num_estimated, 20);
}

// Rows of the one system and columns of the other are not each other's: each solver must find the solution of its own.
TEST(StreamedOperator, IsSolvedByEverySolverWithinItsBound) {
  constexpr std::uint32_t kPatches = 60;
  for (const double rho : {0.5, 0.9, 0.99}) {
    const NoisyRows rows(kPatches, 8);
    RadiosityProblem problem;
    problem.source.assign(kPatches, Vec3{});
    problem.source[3] = {1, 2, 0};
    problem.reflectance.assign(kPatches, {rho, rho / 2, 0});
    for (const Solver solver : kAllSolvers) {
      const auto system = reads_columns(solver) ? StreamedSystem::kByColumns : StreamedSystem::kByRows;
      const StreamedOperator streamed = rows.streamed(system);
      SolveOptions options;
      options.relative_tolerance = 1e-9;
      options.max_sweeps = 20000;
      std::vector<Vec3> radiosity(kPatches), exact(kPatches);
      const auto report = solve(solver, streamed, problem, options, radiosity, {}, {});
      ASSERT_TRUE(report.ok());
      EXPECT_EQ(report->status, SolveStatus::kConverged) << solver_name(solver) << " at " << rho;

      // By elimination, not by the library's: rows of the system by columns sum to more than 1, where it has no bound.
      for (int c = 0; c < 3; ++c) {
        Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(kPatches, kPatches);
        Eigen::VectorXd source(kPatches);
        for (std::uint32_t i = 0; i < kPatches; ++i) {
          source(i) = problem.source[i][c];
          for (std::uint32_t j = 0; j < kPatches; ++j) {
            matrix(i, j) -= problem.reflectance[i][c] * rows.matrix(system)[i][j];
          }
        }
        const Eigen::VectorXd solution = matrix.partialPivLu().solve(source);
        for (std::uint32_t i = 0; i < kPatches; ++i) exact[i][c] = solution(i);
      }
      double mean_error = 0, area = 0, max_error = 0;
      for (std::size_t i = 0; i < kPatches; ++i) {
        const double error = std::max({std::fabs(radiosity[i].x - exact[i].x), std::fabs(radiosity[i].y - exact[i].y),
                                       std::fabs(radiosity[i].z - exact[i].z)});
        mean_error += rows.sums.areas[i] * error;
        area += rows.sums.areas[i];
        max_error = std::max(max_error, error);
      }
      // By columns the bound is on the mean.
      const double error = reads_columns(solver) ? mean_error / area : max_error;
      EXPECT_LE(error, report->error_bound) << solver_name(solver) << " at " << rho;
    }
  }
}

TEST(StreamedOperator, IsSolvedByFewGathersWhereSweepsAreMany) {
  const NoisyRows rows(60, 9);
  const StreamedOperator streamed = rows.streamed(StreamedSystem::kByRows);
  RadiosityProblem problem;
  problem.source.assign(60, Vec3{});
  problem.source[0] = {1, 1, 1};
  problem.reflectance.assign(60, {0.999, 0.999, 0.999});
  std::vector<Vec3> radiosity(60);
  const auto krylov = solve(Solver::kKrylov, streamed, problem, {}, radiosity, {}, {}).value();
  EXPECT_EQ(krylov.status, SolveStatus::kConverged);
  std::fill(radiosity.begin(), radiosity.end(), Vec3{});
  const auto sweeps = solve(Solver::kGaussSeidel, streamed, problem, {}, radiosity, {}, {}).value();
  EXPECT_EQ(sweeps.status, SolveStatus::kConverged);
  EXPECT_LT(5 * krylov.work, sweeps.work);
}

}  // namespace
}  // namespace radbake::radiosity
