#pragma once

#include <cstdint>
#include <vector>

namespace radbake::radiosity {

/// Points of the unit cube for samples of light: Owen-scrambled Sobol points in columns, from a stock.
///
/// An estimate takes one of up to 64 scrambled sequences and a digital shift of its own, as CosineDirections does:
/// every single point is uniform, runs of a power of two are nets, and estimates of different seeds are independent
/// given the sequences (those that share one differ by independent shifts: they are uncorrelated). Source: Sobol 1967;
/// Owen 1995; Cranley & Patterson 1976 and Matousek 1998 (digital shifts).
class LightPoints {
 public:
  /// Room for the first `size` points of each sequence.
  explicit LightPoints(int size);

  int size() const { return size_; }

  /// The first n points with this seed. Shapes: x, y, z [n]; n <= size(). x, y in [0, 1), of 24 bits; z of 32 bits.
  void fill(std::uint64_t seed, std::size_t n, float* x, float* y, std::uint32_t* z) const;

 private:
  static constexpr int kColumns = 3;

  int size_;
  std::uint64_t num_sequences_;
  std::vector<std::uint32_t> bits_;  ///< [sequences][kColumns][size]
};

}  // namespace radbake::radiosity
