#include "server/radiosity/lights/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "common/base/check.h"

namespace radbake::radiosity {
namespace {

/// Solid angle of a texel of a row: 2 pi / width (cos of its upper border - cos of its lower one).
double texel_solid_angle(const TexturePlane& image, std::size_t row) {
  const double step = std::numbers::pi / image.height;
  const auto r = static_cast<double>(row);
  return 2 * std::numbers::pi / image.width * (std::cos(r * step) - std::cos((r + 1) * step));
}

/// Where a running sum passes a value: the place, and how far into it.
struct Place {
  std::size_t index;
  double within;  ///< [0, 1)
};
Place place_in(std::span<const double> sums, double wanted) {
  auto at = std::upper_bound(sums.begin(), sums.end(), wanted);
  if (at == sums.end()) --at;
  // A place without power ends where it begins: go back to the last one that has some.
  while (at != sums.begin() && *at <= *(at - 1)) --at;
  const double before = at == sums.begin() ? 0 : *(at - 1);
  return {static_cast<std::size_t>(at - sums.begin()), std::clamp((wanted - before) / (*at - before), 0.0, 1.0)};
}

}  // namespace

Environment::Environment(const TexturePlane& image, Part part) : image_(image), part_(part) {
  RADBAKE_CHECK_EQ(image.channels, 3);
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height);
  double sum = 0;
  for (std::size_t row = 0; row < height; ++row) {
    double of_row = 0;
    for (std::size_t column = 0; column < width; ++column) of_row += max_component(texel(row, column));
    sum += of_row * texel_solid_angle(image, row);
  }
  limit_ = kBright * sum / (4 * std::numbers::pi);

  up_to_row_.reserve(height);
  up_to_column_.reserve(width * height);
  for (std::size_t row = 0; row < height; ++row) {
    const double solid_angle = texel_solid_angle(image, row);
    double of_row = 0;
    for (std::size_t column = 0; column < width; ++column) {
      of_row += max_component(sampled(texel(row, column))) * solid_angle;
      up_to_column_.push_back(of_row);
    }
    up_to_row_.push_back(total_ += of_row);
  }
}

Environment::Sample Environment::sample(double x, double y) const {
  if (is_empty()) return {};
  const auto width = static_cast<std::size_t>(image_.width);
  const Place row = place_in(up_to_row_, y * total_);
  const auto sums = std::span(up_to_column_).subspan(row.index * width, width);
  const Place column = place_in(sums, x * sums.back());

  // Uniform in solid angle within the texel: in the cosine from the pole, and in the angle about it.
  const double step = std::numbers::pi / image_.height;
  const auto r = static_cast<double>(row.index);
  const double top = std::cos(r * step), bottom = std::cos((r + 1) * step);
  const double height = std::clamp(top + (bottom - top) * row.within, -1.0, 1.0);
  const double around =
      2 * std::numbers::pi * ((static_cast<double>(column.index) + column.within) / image_.width - 0.5);
  const double radius = std::sqrt(1 - height * height);

  Sample sample;
  sample.direction = {radius * std::cos(around), height, radius * std::sin(around)};
  sample.luminance = sampled(texel(row.index, column.index));
  sample.density = max_component(sample.luminance) / total_;
  return sample;
}

Vec3 Environment::luminance(Vec3 direction) const {
  const Vec2 at = equirectangular(direction);
  const auto index = [](double share, int size) {
    return static_cast<std::size_t>(std::clamp(share * size, 0.0, size - 1.0));
  };
  return texel(index(at.y, image_.height), index(at.x, image_.width));
}

Vec3 Environment::texel(std::size_t row, std::size_t column) const {
  const float* value = &image_.values[3 * (row * static_cast<std::size_t>(image_.width) + column)];
  return {value[0], value[1], value[2]};
}

Vec3 Environment::dim(Vec3 luminance) const {
  const double largest = max_component(luminance);
  return largest > limit_ ? luminance * (limit_ / largest) : luminance;
}

}  // namespace radbake::radiosity
