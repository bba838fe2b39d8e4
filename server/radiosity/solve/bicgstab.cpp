#include <cmath>

#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {
namespace {

/// The residual that is carried along is replaced by the true one after so many steps.
constexpr int kMaxSteps = 200;
/// And where it has grown so much.
constexpr double kMaxGrowth = 1e3;

/// a / b by channels; 0 where b is 0 or nothing is left to solve, so that a channel that is solved stays.
template <Channels C>
C quotient(C a, C b) {
  return by_channel(a, b, [](double x, double y) { return y != 0 && std::isfinite(x / y) ? x / y : 0; });
}

/// Stabilised bi-conjugate gradients on (I - M F) B' = source, channels side by side.
template <Channels C>
class BiconjugateGradients {
 public:
  BiconjugateGradients(SolveMonitor<C>& monitor, std::span<const C> residual)
      : monitor_(monitor),
        residual_(residual.begin(), residual.end()),
        shadow_(residual_),
        direction_(residual_),
        applied_(residual_.size()),
        stabiliser_(residual_.size()),
        gathered_(residual_.size()),
        reach_(inner(shadow_, residual_)) {}

  /// One step. Returns max|r| as it is carried along; infinity where it was cancelled.
  double step(std::vector<C>& radiosity) {
    const std::size_t n = radiosity.size();
    constexpr double kNone = std::numeric_limits<double>::infinity();
    monitor_.add_steps(1, 0);
    // v = A p, alpha = <r^, r> / <r^, v>, s = r - alpha v
    if (!apply(direction_, applied_)) return kNone;
    const C alpha = quotient(reach_, inner(shadow_, applied_));
    for (std::size_t i = 0; i < n; ++i) {
      radiosity[i] += scaled_by(alpha, direction_[i]);
      residual_[i] -= scaled_by(alpha, applied_[i]);
    }
    // t = A s, omega = <t, s> / <t, t>, r = s - omega t
    if (!apply(residual_, stabiliser_)) return kNone;
    const C omega = quotient(inner(stabiliser_, residual_), inner(stabiliser_, stabiliser_));
    for (std::size_t i = 0; i < n; ++i) {
      radiosity[i] += scaled_by(omega, residual_[i]);
      residual_[i] -= scaled_by(omega, stabiliser_[i]);
    }
    // p = r + beta (p - omega v), beta = <r^, r> / <r^, r> before * alpha / omega
    const C reach = inner(shadow_, residual_);
    const C beta = scaled_by(quotient(reach, reach_), quotient(alpha, omega));
    for (std::size_t i = 0; i < n; ++i) {
      direction_[i] = residual_[i] + scaled_by(beta, direction_[i] - scaled_by(omega, applied_[i]));
    }
    reach_ = reach;
    return monitor_.largest_of(residual_);
  }

 private:
  /// (I - M F) values
  bool apply(const std::vector<C>& values, std::vector<C>& applied) {
    if (!monitor_.gather(values, gathered_)) return false;
    for (std::size_t i = 0; i < values.size(); ++i) {
      applied[i] = values[i] - monitor_.problem().passed_on(i, gathered_);
    }
    return true;
  }
  C inner(const std::vector<C>& u, const std::vector<C>& v) const {
    C sum{};
    for (std::size_t i = 0; i < u.size(); ++i) sum += scaled_by(u[i], v[i]) * monitor_.transport().areas()[i];
    return sum;
  }

  SolveMonitor<C>& monitor_;
  std::vector<C> residual_, shadow_, direction_, applied_, stabiliser_, gathered_;
  C reach_{};
};

}  // namespace

template <Channels C>
void solve_by_bicgstab(SolveMonitor<C>& monitor, std::vector<C>& radiosity) {
  if (!monitor.goes_on(radiosity)) return;
  for (;;) {
    const double bound_before = monitor.relative_error_bound();
    const double first_residual = monitor.largest_of(monitor.residuals());
    BiconjugateGradients<C> gradients(monitor, monitor.residuals());
    const std::vector<C> before = radiosity;
    bool has_grown = false;
    for (int k = 0; k < kMaxSteps; ++k) {
      const double residual = gradients.step(radiosity);
      if (residual == 0) break;
      has_grown = !(residual <= kMaxGrowth * first_residual);
      if (has_grown || !monitor.needs_no_look(residual, monitor.flux_of(radiosity), radiosity)) {
        break;
      }
    }
    if (has_grown && !monitor.is_cancelled()) radiosity = before;
    if (!monitor.goes_on(radiosity)) return;
    // It may break down; sweeps do not.
    if (monitor.relative_error_bound() > bound_before / 2) return solve_by_gauss_seidel(monitor, radiosity);
  }
}
template void solve_by_bicgstab(SolveMonitor<double>&, std::vector<double>&);
template void solve_by_bicgstab(SolveMonitor<Vec3>&, std::vector<Vec3>&);

}  // namespace radbake::radiosity
