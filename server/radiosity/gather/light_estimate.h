#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/radiosity/gather/receive.h"

namespace radbake::radiosity {

/// Light at one receiver as one pass found it, lx: means of the replicates and the variances of those means.
struct PassLight {
  Vec3 direct, gathered;
  Vec3 direct_variance, gathered_variance;
  Vec3 reflected;  ///< of `gathered` what surfaces reflect
  double openness = 0;
};

/// Mean of independent estimates, and the variance of that mean: sum (x_r - mean)^2 / (k (k - 1)).
struct MeanAndVariance {
  Vec3 mean, variance;
};
MeanAndVariance mean_and_variance(std::span<const Vec3> replicates);

/// Mean of the products of different replicates, averaged over the channels: an estimate of the square of what they
/// estimate, without the square of their noise. May be negative.
double mean_square_without_noise(std::span<const Vec3> replicates);

/// How much the replicates' mean square distances from their mean vary, of the light that all passes gathered: how much
/// such a square varies from one bake to the next.
class ReplicateSpread {
 public:
  /// `squares`: of each replicate, summed over the receivers of one pass; weight as the pass's gathered light.
  void add_pass(double weight, std::span<const double> squares);
  void forget() { weight_ = 0; }
  template <typename Archive>
  void keep(Archive& archive) {
    archive(weight_);
    archive(mean_);
    archive(deviation_);
  }
  /// Standard deviation over mean.
  double relative() const { return mean_ > 0 ? deviation_ / mean_ : 0; }

 private:
  double weight_ = 0, mean_ = 0, deviation_ = 0;
};

/// The light of many receivers (texels of stacked sheets, groups of vertices) as the weighted mean of passes.
///
///   mean = sum w_p x_p / sum w_p        variance = sum w_p^2 v_p / (sum w_p)^2
///
/// Passes are independent of each other. Direct light has weights of its own, by receiver: its number of shadow rays.
/// What is discrete about the estimate is kept by cell: a square of kCell texels a side, or one group of vertices.
/// Memory: 7 floats and a byte a receiver for variances and weights, 6 for the light itself.
class LightEstimate {
 public:
  /// Side of a cell, texels.
  static constexpr int kCell = 4;

  LightEstimate(std::size_t num_receivers, std::size_t num_cells, bool has_reflected, bool has_openness);

  std::size_t size() const { return direct_weight_.size(); }
  std::size_t num_cells() const { return patch_square_.size(); }

  /// Every receiver is added once a pass, or not at all where it is buried: it keeps what other passes found.
  /// `gathered_weight`: of this pass.
  void begin_pass(double gathered_weight) { pass_weight_ = gathered_weight; }
  void add(std::size_t receiver, const PassLight& light, double direct_weight);
  /// What passes so far found of a receiver does not count.
  void forget(std::size_t receiver) {
    direct_weight_[receiver] = 0;
    has_gathered_[receiver] = 0;
  }
  void forget_gathered(std::size_t receiver) { has_gathered_[receiver] = 0; }
  void end_pass() { gathered_weight_ += pass_weight_; }
  /// What passes so far gathered does not count any more.
  void forget_gathered() { gathered_weight_ = 0; }

  Vec3 direct(std::size_t i) const { return at(direct_, i); }
  Vec3 gathered(std::size_t i) const { return at(gathered_, i); }
  Vec3 irradiance(std::size_t i) const { return direct(i) + gathered(i); }
  Vec3 reflected(std::size_t i) const { return at(reflected_, i); }
  double openness(std::size_t i) const { return openness_[i]; }
  Vec3 direct_variance(std::size_t i) const { return at(direct_variance_, i); }
  Vec3 gathered_variance(std::size_t i) const { return at(gathered_variance_, i); }
  double direct_weight(std::size_t i) const { return direct_weight_[i]; }

  /// Squares of what a cell is off by, estimated by one pass, mean of the channels, lx^2: by patches twice as large in
  /// the place of its own, and by interpolation. May be negative.
  void add_to_cell(std::size_t cell, double patch_square, double interpolation_square);
  double patch_square(std::size_t cell) const { return patch_square_[cell]; }
  void forget_interpolation(std::size_t cell) { interpolation_square_[cell] = 0; }
  double interpolation_square(std::size_t cell) const { return interpolation_square_[cell]; }

  /// Between passes.
  template <typename Archive>
  void keep(Archive& archive) {
    archive(gathered_weight_);
    for (auto* values : {&direct_, &gathered_, &reflected_, &openness_, &direct_variance_, &gathered_variance_,
                         &direct_weight_, &patch_square_, &interpolation_square_}) {
      archive.of_known_size(*values);
    }
    archive.of_known_size(has_gathered_);
  }

 private:
  static Vec3 at(const std::vector<float>& values, std::size_t i) {
    return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
  }

  double gathered_weight_ = 0, pass_weight_ = 0;
  std::vector<float> direct_, gathered_, reflected_;        // [size() * 3]; the last one may be empty
  std::vector<float> openness_;                             // [size()], may be empty
  std::vector<float> direct_variance_, gathered_variance_;  // [size() * 3]
  std::vector<float> direct_weight_;                        // [size()]
  std::vector<std::uint8_t> has_gathered_;                  // [size()] whether `gathered_` counts
  std::vector<float> patch_square_, interpolation_square_;  // [num_cells()]
};

}  // namespace radbake::radiosity
