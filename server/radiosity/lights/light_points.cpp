#include "server/radiosity/lights/light_points.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/sequence.h"

namespace radbake::radiosity {
namespace {

constexpr std::uint64_t kMostSequences = 64;
/// Numbers of all sequences together: where there are many points there are fewer sequences.
constexpr std::uint64_t kMostNumbers = std::uint64_t{1} << 20;

}  // namespace

LightPoints::LightPoints(int size)
    : size_(size),
      num_sequences_(
          std::clamp<std::uint64_t>(kMostNumbers / (kColumns * static_cast<std::uint64_t>(size)), 1, kMostSequences)) {
  const SobolPoints points(size);
  bits_.reserve(num_sequences_ * kColumns * static_cast<std::uint64_t>(size));
  for (std::uint64_t sequence = 0; sequence < num_sequences_; ++sequence) {
    for (int column = 0; column < kColumns; ++column) {
      for (int k = 0; k < size; ++k) bits_.push_back(points.bits(k, column, mixed_bits(sequence)));
    }
  }
}

void LightPoints::fill(std::uint64_t seed, std::size_t n, float* x, float* y, std::uint32_t* z) const {
  RADBAKE_CHECK_LE(n, static_cast<std::size_t>(size_));
  const std::uint64_t shift = mixed_bits(seed), further = mixed_bits(shift);
  const auto shift_x = static_cast<std::uint32_t>(shift), shift_y = static_cast<std::uint32_t>(shift >> 32);
  const auto shift_z = static_cast<std::uint32_t>(further);
  const auto stride = static_cast<std::size_t>(size_);
  const std::uint32_t* bits_x = bits_.data() + (further >> 32) % num_sequences_ * kColumns * stride;
  const std::uint32_t *bits_y = bits_x + stride, *bits_z = bits_y + stride;
  const auto unit = [](std::uint32_t bits) {
    return static_cast<float>(static_cast<std::int32_t>(bits >> 8)) * 0x1p-24f;
  };
  for (std::size_t k = 0; k < n; ++k) {
    x[k] = unit(bits_x[k] ^ shift_x);
    y[k] = unit(bits_y[k] ^ shift_y);
    z[k] = bits_z[k] ^ shift_z;
  }
}

}  // namespace radbake::radiosity
