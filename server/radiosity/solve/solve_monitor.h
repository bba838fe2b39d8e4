#pragma once

#include <chrono>
#include <cmath>

#include "server/radiosity/solve/solve.h"

namespace radbake::radiosity {

/// What all solvers share: the look at residual and bound, the stop criteria, and the report.
///
/// A solver is a loop `while (monitor.goes_on(B)) { take a step; monitor.add_steps(...); }`. Solvers that carry the
/// residual along take many steps between two looks, and ask needs_no_look() after each.
/// C: one channel or three; of equal channels every number and decision has the same bits.
template <Channels C>
class SolveMonitor {
 public:
  SolveMonitor(Solver solver, const TransportOperator& transport, const ProblemOf<C>& problem,
               const SolveOptions& options, const SolveObserverOf<C>& observe, std::stop_token stop);

  const TransportOperator& transport() const { return transport_; }
  const ProblemOf<C>& problem() const { return problem_; }
  std::size_t size() const { return terms_.size(); }

  /// Counts steps and the rows or columns that they read.
  void add_steps(std::int64_t steps, std::int64_t work);

  /// Reads all rows for the true residual and the bound, and records them. False: the solve ends, with its status.
  bool goes_on(std::span<const C> radiosity, std::span<const C> unshot = {});

  /// Records a residual that the solver carries along. False where a true look is due: it suffices for the tolerance,
  /// is not finite, or steps or time are used up; or where the solve was cancelled, which the next goes_on() finds.
  /// Shapes: flux = flux_of(radiosity).
  bool needs_no_look(double residual, double flux, std::span<const C> radiosity, std::span<const C> unshot = {});

  /// F values, as TransportOperator::gather, and counts its rows. False where it was cancelled on the way.
  bool gather(std::span<const C> values, std::span<C> gathered);

  bool is_cancelled() const { return stop_.stop_requested(); }

  /// The size of residuals in the norm of the bound: the largest; of operators known by columns the mean by area.
  double size_of(std::span<const C> values) const;

  /// max |component|; infinity where one is not finite.
  static double largest_of(std::span<const C> values);
  /// sum_i A_i mean_of_channels(B_i)
  double flux_of(std::span<const C> radiosity) const;

  /// Ends a solve that no step changes any more, or that was cancelled within one.
  void end_without_progress();

  /// Of the last look: r = source + M F B - B, and F B.
  std::span<const C> residuals() const { return residuals_; }
  std::span<const C> irradiance() const { return irradiance_; }
  double flux() const { return flux_; }
  double relative_error_bound() const { return report_.relative_error_bound; }
  std::int64_t steps() const { return report_.steps; }
  /// 1 - max_i (M F 1)_i; of operators known by columns 1 - max_j sum_i A_i (M F)_ij / A_j
  double margin() const { return margin_; }

  /// Sharpens the bound of the last look: (I - M F)^-1 = sum_m (M F)^m, its first k terms summed with their signs,
  ///
  ///   max|B' - exact| <= max|sum_(m<k) (M F)^m r| + (max|(M F)^k r| + rounding) / (1 - max_i (M F 1)_i)
  ///
  /// until the rest is half of the sum: then the bound is at most 3 x the error. Wanted where residuals change sign
  /// from patch to patch, as those of Krylov methods do: the plain bound is then up to 1/(1 - rho) too large.
  void sharpen_bound();

  SolveReport take_report();

 private:
  struct Term {
    double residual, rounding;
  };
  bool look(std::span<const C> radiosity);
  double largest_share_passed_on() const;
  double largest_share_sent_on();
  void record(double residual, double flux, bool always, std::span<const C> radiosity, std::span<const C> unshot);
  SolveStep step_of(double residual, double flux) const;
  double seconds() const;
  bool are_steps_used_up() const { return report_.steps >= max_steps_; }

  const TransportOperator& transport_;
  const ProblemOf<C>& problem_;
  const SolveOptions& options_;
  const SolveObserverOf<C>& observe_;
  std::stop_token stop_;
  std::chrono::steady_clock::time_point start_;
  SolveReport report_;
  std::int64_t max_steps_ = 0;
  std::int64_t next_record_ = 0;
  std::vector<Term> terms_;
  std::vector<C> residuals_, irradiance_;
  double margin_ = 0, rounding_ = 0, area_ = 0, flux_ = 0;
  double first_residual_ = 0;
};

/// max |component|; infinity where one is not finite, which a maximum would pass over.
inline double largest_component(double v) {
  return is_finite(v) ? std::fabs(v) : std::numeric_limits<double>::infinity();
}
inline double largest_component(Vec3 v) {
  const double largest = std::fmax(std::fabs(v.x), std::fmax(std::fabs(v.y), std::fabs(v.z)));
  return is_finite(v) ? largest : std::numeric_limits<double>::infinity();
}

// The solvers, for one channel and for three; each leaves its last state in radiosity.
template <Channels C>
void solve_by_lu(SolveMonitor<C>& monitor, std::vector<C>& radiosity);
template <Channels C>
void solve_by_jacobi(SolveMonitor<C>& monitor, std::vector<C>& radiosity);
template <Channels C>
void solve_by_gauss_seidel(SolveMonitor<C>& monitor, std::vector<C>& radiosity);
template <Channels C>
void solve_by_southwell(SolveMonitor<C>& monitor, std::vector<C>& radiosity);
template <Channels C>
void solve_by_shooting(SolveMonitor<C>& monitor, std::vector<C>& radiosity, std::vector<C>& unshot);
template <Channels C>
void solve_by_krylov(SolveMonitor<C>& monitor, std::vector<C>& radiosity);
template <Channels C>
void solve_by_bicgstab(SolveMonitor<C>& monitor, std::vector<C>& radiosity);

}  // namespace radbake::radiosity
