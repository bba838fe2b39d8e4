#include <Eigen/LU>
#include <algorithm>

#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {
namespace {

/// I - M F of one channel.
template <Channels C>
Eigen::MatrixXd matrix_of(const TransportOperator& transport, const ProblemOf<C>& problem, int c) {
  const auto n = static_cast<Eigen::Index>(transport.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(n, n);
  std::vector<std::uint32_t> patches;
  std::vector<double> form_factors;
  for (std::uint32_t i = 0; i < transport.size(); ++i) {
    transport.row(i, patches, form_factors);
    for (std::size_t k = 0; k < patches.size(); ++k) {
      matrix(i, patches[k]) -= channel(problem.reflectance[i], c) * form_factors[k];
      if (problem.transmits()) {
        // What arrives at i leaves on the other side, too.
        const std::uint32_t other = problem.other_side[i];
        matrix(other, patches[k]) -= channel(problem.transmittance[other], c) * form_factors[k];
      }
    }
  }
  return matrix;
}

template <Channels C>
bool pass_on_equally(const ProblemOf<C>& problem, int a, int b) {
  const auto are_equal = [&](const C& share) { return channel(share, a) == channel(share, b); };
  return std::all_of(problem.reflectance.begin(), problem.reflectance.end(), are_equal) &&
         std::all_of(problem.transmittance.begin(), problem.transmittance.end(), are_equal);
}

}  // namespace

template <Channels C>
void solve_by_lu(SolveMonitor<C>& monitor, std::vector<C>& radiosity) {
  if (!monitor.goes_on(radiosity)) return;
  const TransportOperator& transport = monitor.transport();
  const ProblemOf<C>& problem = monitor.problem();
  const auto n = static_cast<Eigen::Index>(radiosity.size());

  // P L U = I - M F, once for channels of equal shares.
  std::vector<Eigen::PartialPivLU<Eigen::MatrixXd>> factors;
  int factors_of[kNumChannels<C>];
  for (int c = 0; c < kNumChannels<C>; ++c) {
    int equal = 0;
    while (equal < c && !pass_on_equally(problem, equal, c)) ++equal;
    if (equal < c) {
      factors_of[c] = factors_of[equal];
      continue;
    }
    factors_of[c] = static_cast<int>(factors.size());
    factors.emplace_back(matrix_of(transport, problem, c));
    monitor.add_steps(0, n);
  }
  // B' <- B' + (I - M F)^-1 r: the first from the guess, then refinements while they gain by half.
  double best = std::numeric_limits<double>::infinity();
  Eigen::VectorXd right(n);
  do {
    if (monitor.relative_error_bound() > best / 2) return monitor.end_without_progress();
    if (monitor.steps() > 0) best = monitor.relative_error_bound();
    for (int c = 0; c < kNumChannels<C>; ++c) {
      for (Eigen::Index i = 0; i < n; ++i) right[i] = channel(monitor.residuals()[static_cast<std::size_t>(i)], c);
      const Eigen::VectorXd correction = factors[static_cast<std::size_t>(factors_of[c])].solve(right);
      for (Eigen::Index i = 0; i < n; ++i) channel(radiosity[static_cast<std::size_t>(i)], c) += correction[i];
    }
    monitor.add_steps(1, 0);
  } while (monitor.goes_on(radiosity));
}
template void solve_by_lu(SolveMonitor<double>&, std::vector<double>&);
template void solve_by_lu(SolveMonitor<Vec3>&, std::vector<Vec3>&);

}  // namespace radbake::radiosity
