#include "server/radiosity/form_factor/cosine_directions.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/sequence.h"

namespace radbake::radiosity {
namespace {

constexpr std::uint64_t kMostSequences = 64;
/// Numbers of all sequences together: where rows have many rays there are fewer.
constexpr std::uint64_t kMostNumbers = std::uint64_t{1} << 21;

/// Two numbers in [-1, 1) of 32 bits each.
inline float signed_unit(std::uint32_t bits) { return static_cast<float>(static_cast<std::int32_t>(bits)) * 0x1p-31f; }

/// sin and cos of t pi/4, |t| <= 1, by their series: to 1e-7.
inline float sin_eighth(float t) {
  const float a = t * static_cast<float>(std::numbers::pi / 4), s = a * a;
  return a * (1 - s / 6 * (1 - s / 20 * (1 - s / 42 * (1 - s / 72))));
}
inline float cos_eighth(float t) {
  const float a = t * static_cast<float>(std::numbers::pi / 4), s = a * a;
  return 1 - s / 2 * (1 - s / 12 * (1 - s / 30 * (1 - s / 56 * (1 - s / 90))));
}

}  // namespace

CosineDirections::CosineDirections(int num_directions)
    : size_(num_directions),
      num_sequences_(std::clamp<std::uint64_t>(kMostNumbers / (2 * static_cast<std::uint64_t>(num_directions)), 1,
                                               kMostSequences)) {
  const SobolPoints points(num_directions);
  bits_.reserve(num_sequences_ * 2 * static_cast<std::uint64_t>(size_));
  for (std::uint64_t sequence = 0; sequence < num_sequences_; ++sequence) {
    for (int dimension = 0; dimension < 2; ++dimension) {
      for (int k = 0; k < size_; ++k) bits_.push_back(points.bits(k, dimension, mixed_bits(sequence)));
    }
  }
}

void CosineDirections::fill(std::uint64_t seed, Row& row) const {
  const auto n = static_cast<std::size_t>(size_);
  row.x.resize(n);
  row.y.resize(n);
  row.z.resize(n);
  const std::uint64_t shift = mixed_bits(seed);
  const auto shift_x = static_cast<std::uint32_t>(shift), shift_y = static_cast<std::uint32_t>(shift >> 32);
  const std::uint32_t* bits_x = bits_.data() + mixed_bits(shift) % num_sequences_ * 2 * n;
  const std::uint32_t* bits_y = bits_x + n;
  float* __restrict x = row.x.data(), * __restrict y = row.y.data(), * __restrict z = row.z.data();
  for (std::size_t k = 0; k < n; ++k) {
    // The square's larger coordinate is the radius, the ratio of the two the angle from its axis.
    const float a = signed_unit(bits_x[k] ^ shift_x), b = signed_unit(bits_y[k] ^ shift_y);
    const bool a_is_larger = std::fabs(a) > std::fabs(b);
    const float radius = a_is_larger ? a : b, other = a_is_larger ? b : a;
    const float t = other / (radius == 0 ? 1.0f : radius);
    const float along = radius * cos_eighth(t), across = radius * sin_eighth(t);
    x[k] = a_is_larger ? along : across;
    y[k] = a_is_larger ? across : along;
    z[k] = std::sqrt(std::max(0.0f, 1 - radius * radius));
  }
}

}  // namespace radbake::radiosity
