#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace radbake {

/// 64 well-mixed bits of 64 bits. Source: Steele, Lea & Flood 2014, SplitMix64's finaliser.
constexpr std::uint64_t mixed_bits(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// The seed of one row, texel or light estimate: of what it is, never of the thread that computes it.
constexpr std::uint64_t seed_of(std::uint64_t seed, std::uint64_t purpose, std::uint64_t index) {
  return mixed_bits(mixed_bits(mixed_bits(seed) ^ purpose) ^ index);
}

/// 32 bits in reverse order.
constexpr std::uint32_t reversed_bits(std::uint32_t x) {
  x = ((x >> 1) & 0x55555555u) | ((x & 0x55555555u) << 1);
  x = ((x >> 2) & 0x33333333u) | ((x & 0x33333333u) << 2);
  x = ((x >> 4) & 0x0f0f0f0fu) | ((x & 0x0f0f0f0fu) << 4);
  x = ((x >> 8) & 0x00ff00ffu) | ((x & 0x00ff00ffu) << 8);
  return (x >> 16) | (x << 16);
}

/// The first points of a Sobol sequence in up to kDimensions dimensions, to be scrambled by each user.
///
/// point(i, seed) is an Owen-scrambled Sobol point: any power-of-two run of indices that starts at a multiple of its
/// length is a net, every single point is uniform, and points of different seeds are independent.
/// Shapes: one point is kDimensions numbers in [0, 1).
/// Source: Sobol 1967 with the direction numbers of Joe & Kuo 2008; Owen 1995 by the hash of Laine & Karras 2011 with
/// the constants of Burley 2020.
class SobolPoints {
 public:
  static constexpr int kDimensions = 5;

  explicit SobolPoints(int num_points);

  int size() const { return static_cast<int>(reversed_.size()) / kDimensions; }

  /// Coordinate `dimension` of point i, scrambled by a seed. 32 bits; coordinates of one seed are scrambled apart.
  std::uint32_t bits(int i, int dimension, std::uint64_t seed) const {
    const std::uint64_t own = mixed_bits(seed + static_cast<std::uint64_t>(dimension));
    return scrambled(reversed_[static_cast<std::size_t>(i) * kDimensions + dimension], static_cast<std::uint32_t>(own));
  }

  /// Scrambling seeds of all coordinates: computed once a row, then point(i, seeds).
  using Seeds = std::array<std::uint32_t, kDimensions>;
  static Seeds seeds_of(std::uint64_t seed) {
    Seeds seeds{};
    for (int d = 0; d < kDimensions; ++d) {
      seeds[d] = static_cast<std::uint32_t>(mixed_bits(seed + static_cast<std::uint64_t>(d)));
    }
    return seeds;
  }
  double coordinate(int i, int dimension, const Seeds& seeds) const {
    const std::size_t at = static_cast<std::size_t>(i) * kDimensions + dimension;
    return scrambled(reversed_[at], seeds[dimension]) * 0x1p-32;
  }

 private:
  /// Nested uniform scramble of bits that are stored in reverse: each bit is flipped by a hash of those above it.
  static std::uint32_t scrambled(std::uint32_t reversed, std::uint32_t seed) {
    std::uint32_t x = reversed + seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return reversed_bits(x);
  }

  std::vector<std::uint32_t> reversed_;  ///< [num_points * kDimensions], bits in reverse
};

}  // namespace radbake
