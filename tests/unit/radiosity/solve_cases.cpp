#include "tests/unit/radiosity/solve_cases.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "common/base/check.h"

namespace radbake::radiosity {

DenseOperator dense(const std::vector<std::vector<double>>& form_factors, std::vector<double> areas) {
  auto transport = DenseOperator::from_matrix(form_factors, std::move(areas));
  RADBAKE_CHECK(transport.ok());
  return std::move(transport).value();
}

std::vector<Enclosure> verified_enclosures() {
  std::ifstream file(RADBAKE_REFERENCE_CASES);
  std::vector<Enclosure> enclosures;
  for (const auto& c : nlohmann::json::parse(file)) {
    RadiosityProblem problem;
    for (const double emission : c.at("E")) problem.source.push_back(Vec3{1, 1, 1} * emission);
    for (const double rho : c.at("rho")) problem.reflectance.push_back(Vec3{1, 1, 1} * rho);
    enclosures.push_back({c.at("id"), dense(c.at("F"), c.at("areas")), problem, c.at("B")});
  }
  return enclosures;
}

RandomEnclosure random_enclosure(std::size_t n, double max_reflectance, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0, 1);
  // S_ij = s_i s_j x_ij, x symmetric; every fourth pair does not see each other.
  std::vector<double> size;
  for (std::size_t i = 0; i < n; ++i) size.push_back(std::pow(10, -1.5 * share(random)));
  std::vector<std::vector<double>> exchange(n, std::vector<double>(n, 0));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const double seen = share(random) < 0.25 && i != 0 && j != 0 ? 0 : share(random);
      exchange[i][j] = exchange[j][i] = size[i] * size[j] * seen;
    }
  }
  std::vector<double> areas;
  for (auto& row : exchange) {
    double area = 0;
    for (const double s : row) area += s;
    areas.push_back(area);
    for (double& s : row) s /= area;
  }
  RadiosityProblem problem;
  for (std::size_t i = 0; i < n; ++i) {
    const bool is_black = i % 7 == 3;
    const double base = is_black ? 0 : max_reflectance;
    problem.reflectance.push_back({base, base * (1 - 0.1 * share(random)), base * share(random)});
    problem.source.push_back(i % 5 == 0 ? Vec3{share(random), 10 * share(random), 1} : Vec3{});
  }
  return {dense(exchange, areas), problem};
}

EstimatedRows sampled_rows(std::uint32_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  EstimatedRows rows;
  rows.first.push_back(0);
  for (std::uint32_t i = 0; i < n; ++i) {
    std::uint32_t counted = 0;
    for (std::uint32_t j = 0; i + 1 < n && j + 1 < n; ++j) {
      if (j == i || (i * 7 + j * 7) % 3 != 0) continue;
      const auto count = static_cast<std::uint32_t>(random() % 20);
      if (count == 0) continue;
      rows.entries.push_back({j, static_cast<float>(count)});
      counted += count;
    }
    const auto escaped = counted > 0 ? static_cast<std::uint32_t>(random() % 10) : 0;
    rows.first.push_back(rows.entries.size());
    rows.counted.push_back(counted + escaped);
    rows.escaped.push_back(escaped);
    rows.absorbed.push_back(0);
    rows.areas.push_back(i + 1 < n ? 0.1 + static_cast<double>(random() % 100) : 0);
  }
  return rows;
}

RadiosityProblem two_mirrors(double rho) { return {{{1, 1, 1}, {0, 0, 0}}, {{rho, rho, rho}, {rho, rho, rho}}}; }

DenseOperator facing_pair(double form_factor) { return dense({{0, form_factor}, {form_factor, 0}}, {1, 1}); }

Solved solve_from_dark(Solver solver, const TransportOperator& transport, const RadiosityProblem& problem,
                       const SolveOptions& options) {
  Solved solved;
  solved.radiosity.resize(transport.size());
  auto report = solve(solver, transport, problem, options, solved.radiosity, nullptr, {});
  RADBAKE_CHECK(report.ok());
  solved.report = std::move(report).value();
  return solved;
}

double largest_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  RADBAKE_CHECK_EQ(a.size(), b.size());
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (int c = 0; c < 3; ++c) largest = std::max(largest, std::fabs(a[i][c] - b[i][c]));
  }
  return largest;
}

}  // namespace radbake::radiosity
