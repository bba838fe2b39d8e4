#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "server/radiosity/transport/sparse_operator.h"

namespace radbake::radiosity {
namespace {

/// Rows of n patches of random areas that see each other at random: exchange areas S_ij, counts sampled from S_ij /
/// A_i.
EstimatedRows random_rows(int n, double escape, unsigned seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> any(0.1, 1);
  std::vector<std::vector<double>> exchange(n, std::vector<double>(n, 0));
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) exchange[i][j] = exchange[j][i] = any(random);
  }
  EstimatedRows rows;
  rows.first.push_back(0);
  for (int i = 0; i < n; ++i) {
    double sum = 0;
    for (const double s : exchange[i]) sum += s;
    std::discrete_distribution<int> target(exchange[i].begin(), exchange[i].end());
    constexpr std::uint32_t kRays = 500;
    std::map<std::uint32_t, std::uint32_t> counts;
    std::uint32_t escaped = 0;
    for (std::uint32_t k = 0; k < kRays; ++k) {
      if (any(random) < 0.1 + 0.9 * escape) {
        ++escaped;
      } else {
        ++counts[static_cast<std::uint32_t>(target(random))];
      }
    }
    for (const auto& [patch, count] : counts) rows.entries.push_back({patch, static_cast<float>(count)});
    rows.first.push_back(rows.entries.size());
    rows.counted.push_back(kRays);
    rows.escaped.push_back(escaped);
    rows.absorbed.push_back(0);
    rows.areas.push_back(sum);
  }
  return rows;
}

double form_factor(const SparseOperator& transport, std::uint32_t i, std::uint32_t j) {
  std::vector<std::uint32_t> patches;
  std::vector<double> values;
  transport.row(i, patches, values);
  const auto found = std::lower_bound(patches.begin(), patches.end(), j);
  return found != patches.end() && *found == j ? values[found - patches.begin()] : 0;
}

constexpr double kRounding = 1e-12;

TEST(SparseOperator, IsReciprocalAndRestoresTheMeasuredRowSums) {
  for (const double escape : {0.0, 0.3}) {
    const EstimatedRows rows = random_rows(40, escape, 11);
    const SparseOperator transport(rows);
    EXPECT_GT(transport.repair().raw_reciprocity_rms, 0.1);  // raw estimates differ
    EXPECT_EQ(transport.repair().raw_closure_max, 0);
    for (std::uint32_t i = 0; i < 40; ++i) {
      EXPECT_NEAR(transport.row_sum(i), 1 - rows.escaped[i] / 500.0, kRounding);
      for (std::uint32_t j = 0; j < 40; ++j) {
        EXPECT_NEAR(rows.areas[i] * form_factor(transport, i, j), rows.areas[j] * form_factor(transport, j, i),
                    kRounding);
      }
    }
  }
}

TEST(SparseOperator, GathersWithItsRows) {
  const SparseOperator transport(random_rows(20, 0.2, 3));
  std::vector<Vec3> radiosity;
  for (int j = 0; j < 20; ++j) radiosity.push_back({j + 1.0, 1.0, 0.5 * j});
  for (std::uint32_t i = 0; i < 20; ++i) {
    Vec3 expected;
    for (std::uint32_t j = 0; j < 20; ++j) expected += radiosity[j] * form_factor(transport, i, j);
    EXPECT_LT(length(transport.gather_at(i, radiosity) - expected), kRounding);
    EXPECT_NEAR(transport.gather_at(i, radiosity).y, transport.row_sum(i), kRounding);
  }
}

TEST(SparseOperator, KeepsRowSumsAndGivesUpReciprocityWhereNoScalingFits) {
  // Two patches that see only each other, with row sums that cannot both hold: A_1 r_1 = 0.8, A_2 r_2 = 0.6.
  EstimatedRows rows;
  rows.first = {0, 1, 2};
  rows.entries = {{1, 80}, {0, 60}};
  rows.counted = {100, 100};
  rows.escaped = {20, 40};
  rows.absorbed = {0, 0};
  rows.areas = {1, 1};
  const SparseOperator transport(rows);
  EXPECT_NEAR(form_factor(transport, 0, 1), 0.8, kRounding);
  EXPECT_NEAR(form_factor(transport, 1, 0), 0.6, kRounding);
  EXPECT_FALSE(transport.is_reciprocal());
  EXPECT_GT(transport.repair().repaired_row_error_max, 0.1);
}

// Few rays from slivers tell of exchanges that cannot be: patches 0 and 2 see nothing but patch 1, which is five times
// smaller than either. No scaling fits, but a row that sums to more than 1 would make light out of nothing.
TEST(SparseOperator, LetsEveryRowPassOnWhatItGets) {
  EstimatedRows rows;
  rows.first = {0, 1, 3, 4};
  rows.entries = {{1, 100}, {0, 50}, {2, 50}, {1, 100}};
  rows.counted = {100, 100, 100};
  rows.escaped = rows.absorbed = {0, 0, 0};
  rows.areas = {1, 0.2, 1};
  const SparseOperator transport(rows);
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_NEAR(transport.row_sum(i), 1, kRounding);
  EXPECT_GT(transport.repair().repaired_row_error_max, 0.1);
  // Columns are of the same matrix.
  std::vector<std::uint32_t> patches;
  std::vector<double> form_factors;
  transport.column(1, patches, form_factors);
  ASSERT_EQ(patches, (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(form_factors[0], form_factor(transport, 0, 1));
  EXPECT_EQ(form_factors[1], form_factor(transport, 2, 1));
}

TEST(SparseOperator, LeavesPatchesWithoutRowsEmpty) {
  EstimatedRows rows;
  rows.first = {0, 1, 2, 2};
  rows.entries = {{1, 10}, {0, 10}};
  rows.counted = {10, 10, 0};
  rows.escaped = {0, 0, 0};
  rows.absorbed = {0, 0, 0};
  rows.areas = {2, 2, 0};
  const SparseOperator transport(rows);
  EXPECT_EQ(transport.row_sum(2), 0);
  EXPECT_NEAR(transport.row_sum(0), 1, kRounding);
  const std::vector<Vec3> ones(3, {1, 1, 1});
  EXPECT_EQ(transport.gather_at(2, ones), Vec3{});
}

}  // namespace
}  // namespace radbake::radiosity
