#include <cmath>

#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {
namespace {

/// Conjugate directions are started afresh after so many: rounding has spoilt them by then.
constexpr int kMaxDirections = 200;
/// And where the residual has grown so much: the operator is not reciprocal enough for them.
constexpr double kMaxGrowth = 1e3;

/// Conjugate gradients for the irradiance, from which B' = source + rho H:
///
///   (I - F rho) H = F source
///
/// The matrix is self-adjoint and positive definite in the inner product <u, v> = sum_i A_i rho_i u_i v_i, because
/// A_i F_ij = A_j F_ji. In terms of H no patch is divided by its reflectance: one with rho_i = 0 has no weight, and its
/// H_i is gathered along.
template <Channels C>
class ConjugateGradients {
 public:
  explicit ConjugateGradients(SolveMonitor<C>& monitor)
      : monitor_(monitor),
        transport_(monitor.transport()),
        problem_(monitor.problem()),
        reflected_(monitor.size()),
        gathered_(monitor.size()) {}

  /// Starts from H = irradiance, whose residual is gathered - irradiance, where gathered = F (source + rho H).
  void start(std::span<const C> irradiance, std::span<const C> gathered) {
    irradiance_.assign(irradiance.begin(), irradiance.end());
    residual_.resize(irradiance.size());
    for (std::size_t i = 0; i < irradiance.size(); ++i) residual_[i] = gathered[i] - irradiance[i];
    direction_ = residual_;
    square_ = inner(residual_, residual_);
  }

  /// One step, with the radiosity that belongs to it. Returns max|r| = max|rho h|; infinity where it was cancelled.
  double step(std::vector<C>& radiosity) {
    const std::size_t n = radiosity.size();
    // q = (I - F rho) p
    for (std::size_t i = 0; i < n; ++i) reflected_[i] = scaled_by(problem_.reflectance[i], direction_[i]);
    if (!monitor_.gather(reflected_, gathered_)) return std::numeric_limits<double>::infinity();
    monitor_.add_steps(1, 0);
    for (std::size_t i = 0; i < n; ++i) gathered_[i] = direction_[i] - gathered_[i];
    // H += alpha p, h -= alpha q with alpha = <h, h> / <p, q>; a channel that is solved, or where the operator shows
    // itself indefinite, stays.
    const C alpha = quotient(square_, inner(direction_, gathered_));
    for (std::size_t i = 0; i < n; ++i) {
      irradiance_[i] += scaled_by(alpha, direction_[i]);
      residual_[i] -= scaled_by(alpha, gathered_[i]);
      radiosity[i] = problem_.source[i] + scaled_by(problem_.reflectance[i], irradiance_[i]);
      reflected_[i] = scaled_by(problem_.reflectance[i], residual_[i]);
    }
    // p = h + beta p with beta = <h, h> / <h, h> before.
    const C square = inner(residual_, residual_), beta = quotient(square, square_);
    for (std::size_t i = 0; i < n; ++i) direction_[i] = residual_[i] + scaled_by(beta, direction_[i]);
    square_ = square;
    return monitor_.largest_of(reflected_);
  }

 private:
  C inner(const std::vector<C>& u, const std::vector<C>& v) const {
    C sum{};
    for (std::size_t i = 0; i < u.size(); ++i) {
      sum += scaled_by(problem_.reflectance[i], scaled_by(u[i], v[i])) * transport_.areas()[i];
    }
    return sum;
  }
  static C quotient(C a, C b) {
    return by_channel(a, b, [](double x, double y) { return y > 0 ? x / y : 0; });
  }

  SolveMonitor<C>& monitor_;
  const TransportOperator& transport_;
  const ProblemOf<C>& problem_;
  std::vector<C> irradiance_, residual_, direction_;
  std::vector<C> reflected_, gathered_;
  C square_{};
};

/// Cycles of conjugate directions; where one has not halved the bound, what needs no reciprocity.
template <Channels C>
void run_cycles(SolveMonitor<C>& monitor, std::vector<C>& radiosity) {
  ConjugateGradients<C> gradients(monitor);
  std::vector<C> irradiance;
  if (!monitor.goes_on(radiosity)) return;
  for (;;) {
    const double bound_before = monitor.relative_error_bound();
    // H = F B', and the radiosity that belongs to it: a step of Jacobi.
    irradiance.assign(monitor.irradiance().begin(), monitor.irradiance().end());
    for (std::size_t i = 0; i < radiosity.size(); ++i) {
      radiosity[i] = monitor.problem().source[i] + scaled_by(monitor.problem().reflectance[i], irradiance[i]);
    }
    monitor.add_steps(1, 0);
    if (!monitor.goes_on(radiosity)) return;
    gradients.start(irradiance, monitor.irradiance());

    const double first_residual = monitor.largest_of(monitor.residuals());
    for (int k = 0; k < kMaxDirections; ++k) {
      const double residual = gradients.step(radiosity);
      if (residual == 0 || residual > kMaxGrowth * first_residual) break;
      if (!monitor.needs_no_look(residual, monitor.flux_of(radiosity), radiosity)) break;
    }
    if (!monitor.goes_on(radiosity)) return;
    if (monitor.relative_error_bound() > bound_before / 2) return solve_by_bicgstab(monitor, radiosity);
  }
}

}  // namespace

template <Channels C>
void solve_by_krylov(SolveMonitor<C>& monitor, std::vector<C>& radiosity) {
  // With light that is let through, the matrix is self-adjoint in no inner product that weighs by rho.
  if (monitor.transport().is_reciprocal() && !monitor.problem().transmits()) {
    run_cycles(monitor, radiosity);
  } else {
    solve_by_bicgstab(monitor, radiosity);
  }
  monitor.sharpen_bound();
}
template void solve_by_krylov(SolveMonitor<double>&, std::vector<double>&);
template void solve_by_krylov(SolveMonitor<Vec3>&, std::vector<Vec3>&);

}  // namespace radbake::radiosity
