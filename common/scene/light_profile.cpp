#include "common/scene/light_profile.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <string>

namespace radbake {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Where a value lies among ascending ones: of the interval [at, at + 1] the share beyond `at`.
struct Place {
  std::size_t at = 0;
  double share = 0;
};
Place place_of(const std::vector<double>& values, double value) {
  if (values.size() < 2) return {};
  const auto above = std::upper_bound(values.begin(), values.end(), value);
  const auto next =
      std::clamp<std::ptrdiff_t>(above - values.begin(), 1, static_cast<std::ptrdiff_t>(values.size()) - 1);
  const auto at = static_cast<std::size_t>(next - 1);
  return {at, std::clamp((value - values[at]) / (values[at + 1] - values[at]), 0.0, 1.0)};
}

/// The horizontal angle within what was measured. degrees: in [0, 360].
double folded(double degrees, double last) {
  if (last <= 0) return 0;
  if (last <= 180 && degrees > 180) degrees = 360 - degrees;
  if (last <= 90 && degrees > 90) degrees = 180 - degrees;
  return degrees;
}

std::string in_words(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

Result<void> check_angles(const std::vector<double>& angles, const std::string& name, double most) {
  if (angles.empty() || angles.size() > kMostProfileAngles) {
    return invalid_argument("it has " + std::to_string(angles.size()) + " " + name + " angles: must be 1 to " +
                            std::to_string(kMostProfileAngles));
  }
  for (std::size_t k = 0; k < angles.size(); ++k) {
    if (!(angles[k] >= 0 && angles[k] <= most)) {
      return invalid_argument(name + " angle " + in_words(angles[k]) + " is not within 0 to " + in_words(most));
    }
    if (k > 0 && angles[k] <= angles[k - 1]) {
      return invalid_argument(name + " angle " + in_words(angles[k]) + " comes after " + in_words(angles[k - 1]) +
                              ": they must ascend");
    }
  }
  return {};
}

}  // namespace

double LightProfile::intensity(double cosine, double side, double across) const {
  const double vertical = std::acos(std::clamp(cosine, -1.0, 1.0)) / kDegree;
  // Angles of files are decimal numbers.
  constexpr double kRounding = 1e-9;
  if (vertical < vertical_degrees.front() - kRounding || vertical > vertical_degrees.back() + kRounding) return 0;
  double horizontal = std::atan2(across, side) / kDegree;
  if (horizontal < 0) horizontal += 360;
  const Place v = place_of(vertical_degrees, vertical);
  const Place h = place_of(horizontal_degrees, folded(horizontal, horizontal_degrees.back()));
  const std::size_t num = vertical_degrees.size();
  const auto along = [&](std::size_t row) {
    const float* values = &candela[row * num];
    if (num == 1) return static_cast<double>(values[0]);
    return values[v.at] + (static_cast<double>(values[v.at + 1]) - values[v.at]) * v.share;
  };
  const double first = along(h.at);
  return horizontal_degrees.size() == 1 ? first : first + (along(h.at + 1) - first) * h.share;
}

double LightProfile::lumens() const {
  // int I sin(v) dv dh: over the vertical angles exact for I linear in the angle, over the horizontal ones by
  // trapezoids, exact as well.
  const std::size_t num = vertical_degrees.size();
  std::vector<double> zonal(horizontal_degrees.size(), 0);
  for (std::size_t h = 0; h < zonal.size(); ++h) {
    for (std::size_t k = 0; k + 1 < num; ++k) {
      const double a = vertical_degrees[k] * kDegree, b = vertical_degrees[k + 1] * kDegree;
      const double low = candela[h * num + k], slope = (candela[h * num + k + 1] - low) / (b - a);
      // int (low + slope (v - a)) sin v dv = [-(low + slope (v - a)) cos v + slope sin v]
      zonal[h] += low * std::cos(a) - (low + slope * (b - a)) * std::cos(b) + slope * (std::sin(b) - std::sin(a));
    }
  }
  if (zonal.size() == 1) return 2 * std::numbers::pi * zonal[0];
  double sum = 0;
  for (std::size_t h = 0; h + 1 < zonal.size(); ++h) {
    sum += (zonal[h] + zonal[h + 1]) / 2 * (horizontal_degrees[h + 1] - horizontal_degrees[h]) * kDegree;
  }
  return sum * 360 / horizontal_degrees.back();
}

Result<void> check_profile_size(std::size_t num_vertical, std::size_t num_horizontal) {
  if (num_horizontal == 0 || num_vertical <= kMostProfileIntensities / num_horizontal) return {};
  return invalid_argument("it has " + std::to_string(num_vertical) + " vertical x " + std::to_string(num_horizontal) +
                          " horizontal angles: at most " + std::to_string(kMostProfileIntensities) +
                          " intensities are read");
}

Result<void> check_profile(const LightProfile& profile) {
  RADBAKE_RETURN_IF_ERROR(check_angles(profile.vertical_degrees, "vertical", 180));
  RADBAKE_RETURN_IF_ERROR(check_angles(profile.horizontal_degrees, "horizontal", 360));
  RADBAKE_RETURN_IF_ERROR(check_profile_size(profile.vertical_degrees.size(), profile.horizontal_degrees.size()));
  const double first = profile.horizontal_degrees.front(), last = profile.horizontal_degrees.back();
  const bool is_whole =
      profile.horizontal_degrees.size() == 1 ? first == 0 : first == 0 && (last == 90 || last == 180 || last == 360);
  if (!is_whole) {
    return invalid_argument("its horizontal angles go from " + in_words(first) + " to " + in_words(last) +
                            ": must be 0 alone, or 0 to 90, 180 or 360");
  }
  const std::size_t num = profile.vertical_degrees.size() * profile.horizontal_degrees.size();
  if (profile.candela.size() != num) {
    return invalid_argument("it has " + std::to_string(profile.candela.size()) + " intensities for " +
                            std::to_string(num) + " pairs of angles");
  }
  for (const float value : profile.candela) {
    if (!(value >= 0) || !std::isfinite(value)) {
      return invalid_argument("intensity " + in_words(value) + " cd is not within [0, inf)");
    }
  }
  return {};
}

}  // namespace radbake
