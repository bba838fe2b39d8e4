#pragma once

#include <cstdint>
#include <vector>

namespace radbake::radiosity {

/// Cosine-distributed directions about +z, the same number for each row.
///
/// A row takes one of up to 64 Owen-scrambled Sobol sequences and a digital shift of its own: every single direction
/// has the cosine distribution, runs of a power of two are nets, and rows are independent but for the sequence they
/// share with one in 64. Far cheaper than a scramble a row, and written so that compilers make vector code of it.
/// Source: Sobol 1967; Owen 1995; Cranley & Patterson 1976 and Matousek 1998 (digital shifts); Shirley & Chiu 1997
/// (from
///         the square to the disk, strata stay compact); Malley's method (from the disk to the hemisphere).
class CosineDirections {
 public:
  explicit CosineDirections(int num_directions);

  int size() const { return size_; }

  struct Row {
    std::vector<float> x, y, z;  ///< [size()], of unit length to single precision
  };
  /// The directions of the row with this seed. Replaces what `row` holds.
  void fill(std::uint64_t seed, Row& row) const;

 private:
  int size_;
  std::uint64_t num_sequences_;
  std::vector<std::uint32_t> bits_;  ///< [sequences][2][size]
};

}  // namespace radbake::radiosity
