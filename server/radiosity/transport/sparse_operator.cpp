#include "server/radiosity/transport/sparse_operator.h"

#include <algorithm>
#include <cmath>

#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

constexpr std::size_t kRowsPerTask = 256;
/// Scaling ends when every row sum is right to this, or has stopped getting better.
constexpr int kMaxScalingSweeps = 500;
/// Rows are scaled by themselves where the symmetric scaling leaves one off by more than this.
constexpr double kRowsByThemselves = 1e-9;

template <typename Body>
void for_each_row(std::size_t n, const Body& body) {
  for_each_range(n, kRowsPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) body(static_cast<std::uint32_t>(i));
  });
}

/// The transpose of the weights, with rows in compressed form.
struct Transposed {
  std::vector<std::uint64_t> first;
  std::vector<EstimatedRows::Entry> entries;

  explicit Transposed(const EstimatedRows& rows) : first(rows.size() + 1, 0), entries(rows.entries.size()) {
    for (const auto& entry : rows.entries) ++first[entry.patch + 1];
    for (std::size_t i = 0; i < rows.size(); ++i) first[i + 1] += first[i];
    std::vector<std::uint64_t> next(first.begin(), first.end() - 1);
    for (std::uint32_t i = 0; i < rows.size(); ++i) {
      for (std::uint64_t k = rows.first[i]; k < rows.first[i + 1]; ++k) {
        entries[next[rows.entries[k].patch]++] = {i, rows.entries[k].weight};
      }
    }
  }
};

/// Calls visit(j, w_ij, w_ji) for every patch j that row i or column i holds, ascending.
template <typename Visit>
void merge_row_and_column(const EstimatedRows& rows, const Transposed& columns, std::uint32_t i, const Visit& visit) {
  std::uint64_t a = rows.first[i], b = columns.first[i];
  const std::uint64_t a_end = rows.first[i + 1], b_end = columns.first[i + 1];
  while (a < a_end || b < b_end) {
    const std::uint32_t ja = a < a_end ? rows.entries[a].patch : 0xffffffffu;
    const std::uint32_t jb = b < b_end ? columns.entries[b].patch : 0xffffffffu;
    const std::uint32_t j = std::min(ja, jb);
    visit(j, ja == j ? rows.entries[a].weight : 0.0f, jb == j ? columns.entries[b].weight : 0.0f);
    a += ja == j;
    b += jb == j;
  }
}

}  // namespace

SparseOperator::SparseOperator(const EstimatedRows& rows, const std::stop_token& stop, double tolerance)
    : areas_(rows.areas) {
  pair_estimates(rows, stop);
  if (!stop.stop_requested()) restore_row_sums(rows, stop, tolerance);
}

void SparseOperator::pair_estimates(const EstimatedRows& rows, const std::stop_token& stop) {
  const std::size_t n = rows.size();
  const Transposed columns(rows);
  // Count, then fill, each row by itself.
  first_.assign(n + 1, 0);
  for_each_row(n, [&](std::uint32_t i) {
    std::uint64_t length = 0;
    merge_row_and_column(rows, columns, i, [&](std::uint32_t, float, float) { ++length; });
    first_[i + 1] = length;
  });
  for (std::size_t i = 0; i < n; ++i) first_[i + 1] += first_[i];
  patches_.resize(first_[n]);
  exchange_.resize(first_[n]);

  // Flux-weighted mean square of the two estimates' difference over their mean, before they are averaged.
  std::vector<double> squares(n, 0), weights(n, 0);
  const auto rays_per_area = [&](std::uint32_t i) { return areas_[i] > 0 ? rows.counted[i] / areas_[i] : 0; };
  for_each_row(n, [&](std::uint32_t i) {
    if (stop.stop_requested()) return;
    std::uint64_t at = first_[i];
    const double wi = rays_per_area(i);
    merge_row_and_column(rows, columns, i, [&](std::uint32_t j, double own, double other) {
      const double wj = rays_per_area(j);
      const double exchange = wi + wj > 0 ? (own + other) / (wi + wj) : 0;
      patches_[at] = j;
      exchange_[at++] = static_cast<float>(exchange);
      if (exchange > 0 && wi > 0 && wj > 0) {
        const double difference = (own / wi - other / wj) / exchange;
        squares[i] += exchange * difference * difference;
        weights[i] += exchange;
      }
    });
  });
  double square = 0, weight = 0;
  for (std::size_t i = 0; i < n; ++i) {
    square += squares[i];
    weight += weights[i];
  }
  repair_.num_entries = first_[n];
  repair_.raw_reciprocity_rms = weight > 0 ? std::sqrt(square / weight) : 0;
}

double SparseOperator::scaled_row(std::uint32_t i) const {
  double sum = 0;
  for (std::uint64_t k = first_[i]; k < first_[i + 1]; ++k) sum += exchange_[k] * scale_[patches_[k]];
  return sum * scale_[i];
}

void SparseOperator::restore_row_sums(const EstimatedRows& rows, const std::stop_token& stop, double tolerance) {
  const std::size_t n = rows.size();
  scale_.assign(n, 1);
  std::vector<double> target(n, 0), sums(n, 0);
  double area = 0;
  for (std::uint32_t i = 0; i < n; ++i) {
    target[i] = areas_[i] * rows.measured_row_sum(i);
    if (rows.counted[i] == 0) continue;
    double arrived = 0;
    for (std::uint64_t k = rows.first[i]; k < rows.first[i + 1]; ++k) arrived += rows.entries[k].weight;
    const double closure = (arrived + rows.escaped[i] + rows.absorbed[i]) / rows.counted[i];
    repair_.raw_closure_max = std::max(repair_.raw_closure_max, std::fabs(closure - 1));
    area += areas_[i];
  }
  const EstimatedRows::LostShares lost = rows.lost_shares();
  repair_.escape_share = lost.escaped;
  repair_.absorbed_share = lost.absorbed;

  // d_i <- d_i sqrt(target_i / row_i) until the rows fit or stop getting better.
  const auto measure = [&](bool with_rms) {
    for_each_row(n, [&](std::uint32_t i) { sums[i] = target[i] > 0 ? scaled_row(i) : 0; });
    double worst = 0, square = 0;
    for (std::size_t i = 0; i < n; ++i) {
      if (target[i] <= 0) continue;
      const double error = sums[i] / target[i] - 1;
      worst = std::max(worst, std::fabs(error));
      square += areas_[i] * error * error;
    }
    if (with_rms && area > 0) repair_.paired_row_error_rms = std::sqrt(square / area);
    return worst;
  };
  double worst = measure(true), best = worst;
  int sweeps_since_best = 0;
  constexpr int kPatience = 20;
  while (worst > tolerance && repair_.scaling_sweeps < kMaxScalingSweeps && sweeps_since_best < kPatience &&
         !stop.stop_requested()) {
    for (std::size_t i = 0; i < n; ++i) {
      if (target[i] > 0 && sums[i] > 0) scale_[i] *= std::sqrt(target[i] / sums[i]);
    }
    ++repair_.scaling_sweeps;
    worst = measure(false);
    sweeps_since_best = worst < 0.99 * best ? 0 : sweeps_since_best + 1;
    best = std::min(best, worst);
  }
  if (stop.stop_requested()) return;

  repair_.repaired_row_error_max = worst;
  divisors_ = areas_;
  if (worst <= std::max(tolerance, kRowsByThemselves)) return;
  for (std::size_t i = 0; i < n; ++i) {
    if (target[i] > 0 && sums[i] > 0) divisors_[i] = areas_[i] * sums[i] / target[i];
  }
  is_reciprocal_ = false;
}

SparseOperator::ExchangeRow SparseOperator::exchange_row(std::uint32_t i) const {
  const std::uint64_t length = first_[i + 1] - first_[i];
  return {std::span(patches_).subspan(first_[i], length), std::span(exchange_).subspan(first_[i], length)};
}

void SparseOperator::row(std::uint32_t i, std::vector<std::uint32_t>& patches,
                         std::vector<double>& form_factors) const {
  const ExchangeRow entries = exchange_row(i);
  patches.assign(entries.patches.begin(), entries.patches.end());
  form_factors.clear();
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const double exchange = scale_[i] * scale_[patches[k]] * entries.exchange[k];
    form_factors.push_back(divisors_[i] > 0 ? exchange / divisors_[i] : 0);
  }
}

void SparseOperator::column(std::uint32_t j, std::vector<std::uint32_t>& patches,
                            std::vector<double>& form_factors) const {
  // S is symmetric, so column j has the entries of row j: F_ij = d_i S_ji d_j / q_i.
  const ExchangeRow entries = exchange_row(j);
  patches.assign(entries.patches.begin(), entries.patches.end());
  form_factors.resize(patches.size());
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const std::uint32_t i = patches[k];
    const double exchange = scale_[i] * scale_[j] * entries.exchange[k];
    form_factors[k] = divisors_[i] > 0 ? exchange / divisors_[i] : 0;
  }
}

template <Channels C>
C SparseOperator::gathered(std::uint32_t i, std::span<const C> radiosity) const {
  // Every solver's time goes here: pointers, so that no index is checked.
  const C* values = radiosity.data();
  const double* scale = scale_.data();
  const ExchangeRow entries = exchange_row(i);
  const std::uint32_t* patches = entries.patches.data();
  const float* exchange = entries.exchange.data();
  C sum{};
  for (std::size_t k = 0, length = entries.patches.size(); k < length; ++k) {
    sum += values[patches[k]] * (exchange[k] * scale[patches[k]]);
  }
  return divisors_[i] > 0 ? sum * (scale_[i] / divisors_[i]) : C{};
}
template double SparseOperator::gathered(std::uint32_t, std::span<const double>) const;
template Vec3 SparseOperator::gathered(std::uint32_t, std::span<const Vec3>) const;

double SparseOperator::row_sum(std::uint32_t i) const { return divisors_[i] > 0 ? scaled_row(i) / divisors_[i] : 0; }

}  // namespace radbake::radiosity
