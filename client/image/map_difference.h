#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "client/image/write_image.h"
#include "common/base/result.h"

namespace radbake::image {

/// What is compared. Shapes: pixels of 3 or 4 channels, all of one size; without a fourth, all texels are covered.
struct MapPair {
  const Pixels& reference;
  const Pixels& map;
  double scale = 1;  ///< multiplies the map and its errors: 1/pi where the reference stores irradiance / pi
};

/// Texels of a reference that maps are compared at: covered, and brighter in one channel than a thousandth of the mean,
/// so neither emitters nor what lies sealed under an object.
///
/// Texels with a neighbour that is not so are left out unless `with_edges`: at borders of charts, emitters and
/// footprints bakers differ in what part of a texel they average. Shapes: the result [height * width], 0 or 1.
std::vector<std::uint8_t> comparable_texels(const Pixels& reference, bool with_edges);

/// Signed relative difference of a texel's luminance, its reference taken as at least 2 % of the mean one.
struct TexelDifference {
  int x = 0, y = 0;  ///< from the top left
  double relative = 0;
};

/// How far a map is from its reference, over the texels of a mask.
struct MapDifference {
  std::uint64_t num_texels = 0;
  std::uint64_t num_not_covered = 0;          ///< of those, texels that the map does not cover
  std::array<double, 3> mean{};               ///< of the reference
  double relative_rmse = 0;                   ///< over texels and channels / mean of the reference
  double per_texel = 0;                       ///< root mean square of TexelDifference
  double bias = 0;                            ///< mean difference / mean of the reference
  double p50 = 0, p90 = 0, p95 = 0, p99 = 0;  ///< percentiles of |TexelDifference|
  TexelDifference worst;
};

/// Compares a map with its reference at the texels of a mask.
///
///   relative_rmse = sqrt(mean (x - r)^2) / mean r        d = Y(x - r) / max(Y(r), 0.02 mean Y(r)), Y: luminance
///
/// Shapes: mask [height * width]. Errors: kInvalidArgument: sizes that differ, fewer than 3 channels, a mask without
/// texels, values there that are not finite, a reference without light.
Result<MapDifference> compare_maps(const MapPair& pair, std::span<const std::uint8_t> mask);

/// Differences of the texels of a mask, in their order. Precondition: compare_maps() took them.
std::vector<TexelDifference> texel_differences(const MapPair& pair, std::span<const std::uint8_t> mask);

/// How well stated standard errors agree with the differences, over texels and channels.
struct Calibration {
  double within_95 = 0;           ///< share of |z| <= 1.96, z = difference / standard error
  double standardised_rms = 0;    ///< root mean square of z, where a standard error is stated
  double stated = 0;              ///< root mean square standard error / mean of the reference
  std::uint64_t num_without = 0;  ///< texels whose standard error is 0 in some channel
};

/// The standard errors of map and reference add in quadrature. `reference_error`: null where the reference is exact.
/// Shapes: as of the maps; one channel stands for all. Errors: as compare_maps(); standard errors below 0.
Result<Calibration> calibrate(const MapPair& pair, const Pixels& error, const Pixels* reference_error,
                              std::span<const std::uint8_t> mask);

}  // namespace radbake::image
