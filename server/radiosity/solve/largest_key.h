#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace radbake::radiosity {

/// Which of n numbers is the largest, the smallest index among equals, while some of them change.
///
/// A tournament: each node of a binary tree holds the winner of its two children. Cost: O(n) memory; O(1) to ask;
/// O(min(n, k log n)) to change k numbers.
class LargestKey {
 public:
  /// All keys are 0. Precondition: n > 0.
  explicit LargestKey(std::size_t n);

  std::uint32_t largest() const { return winners_[1]; }
  double key(std::uint32_t i) const { return keys_[i]; }

  /// Preconditions: indices ascending, each below n; keys are not NaN.
  void set(std::span<const std::uint32_t> indices, std::span<const double> keys);

 private:
  std::size_t num_leaves_;
  std::vector<double> keys_;            ///< padded with -infinity
  std::vector<std::uint32_t> winners_;  ///< children of node k: 2k and 2k + 1; leaves: num_leaves_ + i
  std::vector<std::uint32_t> changed_;  ///< nodes of one level
};

}  // namespace radbake::radiosity
