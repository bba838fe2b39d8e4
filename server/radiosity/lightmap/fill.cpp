#include "server/radiosity/lightmap/fill.h"

#include <array>

namespace radbake::radiosity {

FillCounts fill_from_neighbours(std::span<const TexelState> states, int width, int padding, std::span<float> rgba) {
  FillCounts counts;
  const int height = static_cast<int>(states.size() / static_cast<std::size_t>(width));
  std::vector<std::uint8_t> is_known(states.size());
  std::vector<std::size_t> open;  // unknown texels, in rows from the top
  for (std::size_t i = 0; i < states.size(); ++i) {
    is_known[i] = states[i] == TexelState::kValid;
    if (!is_known[i]) open.push_back(i);
  }
  // Each round fills the texels that have a known neighbour, from the values before the round.
  for (int round = 0; !open.empty(); ++round) {
    std::vector<std::size_t> left, filled;
    std::vector<std::array<float, 3>> values;
    for (const std::size_t i : open) {
      if (round >= padding && states[i] == TexelState::kOutside) continue;
      const int x = static_cast<int>(i % width), y = static_cast<int>(i / width);
      std::array<float, 3> sum{};
      int known = 0;
      for (int ny = y - 1; ny <= y + 1; ++ny) {
        for (int nx = x - 1; nx <= x + 1; ++nx) {
          if (nx < 0 || ny < 0 || nx >= width || ny >= height) continue;
          const std::size_t n = static_cast<std::size_t>(ny) * width + nx;
          if (!is_known[n]) continue;
          for (int c = 0; c < 3; ++c) sum[c] += rgba[4 * n + c];
          ++known;
        }
      }
      if (known == 0) {
        left.push_back(i);
        continue;
      }
      for (float& value : sum) value /= static_cast<float>(known);
      filled.push_back(i);
      values.push_back(sum);
    }
    if (filled.empty()) break;
    for (std::size_t k = 0; k < filled.size(); ++k) {
      for (int c = 0; c < 3; ++c) rgba[4 * filled[k] + c] = values[k][c];
      is_known[filled[k]] = 1;
      ++(states[filled[k]] == TexelState::kBuried ? counts.num_filled : counts.num_dilated);
    }
    open = std::move(left);
  }
  return counts;
}

}  // namespace radbake::radiosity
