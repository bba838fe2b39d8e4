#include <Eigen/LU>

#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {
namespace {

/// I - rho F of one channel.
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
    }
  }
  return matrix;
}

template <Channels C>
bool have_equal_reflectance(const ProblemOf<C>& problem, int a, int b) {
  for (const C& rho : problem.reflectance) {
    if (channel(rho, a) != channel(rho, b)) return false;
  }
  return true;
}

}  // namespace

template <Channels C>
void solve_by_lu(SolveMonitor<C>& monitor, std::vector<C>& radiosity) {
  if (!monitor.goes_on(radiosity)) return;
  const TransportOperator& transport = monitor.transport();
  const ProblemOf<C>& problem = monitor.problem();
  const auto n = static_cast<Eigen::Index>(radiosity.size());

  // P L U = I - rho F, once for channels of equal reflectance.
  std::vector<Eigen::PartialPivLU<Eigen::MatrixXd>> factors;
  int factors_of[kNumChannels<C>];
  for (int c = 0; c < kNumChannels<C>; ++c) {
    int equal = 0;
    while (equal < c && !have_equal_reflectance(problem, equal, c)) ++equal;
    if (equal < c) {
      factors_of[c] = factors_of[equal];
      continue;
    }
    factors_of[c] = static_cast<int>(factors.size());
    factors.emplace_back(matrix_of(transport, problem, c));
    monitor.add_steps(0, n);
  }
  // B' <- B' + (I - rho F)^-1 r: the first from the guess, then refinements while they gain by half.
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
