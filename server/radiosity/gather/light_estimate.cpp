#include "server/radiosity/gather/light_estimate.h"

#include <cmath>

namespace radbake::radiosity {
namespace {

/// Moves a mean by a share of the way to a new value.
void move_mean(std::vector<float>& means, std::size_t i, Vec3 value, double share) {
  for (int c = 0; c < 3; ++c) {
    float& mean = means[3 * i + static_cast<std::size_t>(c)];
    mean = static_cast<float>(mean + (value[c] - mean) * share);
  }
}

/// The variance of a mean that moved by that share.
void move_variance(std::vector<float>& variances, std::size_t i, Vec3 variance, double share) {
  for (int c = 0; c < 3; ++c) {
    float& own = variances[3 * i + static_cast<std::size_t>(c)];
    own = static_cast<float>(own * (1 - share) * (1 - share) + variance[c] * share * share);
  }
}

}  // namespace

MeanAndVariance mean_and_variance(std::span<const Vec3> replicates) {
  const auto num = static_cast<double>(replicates.size());
  MeanAndVariance out;
  for (const Vec3& x : replicates) out.mean += x / num;
  if (replicates.size() < 2) return out;
  for (const Vec3& x : replicates) {
    const Vec3 off = x - out.mean;
    out.variance += scaled_by(off, off) / (num * (num - 1));
  }
  return out;
}

double mean_square_without_noise(std::span<const Vec3> replicates) {
  const auto num = static_cast<double>(replicates.size());
  if (replicates.size() < 2) return 0;
  Vec3 sum, squares;
  for (const Vec3& x : replicates) {
    sum += x;
    squares += scaled_by(x, x);
  }
  return mean_component(scaled_by(sum, sum) - squares) / (num * (num - 1));
}

void ReplicateSpread::add_pass(double weight, std::span<const double> squares) {
  const auto num = static_cast<double>(squares.size());
  double mean = 0, variance = 0;
  for (const double square : squares) mean += square / num;
  for (const double square : squares)
    variance += squares.size() > 1 ? (square - mean) * (square - mean) / (num - 1) : 0;
  // The squares of a weighted mean's parts add up, and so do their variances.
  const double share = weight / (weight_ += weight), part = share * share, rest = (1 - share) * (1 - share);
  mean_ = rest * mean_ + part * mean;
  deviation_ = std::hypot(rest * deviation_, part * std::sqrt(variance));
}

LightEstimate::LightEstimate(std::size_t num_receivers, std::size_t num_cells, bool has_reflected, bool has_openness)
    : direct_(3 * num_receivers),
      gathered_(3 * num_receivers),
      reflected_(has_reflected ? 3 * num_receivers : 0),
      openness_(has_openness ? num_receivers : 0),
      direct_variance_(3 * num_receivers),
      gathered_variance_(3 * num_receivers),
      direct_weight_(num_receivers),
      has_gathered_(num_receivers, 0),
      patch_square_(num_cells),
      interpolation_square_(num_cells) {}

void LightEstimate::add(std::size_t i, const PassLight& light, double direct_weight) {
  const double gathered_share = has_gathered_[i] ? pass_weight_ / (gathered_weight_ + pass_weight_) : 1;
  const double direct_share = direct_weight / (direct_weight_[i] + direct_weight);
  move_mean(gathered_, i, light.gathered, gathered_share);
  move_variance(gathered_variance_, i, light.gathered_variance, gathered_share);
  move_mean(direct_, i, light.direct, direct_share);
  move_variance(direct_variance_, i, light.direct_variance, direct_share);
  direct_weight_[i] += static_cast<float>(direct_weight);
  has_gathered_[i] = 1;
  if (!reflected_.empty()) move_mean(reflected_, i, light.reflected, gathered_share);
  if (!openness_.empty()) {
    openness_[i] = static_cast<float>(openness_[i] + (light.openness - openness_[i]) * gathered_share);
  }
}

void LightEstimate::add_to_cell(std::size_t cell, double patch_square, double interpolation_square) {
  const double share = pass_weight_ / (gathered_weight_ + pass_weight_);
  const auto move = [share](float& mean, double value) { mean = static_cast<float>(mean + (value - mean) * share); };
  move(patch_square_[cell], patch_square);
  move(interpolation_square_[cell], interpolation_square);
}

}  // namespace radbake::radiosity
