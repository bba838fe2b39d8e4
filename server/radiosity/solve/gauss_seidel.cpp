#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/check.h"
#include "server/radiosity/solve/solve.h"
#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

constexpr std::size_t kRowsPerTask = 256;
constexpr double kRoundoff = std::numeric_limits<double>::epsilon() / 2;

/// The residual of a guess and what follows from it for the error.
struct ErrorBound {
  double residual = 0, error = 0, relative = 0;
};

class BoundEstimator {
 public:
  BoundEstimator(const TransportOperator& transport, const RadiosityProblem& problem)
      : transport_(transport), problem_(problem), terms_(transport.size()) {
    // 1 - max_i rho_i (F1)_i: how far the system is from passing everything on.
    double passed_on = 0;
    for (std::uint32_t i = 0; i < transport.size(); ++i) {
      passed_on = std::max(passed_on, max_component(problem.reflectance[i]) * transport.row_sum(i));
    }
    margin_ = 1 - passed_on;
  }

  bool is_contracting() const { return margin_ > 0; }

  ErrorBound operator()(const std::vector<Vec3>& radiosity) {
    const auto areas = transport_.areas();
    for_each_range(terms_.size(), kRowsPerTask, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto patch = static_cast<std::uint32_t>(i);
        // r = source + rho F B' - B', and a bound on its own rounding: (n + 4) u times the sum of magnitudes.
        const Vec3 reflected = scaled_by(problem_.reflectance[i], transport_.gather_at(patch, radiosity));
        const Vec3 r = problem_.source[i] + reflected - radiosity[i];
        const Vec3 magnitude = problem_.source[i] + reflected + radiosity[i];
        const double roundings = static_cast<double>(transport_.row_length(patch)) + 4;
        const double largest = std::max({std::fabs(r.x), std::fabs(r.y), std::fabs(r.z)});
        // A maximum passes over NaN: say infinity instead.
        terms_[i] = {is_finite(r) ? largest : std::numeric_limits<double>::infinity(),
                     roundings * kRoundoff * max_component(magnitude)};
      }
    });
    ErrorBound bound;
    double rounding = 0, flux = 0, area = 0;
    for (std::size_t i = 0; i < terms_.size(); ++i) {
      bound.residual = std::max(bound.residual, terms_[i].residual);
      rounding = std::max(rounding, terms_[i].rounding);
      flux += areas[i] * mean_component(radiosity[i]);
      area += areas[i];
    }
    bound.error = (bound.residual + rounding) / margin_;
    bound.relative = flux > 0 ? bound.error * area / flux : (bound.error > 0 ? bound.error : 0);
    return bound;
  }

 private:
  struct Term {
    double residual, rounding;
  };
  const TransportOperator& transport_;
  const RadiosityProblem& problem_;
  std::vector<Term> terms_;
  double margin_ = 0;
};

}  // namespace

const char* solve_status_name(SolveStatus status) {
  switch (status) {
    case SolveStatus::kConverged: return "converged";
    case SolveStatus::kIterationLimit: return "iteration_limit";
    case SolveStatus::kDiverged: return "diverged";
    case SolveStatus::kCancelled: return "cancelled";
  }
  return "unknown";
}

SolveReport solve_gauss_seidel(const TransportOperator& transport, const RadiosityProblem& problem,
                               const SolveOptions& options, std::vector<Vec3>& radiosity,
                               const std::function<void(int, double)>& observe, std::stop_token stop) {
  const std::size_t n = transport.size();
  RADBAKE_CHECK_EQ(problem.source.size(), n);
  RADBAKE_CHECK_EQ(problem.reflectance.size(), n);
  RADBAKE_CHECK_EQ(radiosity.size(), n);

  SolveReport report;
  BoundEstimator estimate_bound(transport, problem);
  if (!estimate_bound.is_contracting()) {
    report.status = SolveStatus::kDiverged;
    report.residual = report.error_bound = report.relative_error_bound = std::numeric_limits<double>::infinity();
    return report;
  }
  double first_residual = 0;
  constexpr double kGrowthThatMeansDivergence = 1e6;
  for (report.sweeps = 0;; ++report.sweeps) {
    const ErrorBound bound = estimate_bound(radiosity);
    report.residual = bound.residual;
    report.error_bound = bound.error;
    report.relative_error_bound = bound.relative;
    if (report.sweeps > 0) {
      report.history.push_back(bound.relative);
      if (observe) observe(report.sweeps, bound.relative);
    } else {
      first_residual = bound.residual;
    }
    report.status = SolveStatus::kConverged;
    if (bound.relative <= options.relative_tolerance) break;
    report.status = SolveStatus::kDiverged;
    if (!std::isfinite(bound.error) || bound.residual > kGrowthThatMeansDivergence * first_residual) break;
    report.status = SolveStatus::kCancelled;
    if (stop.stop_requested()) break;
    report.status = SolveStatus::kIterationLimit;
    if (report.sweeps == options.max_sweeps) break;

    // B'_i <- source_i + rho_i sum_j F_ij B'_j, each with the newest values.
    for (std::uint32_t i = 0; i < n; ++i) {
      radiosity[i] = problem.source[i] + scaled_by(problem.reflectance[i], transport.gather_at(i, radiosity));
    }
  }
  return report;
}

}  // namespace radbake::radiosity
