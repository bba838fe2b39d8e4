#pragma once

#include <vector>

#include "common/base/result.h"
#include "common/geometry/vector.h"

namespace radbake {

/// Luminous intensities of a luminaire by direction, as type C photometry measures them.
///
/// The vertical angle is that to the axis; the horizontal one turns about it, from the zero side towards
/// zero side x axis: counter-clockwise as seen from behind. Between the measured angles intensities are bilinear;
/// beyond the vertical ones there is no light. Shapes: candela [horizontal][vertical]. Source: ANSI/IES LM-63-19, type
/// C.
struct LightProfile {
  std::vector<double> vertical_degrees;  ///< ascending, within [0, 180]
  /// Ascending from 0: all around (to 360), or to 180 or 90 where the rest is a mirror image, or 0 alone where all
  /// directions are alike.
  std::vector<double> horizontal_degrees;
  std::vector<float> candela;  ///< >= 0

  bool operator==(const LightProfile&) const = default;

  /// Intensity, cd. cosine: of the vertical angle; side: the direction's part along the zero side, across: along
  /// zero side x axis.
  double intensity(double cosine, double side, double across) const;
  /// Of the whole luminaire: the integral of the intensity over all directions, lm.
  double lumens() const;
};

/// Most angles of either kind.
inline constexpr std::size_t kMostProfileAngles = 1024;
/// Most intensities: at every degree, both ends of the circle among them.
inline constexpr std::size_t kMostProfileIntensities = std::size_t{181} * 361;

/// Errors: kInvalidArgument, with the numbers and the limit: more intensities than are allowed.
Result<void> check_profile_size(std::size_t num_vertical, std::size_t num_horizontal);

/// Errors: kInvalidArgument, with the value: too few or many angles, not ascending, out of range; intensities that are
/// too many, not as many as pairs of angles, negative or not finite.
Result<void> check_profile(const LightProfile& profile);

}  // namespace radbake
