#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/radiosity/solve/solve.h"
#include "server/radiosity/transport/dense_operator.h"
#include "server/radiosity/transport/estimated_rows.h"

namespace radbake::radiosity {

/// A matrix written out. Fails the program where it is not one.
DenseOperator dense(const std::vector<std::vector<double>>& form_factors, std::vector<double> areas);

/// A verified enclosure of tests/reference (LU in 30 digits; Neumann series and energy balance agree to 1e-12).
struct Enclosure {
  std::string id;
  DenseOperator transport;
  RadiosityProblem problem;  ///< three equal channels
  std::vector<double> exact;
};
std::vector<Enclosure> verified_enclosures();

/// A closed reciprocal enclosure at random: positive exchange areas S, A_i = sum_j S_ij, F_ij = S_ij / A_i.
/// Patches see themselves, too; areas differ by 1e3. Reflectances differ by channel, up to max_reflectance, a few 0.
struct RandomEnclosure {
  DenseOperator transport;
  RadiosityProblem problem;
};
RandomEnclosure random_enclosure(std::size_t n, double max_reflectance, std::uint64_t seed);

/// Rows of n patches that see a third of each other, with rays that escape; the last patch is buried: no rays, no area.
EstimatedRows sampled_rows(std::uint32_t n, std::uint64_t seed);

/// Two facing unit patches of one reflectance; the first emits 1.
RadiosityProblem two_mirrors(double rho);
DenseOperator facing_pair(double form_factor = 1);

/// solve() from a guess of 0, as the classic figures do; the radiosity is in the second.
struct Solved {
  SolveReport report;
  std::vector<Vec3> radiosity;
};
Solved solve_from_dark(Solver solver, const TransportOperator& transport, const RadiosityProblem& problem,
                       const SolveOptions& options = {});

/// max |a - b| over patches and channels.
double largest_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b);

}  // namespace radbake::radiosity
