#include "client/image/box_reduction.h"

#include <algorithm>

#include "common/base/check.h"

namespace radbake::image {
namespace {

// Calls sink(target, weight) for the one or two targets that source pixel `i` of `n` overlaps when `m` targets cover
// the same length. Weights are in source pixels / (n / m), so those of one target sum to 1.
template <typename Sink>
void for_each_overlap(int i, int n, int m, Sink&& sink) {
  // Positions on a grid of n * m steps are whole numbers: source i covers [i m, (i + 1) m), target t [t n, (t + 1) n).
  const long long begin = static_cast<long long>(i) * m, end = begin + m;
  for (long long target = begin / n; target * n < end; ++target) {
    const long long overlap = std::min(end, (target + 1) * n) - std::max(begin, target * n);
    sink(static_cast<std::size_t>(target), static_cast<double>(overlap) / n);
  }
}

}  // namespace

BoxReduction::BoxReduction(int source_width, int source_height, int target_width, int target_height, int channels)
    : source_width_(source_width),
      source_height_(source_height),
      target_width_(target_width),
      target_height_(target_height),
      channels_(channels),
      sums_(std::size_t(target_width) * std::size_t(target_height) * std::size_t(channels)),
      reduced_row_(std::size_t(target_width) * std::size_t(channels)) {
  RADBAKE_CHECK_LE(target_width, source_width);
  RADBAKE_CHECK_LE(target_height, source_height);
}

void BoxReduction::add_row(std::span<const double> row) {
  RADBAKE_CHECK_LT(next_row_, source_height_);
  // Reduce the row.
  const std::size_t channels = static_cast<std::size_t>(channels_);
  std::fill(reduced_row_.begin(), reduced_row_.end(), 0.0);
  for (int x = 0; x < source_width_; ++x) {
    for_each_overlap(x, source_width_, target_width_, [&](std::size_t target, double weight) {
      for (std::size_t c = 0; c < channels; ++c) {
        reduced_row_[target * channels + c] += weight * row[std::size_t(x) * channels + c];
      }
    });
  }
  // Add it to the rows that it overlaps.
  for_each_overlap(next_row_++, source_height_, target_height_, [&](std::size_t target, double weight) {
    double* sum = &sums_[target * reduced_row_.size()];
    for (std::size_t i = 0; i < reduced_row_.size(); ++i) sum[i] += weight * reduced_row_[i];
  });
}

std::vector<float> BoxReduction::finish() const { return std::vector<float>(sums_.begin(), sums_.end()); }

}  // namespace radbake::image
