#include "client/image/map_difference.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "common/base/check.h"

namespace radbake::image {
namespace {

/// Share of the mean below which a reference texel is dark: an emitter, or sealed under an object.
constexpr double kDark = 1e-3;
/// Share of the mean luminance that a texel's own counts at least: relative errors of what is nearly black say nothing.
constexpr double kLeastShare = 0.02;
/// 95 % of a normal distribution.
constexpr double kWithin95 = 1.96;

double luminance(const std::array<double, 3>& rgb) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }

std::size_t num_texels(const Pixels& pixels) { return std::size_t(pixels.width) * std::size_t(pixels.height); }

bool is_covered(const Pixels& pixels, std::size_t texel) {
  return pixels.channels < 4 || pixels.values[texel * std::size_t(pixels.channels) + 3] > 0;
}

std::array<double, 3> rgb_of(const Pixels& pixels, std::size_t texel, double scale) {
  const float* const value = &pixels.values[texel * std::size_t(pixels.channels)];
  const bool is_grey = pixels.channels < 3;
  return {value[0] * scale, value[is_grey ? 0 : 1] * scale, value[is_grey ? 0 : 2] * scale};
}

std::string size_of(const Pixels& pixels) {
  return std::to_string(pixels.width) + " x " + std::to_string(pixels.height);
}

std::string place_of(const Pixels& pixels, std::size_t texel) {
  return "(" + std::to_string(texel % std::size_t(pixels.width)) + ", " +
         std::to_string(texel / std::size_t(pixels.width)) + ")";
}

Result<void> check_image(const Pixels& pixels, const Pixels& reference, const char* what, int fewest_channels) {
  if (pixels.width != reference.width || pixels.height != reference.height) {
    return invalid_argument(std::string(what) + " has " + size_of(pixels) + " texels and the reference " +
                            size_of(reference));
  }
  if (pixels.channels >= fewest_channels) return {};
  return invalid_argument(std::string(what) + " has " + std::to_string(pixels.channels) +
                          " channels: red, green and blue are compared");
}

/// The texels of a mask, their values finite in an image.
Result<void> check_values(const Pixels& pixels, std::span<const std::uint8_t> mask, const char* what, double smallest) {
  for (std::size_t t = 0; t < mask.size(); ++t) {
    if (!mask[t]) continue;
    for (const double value : rgb_of(pixels, t, 1)) {
      if (std::isfinite(value) && value >= smallest) continue;
      return invalid_argument(std::string(what) + " has the value " + std::to_string(value) + " at " +
                              place_of(pixels, t));
    }
  }
  return {};
}

Result<void> check_pair(const MapPair& pair, std::span<const std::uint8_t> mask) {
  constexpr double kAny = -std::numeric_limits<double>::infinity();
  RADBAKE_RETURN_IF_ERROR(check_image(pair.reference, pair.reference, "the reference", 3));
  RADBAKE_RETURN_IF_ERROR(check_image(pair.map, pair.reference, "the map", 3));
  RADBAKE_CHECK_EQ(mask.size(), num_texels(pair.reference));
  if (std::find_if(mask.begin(), mask.end(), [](std::uint8_t is_in) { return is_in != 0; }) == mask.end()) {
    return invalid_argument("no texel is left to compare");
  }
  RADBAKE_RETURN_IF_ERROR(check_values(pair.reference, mask, "the reference", kAny));
  return check_values(pair.map, mask, "the map", kAny);
}

std::array<double, 3> mean_of(const Pixels& reference, std::span<const std::uint8_t> mask, std::uint64_t& count) {
  std::array<double, 3> sum{};
  count = 0;
  for (std::size_t t = 0; t < mask.size(); ++t) {
    if (!mask[t]) continue;
    const auto r = rgb_of(reference, t, 1);
    for (std::size_t c = 0; c < 3; ++c) sum[c] += r[c];
    ++count;
  }
  for (double& value : sum) value /= static_cast<double>(count);
  return sum;
}

double mean_channel(const std::array<double, 3>& rgb) { return (rgb[0] + rgb[1] + rgb[2]) / 3; }

/// Between the two nearest ranks, linearly: what numpy.percentile does. Shapes: sorted [n], n > 0; share 0..1.
double percentile(const std::vector<double>& sorted, double share) {
  const double rank = share * static_cast<double>(sorted.size() - 1);
  const auto low = static_cast<std::size_t>(rank);
  const std::size_t high = std::min(low + 1, sorted.size() - 1);
  return sorted[low] + (rank - static_cast<double>(low)) * (sorted[high] - sorted[low]);
}

}  // namespace

std::vector<std::uint8_t> comparable_texels(const Pixels& reference, bool with_edges) {
  const std::size_t n = num_texels(reference);
  // max of a texel's channels, of what is covered.
  double sum = 0;
  std::size_t num_covered = 0;
  const auto brightest = [&](std::size_t t) {
    const auto rgb = rgb_of(reference, t, 1);
    return std::max({rgb[0], rgb[1], rgb[2]});
  };
  for (std::size_t t = 0; t < n; ++t) {
    if (!is_covered(reference, t)) continue;
    sum += brightest(t);
    ++num_covered;
  }
  const double dark = kDark * sum / static_cast<double>(std::max<std::size_t>(num_covered, 1));
  std::vector<std::uint8_t> lit(n);
  for (std::size_t t = 0; t < n; ++t) lit[t] = is_covered(reference, t) && brightest(t) > dark;
  if (with_edges) return lit;

  // Keep what is lit with all eight neighbours; beyond the image nothing is.
  std::vector<std::uint8_t> inside(n);
  const auto width = std::size_t(reference.width), height = std::size_t(reference.height);
  for (std::size_t y = 1; y + 1 < height; ++y) {
    for (std::size_t x = 1; x + 1 < width; ++x) {
      bool is_inside = true;
      for (std::size_t j = y - 1; j <= y + 1; ++j) {
        for (std::size_t i = x - 1; i <= x + 1; ++i) is_inside = is_inside && lit[j * width + i];
      }
      inside[y * width + x] = is_inside;
    }
  }
  return inside;
}

std::vector<TexelDifference> texel_differences(const MapPair& pair, std::span<const std::uint8_t> mask) {
  std::uint64_t count = 0;
  const double least = kLeastShare * luminance(mean_of(pair.reference, mask, count));
  std::vector<TexelDifference> differences;
  differences.reserve(count);
  const auto width = std::size_t(pair.reference.width);
  for (std::size_t t = 0; t < mask.size(); ++t) {
    if (!mask[t]) continue;
    const double r = luminance(rgb_of(pair.reference, t, 1)), x = luminance(rgb_of(pair.map, t, pair.scale));
    differences.push_back({int(t % width), int(t / width), (x - r) / std::max(r, least)});
  }
  return differences;
}

Result<MapDifference> compare_maps(const MapPair& pair, std::span<const std::uint8_t> mask) {
  RADBAKE_RETURN_IF_ERROR(check_pair(pair, mask));
  MapDifference result;
  result.mean = mean_of(pair.reference, mask, result.num_texels);
  const double mean = mean_channel(result.mean);
  if (!(mean > 0)) return invalid_argument("the reference has no light where it is compared");

  // Sum over texels and channels.
  double squares = 0, sum = 0;
  for (std::size_t t = 0; t < mask.size(); ++t) {
    if (!mask[t]) continue;
    result.num_not_covered += !is_covered(pair.map, t);
    const auto r = rgb_of(pair.reference, t, 1), x = rgb_of(pair.map, t, pair.scale);
    for (std::size_t c = 0; c < 3; ++c) {
      squares += (x[c] - r[c]) * (x[c] - r[c]);
      sum += x[c] - r[c];
    }
  }
  const double n = 3 * static_cast<double>(result.num_texels);
  result.relative_rmse = std::sqrt(squares / n) / mean;
  result.bias = sum / n / mean;

  // Texel by texel.
  double texel_squares = 0;
  std::vector<double> sorted;
  sorted.reserve(result.num_texels);
  for (const TexelDifference& texel : texel_differences(pair, mask)) {
    texel_squares += texel.relative * texel.relative;
    sorted.push_back(std::fabs(texel.relative));
    if (std::fabs(texel.relative) > std::fabs(result.worst.relative) || sorted.size() == 1) result.worst = texel;
  }
  result.per_texel = std::sqrt(texel_squares / static_cast<double>(result.num_texels));
  std::sort(sorted.begin(), sorted.end());
  result.p50 = percentile(sorted, 0.5);
  result.p90 = percentile(sorted, 0.9);
  result.p95 = percentile(sorted, 0.95);
  result.p99 = percentile(sorted, 0.99);
  return result;
}

Result<Calibration> calibrate(const MapPair& pair, const Pixels& error, const Pixels* reference_error,
                              std::span<const std::uint8_t> mask) {
  RADBAKE_RETURN_IF_ERROR(check_pair(pair, mask));
  RADBAKE_RETURN_IF_ERROR(check_image(error, pair.reference, "the image of standard errors", 1));
  RADBAKE_RETURN_IF_ERROR(check_values(error, mask, "the image of standard errors", 0));
  if (reference_error) {
    RADBAKE_RETURN_IF_ERROR(
        check_image(*reference_error, pair.reference, "the image of the reference's standard errors", 1));
    RADBAKE_RETURN_IF_ERROR(check_values(*reference_error, mask, "the image of the reference's standard errors", 0));
  }
  Calibration result;
  double stated = 0, standardised = 0;
  std::uint64_t count = 0, num_within = 0, num_stated = 0, num_texels = 0;
  for (std::size_t t = 0; t < mask.size(); ++t) {
    if (!mask[t]) continue;
    const auto r = rgb_of(pair.reference, t, 1), x = rgb_of(pair.map, t, pair.scale);
    const auto e = rgb_of(error, t, pair.scale);
    const auto of_reference = reference_error ? rgb_of(*reference_error, t, 1) : std::array<double, 3>{};
    for (std::size_t c = 0; c < 3; ++c) {
      const double variance = e[c] * e[c] + of_reference[c] * of_reference[c];
      const double square = (x[c] - r[c]) * (x[c] - r[c]);
      stated += e[c] * e[c];
      num_within += square <= kWithin95 * kWithin95 * variance;
      ++count;
      if (!(variance > 0)) continue;
      standardised += square / variance;
      ++num_stated;
    }
    result.num_without += std::min({e[0], e[1], e[2]}) == 0;
  }
  const auto share = [](double sum, std::uint64_t n) { return n > 0 ? sum / static_cast<double>(n) : 0; };
  result.within_95 = share(static_cast<double>(num_within), count);
  result.standardised_rms = std::sqrt(share(standardised, num_stated));
  result.stated = std::sqrt(share(stated, count)) / mean_channel(mean_of(pair.reference, mask, num_texels));
  return result;
}

}  // namespace radbake::image
