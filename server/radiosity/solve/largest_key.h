#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace radbake::radiosity {

/// Which of n numbers is the largest, the smallest index among equals, while many of them change at a time.
///
/// Blocks of 32 neighbours keep their maxima, so what did not change is looked at a block at a time. A tree would do
/// better for a few changes; a column of form factors touches nearly every block.
/// Cost: O(n / 32) to ask; O(32 k), at most O(n), to change k numbers.
class LargestKey {
 public:
  /// All keys are 0. Precondition: n > 0.
  explicit LargestKey(std::size_t n);

  std::uint32_t largest() const;
  double key(std::uint32_t i) const { return keys_[i]; }

  /// Fastest where indices ascend. Preconditions: each below n, none twice; keys >= 0, not NaN.
  void set(std::span<const std::uint32_t> indices, std::span<const double> keys);

 private:
  std::vector<double> keys_;  ///< padded with -1 to whole blocks
  std::vector<double> maxima_;
};

}  // namespace radbake::radiosity
