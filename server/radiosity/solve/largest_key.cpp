#include "server/radiosity/solve/largest_key.h"

#include <bit>
#include <limits>

#include "common/base/check.h"

namespace radbake::radiosity {

LargestKey::LargestKey(std::size_t n)
    : num_leaves_(std::bit_ceil(n)),
      keys_(num_leaves_, -std::numeric_limits<double>::infinity()),
      winners_(2 * num_leaves_, 0) {
  RADBAKE_CHECK_LT(std::size_t{0}, n);
  for (std::size_t i = 0; i < n; ++i) keys_[i] = 0;
  for (std::size_t i = 0; i < num_leaves_; ++i) winners_[num_leaves_ + i] = static_cast<std::uint32_t>(i);
  for (std::size_t node = num_leaves_ - 1; node > 0; --node) winners_[node] = winners_[2 * node];
}

void LargestKey::set(std::span<const std::uint32_t> indices, std::span<const double> keys) {
  RADBAKE_CHECK_EQ(indices.size(), keys.size());
  changed_.clear();
  for (std::size_t k = 0; k < indices.size(); ++k) {
    keys_[indices[k]] = keys[k];
    changed_.push_back(static_cast<std::uint32_t>(num_leaves_ + indices[k]));
  }
  // Level by level towards the root; neighbours share a parent, which is played once.
  while (!changed_.empty() && changed_.front() > 1) {
    std::size_t num_parents = 0;
    for (const std::uint32_t node : changed_) {
      const std::uint32_t parent = node / 2;
      if (num_parents > 0 && changed_[num_parents - 1] == parent) continue;
      const std::uint32_t left = winners_[2 * parent], right = winners_[2 * parent + 1];
      winners_[parent] = keys_[left] >= keys_[right] ? left : right;
      changed_[num_parents++] = parent;
    }
    changed_.resize(num_parents);
  }
}

}  // namespace radbake::radiosity
