#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server/radiosity/transport/dense_operator.h"
#include "server/radiosity/transport/sparse_operator.h"
#include "tests/unit/radiosity/solve_cases.h"

namespace radbake::radiosity {
namespace {

std::vector<Vec3> some_light(std::size_t n) {
  std::vector<Vec3> light;
  for (std::size_t i = 0; i < n; ++i) light.push_back({std::sqrt(i + 1.0), 1 / (i + 3.0), i % 4 == 0 ? 0 : 1e6 / 7});
  return light;
}

TEST(DenseOperator, IsTheSparseMatrixBitForBit) {
  for (const std::uint32_t n : {2u, 17u, 90u}) {
    const SparseOperator sparse(sampled_rows(n, n));
    const DenseOperator dense(sparse);
    ASSERT_EQ(dense.size(), n);
    const std::vector<Vec3> light = some_light(n);
    std::vector<std::uint32_t> patches, sparse_patches;
    std::vector<double> factors, sparse_factors;
    for (std::uint32_t i = 0; i < n; ++i) {
      EXPECT_EQ(dense.gather_at(i, light), sparse.gather_at(i, light));
      EXPECT_EQ(dense.row_sum(i), sparse.row_sum(i));
      EXPECT_EQ(dense.row_length(i), sparse.row_length(i));
      EXPECT_EQ(dense.areas()[i], sparse.areas()[i]);
      dense.row(i, patches, factors);
      sparse.row(i, sparse_patches, sparse_factors);
      EXPECT_EQ(patches, sparse_patches);
      EXPECT_EQ(factors, sparse_factors);
      dense.column(i, patches, factors);
      sparse.column(i, sparse_patches, sparse_factors);
      EXPECT_EQ(patches, sparse_patches);
      EXPECT_EQ(factors, sparse_factors);
    }
  }
}

TEST(DenseOperator, LeadsEverySolverToTheBitsOfTheSparseOne) {
  const SparseOperator sparse(sampled_rows(60, 5));
  const DenseOperator dense(sparse);
  const RadiosityProblem problem{some_light(60), std::vector<Vec3>(60, {0.9, 0.5, 0})};
  for (const Solver solver : kAllSolvers) {
    const Solved a = solve_from_dark(solver, sparse, problem), b = solve_from_dark(solver, dense, problem);
    EXPECT_EQ(a.report.status, SolveStatus::kConverged) << solver_name(solver);
    EXPECT_EQ(a.radiosity, b.radiosity) << solver_name(solver);
    EXPECT_EQ(a.report.steps, b.report.steps) << solver_name(solver);
    EXPECT_EQ(a.report.error_bound, b.report.error_bound) << solver_name(solver);
  }
}

void expect_columns_are_the_rows(const TransportOperator& transport) {
  const auto n = static_cast<std::uint32_t>(transport.size());
  std::vector<std::vector<double>> by_rows(n, std::vector<double>(n, 0)), by_columns = by_rows;
  std::vector<std::uint32_t> patches;
  std::vector<double> factors;
  for (std::uint32_t i = 0; i < n; ++i) {
    transport.row(i, patches, factors);
    EXPECT_TRUE(std::is_sorted(patches.begin(), patches.end()));
    for (std::size_t k = 0; k < patches.size(); ++k) by_rows[i][patches[k]] = factors[k];
    transport.column(i, patches, factors);
    EXPECT_TRUE(std::is_sorted(patches.begin(), patches.end()));
    for (std::size_t k = 0; k < patches.size(); ++k) by_columns[patches[k]][i] = factors[k];
  }
  EXPECT_EQ(by_rows, by_columns);
}

TEST(TransportOperator, HasTheSameEntriesInRowsAndColumns) {
  const SparseOperator sparse(sampled_rows(40, 1));
  expect_columns_are_the_rows(sparse);
  expect_columns_are_the_rows(DenseOperator(sparse));
  // A given matrix that is not reciprocal has its own columns.
  expect_columns_are_the_rows(dense({{0, 0.5, 0}, {0.25, 0.25, 0.5}, {1, 0, 0}}, {1, 2, 3}));
}

TEST(TransportOperator, GathersAllRowsAsItGathersOne) {
  const SparseOperator sparse(sampled_rows(700, 2));
  const std::vector<Vec3> light = some_light(700);
  std::vector<Vec3> irradiance(700);
  sparse.gather(light, irradiance);
  for (std::uint32_t i = 0; i < 700; ++i) EXPECT_EQ(irradiance[i], sparse.gather_at(i, light));
}

TEST(DenseOperator, TakesAMatrixAsItIs) {
  const DenseOperator transport = dense({{0, 0.75}, {0.375, 0.1}}, {1, 2});
  const std::vector<Vec3> light{{1, 2, 3}, {10, 20, 30}};
  EXPECT_EQ(transport.gather_at(0, light), (Vec3{7.5, 15, 22.5}));
  EXPECT_EQ(transport.row_sum(1), 0.375 + 0.1);
  EXPECT_EQ(transport.row_length(0), 1u);
}

TEST(DenseOperator, RefusesWhatIsNoMatrixOfFormFactors) {
  const auto message = [](const std::vector<std::vector<double>>& form_factors, std::vector<double> areas) {
    const auto made = DenseOperator::from_matrix(form_factors, std::move(areas));
    return made.ok() ? std::string() : made.error().message;
  };
  EXPECT_NE(message({{0, 1}}, {1, 1}).find("1 rows for 2"), std::string::npos);
  EXPECT_NE(message({{0, 1}, {1}}, {1, 1}).find("row 1 has 1"), std::string::npos);
  EXPECT_NE(message({{0, -0.5}, {1, 0}}, {1, 1}).find("row 0, column 1"), std::string::npos);
  EXPECT_NE(message({{0, 1}, {std::nan(""), 0}}, {1, 1}).find("row 1, column 0"), std::string::npos);
  EXPECT_NE(message({{0, 1}, {1, 0}}, {1, 0}).find("area 1"), std::string::npos);
  EXPECT_NE(message({{0, 1}, {1, 0}}, {INFINITY, 1}).find("area 0"), std::string::npos);
  EXPECT_EQ(message({{0, 1}, {1, 0}}, {1, 1}), "");
}

}  // namespace
}  // namespace radbake::radiosity
