#include <Eigen/LU>

#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {
namespace {

/// I - rho F of one channel.
Eigen::MatrixXd matrix_of(const TransportOperator& transport, const RadiosityProblem& problem, int channel) {
  const auto n = static_cast<Eigen::Index>(transport.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(n, n);
  std::vector<std::uint32_t> patches;
  std::vector<double> form_factors;
  for (std::uint32_t i = 0; i < transport.size(); ++i) {
    transport.row(i, patches, form_factors);
    for (std::size_t k = 0; k < patches.size(); ++k) {
      matrix(i, patches[k]) -= problem.reflectance[i][channel] * form_factors[k];
    }
  }
  return matrix;
}

bool have_equal_reflectance(const RadiosityProblem& problem, int a, int b) {
  for (const Vec3& rho : problem.reflectance) {
    if (rho[a] != rho[b]) return false;
  }
  return true;
}

}  // namespace

void solve_by_lu(SolveMonitor& monitor, std::vector<Vec3>& radiosity) {
  if (!monitor.goes_on(radiosity)) return;
  const TransportOperator& transport = monitor.transport();
  const RadiosityProblem& problem = monitor.problem();
  const auto n = static_cast<Eigen::Index>(radiosity.size());

  // P L U = I - rho F, once for channels of equal reflectance.
  std::vector<Eigen::PartialPivLU<Eigen::MatrixXd>> factors;
  int factors_of[3];
  for (int channel = 0; channel < 3; ++channel) {
    int equal = 0;
    while (equal < channel && !have_equal_reflectance(problem, equal, channel)) ++equal;
    if (equal < channel) {
      factors_of[channel] = factors_of[equal];
      continue;
    }
    factors_of[channel] = static_cast<int>(factors.size());
    factors.emplace_back(matrix_of(transport, problem, channel));
    monitor.add_steps(0, n);
  }
  // B' <- B' + (I - rho F)^-1 r: the first from the guess, then refinements while they gain by half.
  double best = std::numeric_limits<double>::infinity();
  Eigen::VectorXd right(n);
  do {
    if (monitor.relative_error_bound() > best / 2) return monitor.end_without_progress();
    if (monitor.steps() > 0) best = monitor.relative_error_bound();
    for (int channel = 0; channel < 3; ++channel) {
      for (Eigen::Index i = 0; i < n; ++i) right[i] = monitor.residuals()[static_cast<std::size_t>(i)][channel];
      const Eigen::VectorXd correction = factors[static_cast<std::size_t>(factors_of[channel])].solve(right);
      for (Eigen::Index i = 0; i < n; ++i) radiosity[static_cast<std::size_t>(i)][channel] += correction[i];
    }
    monitor.add_steps(1, 0);
  } while (monitor.goes_on(radiosity));
}

}  // namespace radbake::radiosity
