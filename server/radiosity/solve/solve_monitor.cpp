#include "server/radiosity/solve/solve_monitor.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

constexpr double kRoundoff = std::numeric_limits<double>::epsilon() / 2;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kGrowthThatMeansDivergence = 1e6;

}  // namespace

template <Channels C>
double SolveMonitor<C>::largest_of(std::span<const C> values) {
  double largest = 0;
  for (const C& v : values) largest = std::max(largest, largest_component(v));
  return largest;
}

template <Channels C>
double SolveMonitor<C>::flux_of(std::span<const C> radiosity) const {
  double flux = 0;
  for (std::size_t i = 0; i < radiosity.size(); ++i) flux += transport_.areas()[i] * mean_of_channels(radiosity[i]);
  return flux;
}

template <Channels C>
SolveMonitor<C>::SolveMonitor(Solver solver, const TransportOperator& transport, const ProblemOf<C>& problem,
                              const SolveOptions& options, const SolveObserverOf<C>& observe, std::stop_token stop)
    : transport_(transport),
      problem_(problem),
      options_(options),
      observe_(observe),
      stop_(std::move(stop)),
      start_(std::chrono::steady_clock::now()),
      max_steps_(options.max_sweeps),
      terms_(transport.size()),
      residuals_(transport.size()),
      irradiance_(transport.size()) {
  RADBAKE_CHECK_EQ(problem.source.size(), transport.size());
  RADBAKE_CHECK_EQ(problem.reflectance.size(), transport.size());
  RADBAKE_CHECK_EQ(problem.transmittance.size(), problem.transmits() ? transport.size() : 0);
  RADBAKE_CHECK_EQ(problem.other_side.size(), problem.transmittance.size());
  report_.solver = solver;
  if (reads_columns(solver)) max_steps_ *= static_cast<std::int64_t>(transport.size());
  for (const double area : transport.areas()) area_ += area;
  margin_ = 1 - (transport.is_by_columns() ? largest_share_sent_on() : largest_share_passed_on());
}

template <Channels C>
double SolveMonitor<C>::largest_share_passed_on() const {
  double passed_on = 0;
  for (std::uint32_t i = 0; i < size(); ++i) {
    C share = problem_.reflectance[i] * transport_.row_sum(i);
    if (problem_.transmits()) share += problem_.transmittance[i] * transport_.row_sum(problem_.other_side[i]);
    passed_on = std::max(passed_on, max_component(share));
  }
  return passed_on;
}

template <Channels C>
double SolveMonitor<C>::largest_share_sent_on() {
  const auto areas = transport_.areas();
  std::vector<double> sent_on(size(), 0);
  for_each_range(size(), transport_.rows_per_task(), [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> patches;
    std::vector<double> form_factors;
    for (std::size_t j = begin; j < end && !is_cancelled(); ++j) {
      transport_.column(static_cast<std::uint32_t>(j), patches, form_factors);
      for (std::size_t k = 0; k < patches.size(); ++k) {
        const std::uint32_t i = patches[k];
        sent_on[j] += areas[i] * max_component(problem_.reflectance[i]) * form_factors[k];
        if (problem_.transmits()) {
          const std::uint32_t other = problem_.other_side[i];
          sent_on[j] += areas[other] * max_component(problem_.transmittance[other]) * form_factors[k];
        }
      }
      if (areas[j] > 0) sent_on[j] /= areas[j];
    }
  });
  report_.work += static_cast<std::int64_t>(size());
  return sent_on.empty() ? 0 : *std::max_element(sent_on.begin(), sent_on.end());
}

template <Channels C>
double SolveMonitor<C>::size_of(std::span<const C> values) const {
  if (!transport_.is_by_columns()) return largest_of(values);
  double sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i) sum += transport_.areas()[i] * largest_component(values[i]);
  return area_ > 0 ? sum / area_ : 0;
}

template <Channels C>
double SolveMonitor<C>::seconds() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

template <Channels C>
void SolveMonitor<C>::add_steps(std::int64_t steps, std::int64_t work) {
  report_.steps += steps;
  report_.work += work;
}

template <Channels C>
bool SolveMonitor<C>::look(std::span<const C> radiosity) {
  RADBAKE_CHECK_EQ(radiosity.size(), size());
  const bool is_by_columns = transport_.is_by_columns();
  if (is_by_columns) {
    transport_.gather(radiosity, irradiance_);
  } else if (!gather(radiosity, irradiance_)) {
    return false;
  }
  for_each_range(size(), transport_.rows_per_task(), [&](std::size_t begin, std::size_t end) {
    if (stop_.stop_requested()) return;
    for (std::size_t i = begin; i < end; ++i) {
      const auto patch = static_cast<std::uint32_t>(i);
      // r = source + M F B' - B', and a bound on its own rounding: (n + 4) u times the sum of magnitudes.
      const C passed_on = problem_.passed_on(i, irradiance_);
      residuals_[i] = problem_.source[i] + passed_on - radiosity[i];
      const C magnitude = problem_.source[i] + passed_on + radiosity[i];
      std::size_t length = transport_.row_length(patch);
      if (problem_.transmits()) length = std::max(length, transport_.row_length(problem_.other_side[i])) + 2;
      const double roundings = static_cast<double>(length) + 4;
      terms_[i] = {largest_component(residuals_[i]), roundings * kRoundoff * max_component(magnitude)};
    }
  });
  if (stop_.stop_requested()) return false;
  if (is_by_columns) report_.work += static_cast<std::int64_t>(size());

  const auto areas = transport_.areas();
  report_.residual = rounding_ = flux_ = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    if (is_by_columns) {
      const double share = area_ > 0 ? areas[i] / area_ : 0;
      report_.residual += share * terms_[i].residual;
      rounding_ += share * terms_[i].rounding;
    } else {
      report_.residual = std::max(report_.residual, terms_[i].residual);
      rounding_ = std::max(rounding_, terms_[i].rounding);
    }
    flux_ += areas[i] * mean_of_channels(radiosity[i]);
  }
  const SolveStep now = step_of(report_.residual, flux_);
  report_.error_bound = now.error_bound;
  report_.relative_error_bound = now.relative_error_bound;
  return true;
}

template <Channels C>
bool SolveMonitor<C>::gather(std::span<const C> values, std::span<C> gathered) {
  for_each_range(size(), transport_.rows_per_task(), [&](std::size_t begin, std::size_t end) {
    if (stop_.stop_requested()) return;
    for (std::size_t i = begin; i < end; ++i) {
      gathered[i] = transport_.gather_at(static_cast<std::uint32_t>(i), values);
    }
  });
  report_.work += static_cast<std::int64_t>(size());
  return !stop_.stop_requested();
}

template <Channels C>
SolveStep SolveMonitor<C>::step_of(double residual, double flux) const {
  SolveStep step{report_.steps, report_.work, seconds(), residual, (residual + rounding_) / margin_, 0};
  if (step.error_bound > 0) step.relative_error_bound = flux > 0 ? step.error_bound * area_ / flux : kInfinity;
  return step;
}

template <Channels C>
void SolveMonitor<C>::record(double residual, double flux, bool always, std::span<const C> radiosity,
                             std::span<const C> unshot) {
  if (!always && report_.steps < next_record_) return;
  const SolveStep step = step_of(residual, flux);
  // A look after steps that were recorded already says it better.
  if (!report_.history.empty() && report_.history.back().steps == step.steps) report_.history.pop_back();
  report_.history.push_back(step);
  if (observe_) observe_({report_.history.back(), radiosity, unshot});
  constexpr std::int64_t kRecordsToDoubleSteps = 50;
  next_record_ = report_.steps + 1;
  if (reads_columns(report_.solver)) next_record_ += report_.steps / kRecordsToDoubleSteps;
}

template <Channels C>
bool SolveMonitor<C>::goes_on(std::span<const C> radiosity, std::span<const C> unshot) {
  report_.status = SolveStatus::kDiverged;
  if (!(margin_ > 0)) return false;
  report_.status = SolveStatus::kCancelled;
  if (is_cancelled() || !look(radiosity)) return false;
  if (report_.history.empty()) first_residual_ = report_.residual + rounding_;
  record(report_.residual, flux_, true, radiosity, unshot);

  report_.status = SolveStatus::kConverged;
  if (report_.relative_error_bound <= options_.relative_tolerance) return false;
  report_.status = SolveStatus::kDiverged;
  if (!std::isfinite(report_.error_bound) || report_.residual > kGrowthThatMeansDivergence * first_residual_) {
    return false;
  }
  report_.status = SolveStatus::kCancelled;
  if (is_cancelled()) return false;
  report_.status = SolveStatus::kTimeBudget;
  if (seconds() >= options_.time_budget_seconds) return false;
  report_.status = SolveStatus::kIterationLimit;
  return !are_steps_used_up();
}

template <Channels C>
bool SolveMonitor<C>::needs_no_look(double residual, double flux, std::span<const C> radiosity,
                                    std::span<const C> unshot) {
  record(residual, flux, false, radiosity, unshot);
  const double bound = (residual + rounding_) / margin_;
  return std::isfinite(bound) && !(flux > 0 && bound * area_ <= options_.relative_tolerance * flux) &&
         !is_cancelled() && seconds() < options_.time_budget_seconds && !are_steps_used_up();
}

template <Channels C>
void SolveMonitor<C>::end_without_progress() {
  report_.status = is_cancelled() ? SolveStatus::kCancelled : SolveStatus::kIterationLimit;
}

template <Channels C>
void SolveMonitor<C>::sharpen_bound() {
  const bool is_bounded = margin_ > 0 && std::isfinite(report_.error_bound) &&
                          report_.status != SolveStatus::kCancelled && report_.status != SolveStatus::kDiverged;
  // Above this margin the plain bound is at most (2 - margin) / margin < 100 x the error.
  constexpr double kMarginThatSuffices = 0.02;
  if (!is_bounded || margin_ >= kMarginThatSuffices) return;
  std::size_t longest_row = 0;
  for (std::uint32_t i = 0; i < size(); ++i) longest_row = std::max(longest_row, transport_.row_length(i));

  std::vector<C> term(residuals_), sum(residuals_);
  double rounding = rounding_, magnitudes = report_.residual;
  constexpr int kMaxTerms = 50;
  for (int k = 1; k <= kMaxTerms; ++k) {
    // (M F)^k r, and the rounding that it adds.
    rounding += (static_cast<double>(longest_row) + 4) * kRoundoff * largest_of(term);
    if (!gather(term, irradiance_)) break;
    for (std::size_t i = 0; i < size(); ++i) term[i] = problem_.passed_on(i, irradiance_);
    const double rest = (largest_of(term) + rounding) / margin_, known = largest_of(sum);
    const double sharp = known + k * kRoundoff * magnitudes + rest;
    if (sharp < report_.error_bound) {
      report_.error_bound = sharp;
      report_.relative_error_bound = flux_ > 0 ? sharp * area_ / flux_ : kInfinity;
    }
    if (rest <= known / 2 || largest_of(term) <= rounding) break;
    for (std::size_t i = 0; i < size(); ++i) sum[i] += term[i];
    magnitudes += largest_of(term);
  }
  if (report_.relative_error_bound <= options_.relative_tolerance) report_.status = SolveStatus::kConverged;
}

template <Channels C>
SolveReport SolveMonitor<C>::take_report() {
  const auto n = static_cast<std::int64_t>(std::max<std::size_t>(size(), 1));
  report_.sweeps = static_cast<int>(reads_columns(report_.solver) ? report_.steps / n : report_.steps);
  report_.seconds = seconds();
  return std::move(report_);
}
template class SolveMonitor<double>;
template class SolveMonitor<Vec3>;

}  // namespace radbake::radiosity
