#include "server/radiosity/solve/largest_key.h"

#include <algorithm>

#include "common/base/check.h"

namespace radbake::radiosity {
namespace {

constexpr std::size_t kBlock = 32;
constexpr double kPadding = -1;  // below every key

}  // namespace

LargestKey::LargestKey(std::size_t n)
    : keys_((n + kBlock - 1) / kBlock * kBlock, kPadding), maxima_(keys_.size() / kBlock, 0) {
  RADBAKE_CHECK_LT(std::size_t{0}, n);
  std::fill_n(keys_.begin(), n, 0.0);
}

std::uint32_t LargestKey::largest() const {
  // max_element gives the first of equals.
  const auto block = std::max_element(maxima_.begin(), maxima_.end()) - maxima_.begin();
  const auto first = keys_.begin() + block * static_cast<std::ptrdiff_t>(kBlock);
  const auto found = std::max_element(first, first + static_cast<std::ptrdiff_t>(kBlock));
  return static_cast<std::uint32_t>(found - keys_.begin());
}

void LargestKey::set(std::span<const std::uint32_t> indices, std::span<const double> keys) {
  RADBAKE_CHECK_EQ(indices.size(), keys.size());
  for (std::size_t k = 0; k < indices.size();) {
    const std::size_t block = indices[k] / kBlock;
    for (; k < indices.size() && indices[k] / kBlock == block; ++k) keys_[indices[k]] = keys[k];
    // Four chains, as a maximum has to wait for the one before.
    const double* key = keys_.data() + block * kBlock;
    double best[4] = {key[0], key[1], key[2], key[3]};
    for (std::size_t i = 4; i < kBlock; i += 4) {
      for (std::size_t chain = 0; chain < 4; ++chain) best[chain] = std::max(best[chain], key[i + chain]);
    }
    maxima_[block] = std::max(std::max(best[0], best[1]), std::max(best[2], best[3]));
  }
}

}  // namespace radbake::radiosity
