#include "server/radiosity/solve/solve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

namespace radbake::radiosity {
namespace {

/// A matrix written out.
class DenseRows final : public TransportOperator {
 public:
  DenseRows(std::vector<std::vector<double>> rows, std::vector<double> areas)
      : rows_(std::move(rows)), areas_(std::move(areas)) {}

  void row(std::uint32_t i, std::vector<std::uint32_t>& patches, std::vector<double>& form_factors) const override {
    patches.clear();
    for (std::uint32_t j = 0; j < rows_[i].size(); ++j) patches.push_back(j);
    form_factors = rows_[i];
  }
  Vec3 gather_at(std::uint32_t i, std::span<const Vec3> radiosity) const override {
    Vec3 sum;
    for (std::size_t j = 0; j < rows_[i].size(); ++j) sum += radiosity[j] * rows_[i][j];
    return sum;
  }
  double row_sum(std::uint32_t i) const override {
    double sum = 0;
    for (const double f : rows_[i]) sum += f;
    return sum;
  }
  std::size_t row_length(std::uint32_t i) const override { return rows_[i].size(); }
  std::span<const double> areas() const override { return areas_; }

 private:
  std::vector<std::vector<double>> rows_;
  std::vector<double> areas_;
};

// Verified enclosures (LU in 30 digits; Neumann series and energy balance agree to 1e-12), rho up to 0.9999.
TEST(GaussSeidel, SolvesEveryVerifiedEnclosureWithinItsBound) {
  std::ifstream file(RADBAKE_REFERENCE_CASES);
  const nlohmann::json cases = nlohmann::json::parse(file);
  ASSERT_EQ(cases.size(), 15u);
  for (const auto& c : cases) {
    const std::string id = c.at("id");
    const auto exact = c.at("B").get<std::vector<double>>();
    const auto rho = c.at("rho").get<std::vector<double>>();
    const auto emission = c.at("E").get<std::vector<double>>();
    const DenseRows transport(c.at("F"), c.at("areas"));
    RadiosityProblem problem;
    for (std::size_t i = 0; i < exact.size(); ++i) {
      problem.source.push_back(Vec3{1, 1, 1} * emission[i]);
      problem.reflectance.push_back(Vec3{1, 1, 1} * rho[i]);
    }
    for (const double tolerance : {1e-3, 1e-6, 1e-9}) {
      SolveOptions options;
      options.relative_tolerance = tolerance;
      options.max_sweeps = 1'000'000;
      std::vector<Vec3> radiosity = problem.source;
      const SolveReport report = solve_gauss_seidel(transport, problem, options, radiosity, nullptr, {});
      EXPECT_EQ(report.status, SolveStatus::kConverged) << id;
      double error = 0;
      for (std::size_t i = 0; i < exact.size(); ++i) error = std::max(error, std::fabs(radiosity[i].y - exact[i]));
      EXPECT_LE(error, report.error_bound) << id << " at " << tolerance;
      EXPECT_LE(report.relative_error_bound, tolerance) << id;
    }
  }
}

RadiosityProblem two_mirrors(double rho) { return {{{1, 1, 1}, {0, 0, 0}}, {{rho, rho, rho}, {rho, rho, rho}}}; }
const DenseRows& facing_pair() {
  static const DenseRows pair({{0, 1}, {1, 0}}, {1, 1});
  return pair;
}

TEST(GaussSeidel, SaysSoWhenTheSweepsDoNotSuffice) {
  SolveOptions options;
  options.max_sweeps = 3;
  const RadiosityProblem problem = two_mirrors(0.999);
  std::vector<Vec3> radiosity = problem.source;
  const SolveReport report = solve_gauss_seidel(facing_pair(), problem, options, radiosity, nullptr, {});
  EXPECT_EQ(report.status, SolveStatus::kIterationLimit);
  EXPECT_EQ(report.sweeps, 3);
  // The bound holds for what was reached, too: exact B = (1, rho) / (1 - rho^2).
  const double exact = 1 / (1 - 0.999 * 0.999);
  EXPECT_LE(std::fabs(radiosity[0].x - exact), report.error_bound);
}

TEST(GaussSeidel, RefusesRowsThatPassOnMoreThanTheyGet) {
  const DenseRows amplifying({{0, 1.2}, {1.2, 0}}, {1, 1});
  const RadiosityProblem problem = two_mirrors(0.9);
  std::vector<Vec3> radiosity = problem.source;
  EXPECT_EQ(solve_gauss_seidel(amplifying, problem, {}, radiosity, nullptr, {}).status, SolveStatus::kDiverged);
}

TEST(GaussSeidel, DoesNotCallNotANumberConverged) {
  RadiosityProblem problem = two_mirrors(0.5);
  problem.source[1].y = std::nan("");
  std::vector<Vec3> radiosity = problem.source;
  EXPECT_EQ(solve_gauss_seidel(facing_pair(), problem, {}, radiosity, nullptr, {}).status, SolveStatus::kDiverged);
}

TEST(GaussSeidel, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  const RadiosityProblem problem = two_mirrors(0.9);
  std::vector<Vec3> radiosity = problem.source;
  EXPECT_EQ(solve_gauss_seidel(facing_pair(), problem, {}, radiosity, nullptr, stop.get_token()).status,
            SolveStatus::kCancelled);
}

TEST(GaussSeidel, LeavesADarkSceneDark) {
  RadiosityProblem problem = two_mirrors(0.5);
  problem.source.assign(2, Vec3{});
  std::vector<Vec3> radiosity(2);
  const SolveReport report = solve_gauss_seidel(facing_pair(), problem, {}, radiosity, nullptr, {});
  EXPECT_EQ(report.status, SolveStatus::kConverged);
  EXPECT_EQ(radiosity[0], Vec3{});
}

}  // namespace
}  // namespace radbake::radiosity
