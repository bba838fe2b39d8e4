#include "common/base/sequence.h"

#include "common/base/check.h"

namespace radbake {
namespace {

/// Primitive polynomial (degree, inner coefficients) and first direction numbers of a dimension, Joe & Kuo 2008.
struct Dimension {
  int degree;
  std::uint32_t coefficients;
  std::array<std::uint32_t, 3> first;
};
constexpr std::array<Dimension, SobolPoints::kDimensions - 1> kDimensionTable = {{
    {1, 0, {1, 0, 0}},
    {2, 1, {1, 3, 0}},
    {3, 1, {1, 3, 1}},
    {3, 2, {1, 1, 1}},
}};

using Directions = std::array<std::uint32_t, 32>;

Directions directions_of(int dimension) {
  Directions v{};
  if (dimension == 0) {
    for (int bit = 0; bit < 32; ++bit) v[bit] = 1u << (31 - bit);
    return v;
  }
  const Dimension& d = kDimensionTable[dimension - 1];
  for (int bit = 0; bit < d.degree; ++bit) v[bit] = d.first[bit] << (31 - bit);
  for (int bit = d.degree; bit < 32; ++bit) {
    v[bit] = v[bit - d.degree] ^ (v[bit - d.degree] >> d.degree);
    for (int k = 1; k < d.degree; ++k) {
      if ((d.coefficients >> (d.degree - 1 - k)) & 1u) v[bit] ^= v[bit - k];
    }
  }
  return v;
}

}  // namespace

SobolPoints::SobolPoints(int num_points) {
  RADBAKE_CHECK_LE(1, num_points);
  reversed_.resize(static_cast<std::size_t>(num_points) * kDimensions);
  for (int dimension = 0; dimension < kDimensions; ++dimension) {
    const Directions v = directions_of(dimension);
    for (int i = 0; i < num_points; ++i) {
      std::uint32_t x = 0;
      for (int bit = 0; (i >> bit) != 0; ++bit) {
        if ((i >> bit) & 1) x ^= v[bit];
      }
      reversed_[static_cast<std::size_t>(i) * kDimensions + dimension] = reversed_bits(x);
    }
  }
}

}  // namespace radbake
