#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "server/radiosity/gather/gather.h"
#include "server/radiosity/gather/light_estimate.h"

namespace radbake::radiosity {

/// What the light of many receivers is off by: root mean square over those that count and the three channels, over
/// their mean irradiance.
///
///   error^2 = sampling^2 + discretisation^2 + algebraic^2
///
/// sampling: spread of the replicates. discretisation: what patches twice as large would change, times kPatchShare, and
/// what linear interpolation leaves of the second differences between nodes. algebraic: the solver's bound on the
/// patches' light, which no receiver's passes.
/// low, high: 95 % interval of the error that the light has. Its square varies about its expected value as the
/// replicates' squares do about theirs (a Student factor of three degrees of freedom), a twentieth of the sampling
/// error is what all replicates have in common, and the discretisation may be half or twice of what two levels tell.
struct LightError {
  double relative_rmse = 0, low = 0, high = 0;
  double sampling = 0, discretisation = 0, algebraic = 0;
  double direct_sampling = 0, gathered_sampling = 0;  ///< parts of sampling, of the same kind
  double direct_deviation = 0;      ///< of one shadow sample, mean over receivers: more where light is hard to find
  double mean_irradiance = 0;       ///< of the receivers that count, lx
  std::uint64_t num_receivers = 0;  ///< that count
};

/// Of what patches twice as large would change, the share that those of the size at hand are off by: 1/3 where errors
/// go with the square of the size, 1 where they go with the size. Strips of one patch across cannot be told twice as
/// large: measured in a hall with deep windows (`tests/scenes/make_interior.py --small`), the share is 0.9.
inline constexpr double kPatchShare = 0.75;

/// `counts`: whether a receiver does. `algebraic_bound`: lx.
LightError estimate_error(const LightEstimate& estimate, const std::function<bool(std::size_t)>& counts,
                          const std::function<std::size_t(std::size_t)>& cell_of, double algebraic_bound,
                          double spread);
LightError estimate_error(const LightmapGather& gather, double algebraic_bound);

/// Standard error of each texel, discretisation in quadrature, lx: the variances of neighbouring texels are pooled, as
/// four replicates by themselves tell little. Shapes: rgba [texels * 4], coverage last; it is 0 where a texel does not
/// count: not valid, or an emitter.
std::vector<float> standard_errors(const LightmapGather& gather);

/// Where the hundredth of the texels that count with the largest standard errors is.
struct WorstPlace {
  double error = 0;  ///< root mean square of them over the mean irradiance of all
  std::size_t texel = 0;
};
WorstPlace find_worst(const LightmapGather& gather, const std::vector<float>& standard_errors, double mean_irradiance);

/// log2 of the shadow rays that each replicate should spend on each texel so that `mean_samples` of all replicates buy
/// the least error: by the standard deviation of one sample (Neyman 1934). Shapes: [texels].
std::vector<std::uint8_t> light_levels(const LightmapGather& gather, int mean_samples, int most_samples);

}  // namespace radbake::radiosity
