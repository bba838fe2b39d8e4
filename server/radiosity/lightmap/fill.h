#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace radbake::radiosity {

enum class TexelState : std::uint8_t {
  kOutside,  ///< in no chart
  kValid,    ///< measured
  kBuried,   ///< in a chart, but mostly inside other geometry
};

struct FillCounts {
  std::uint64_t num_filled = 0;   ///< buried texels that took their neighbours' mean
  std::uint64_t num_dilated = 0;  ///< texels outside charts that did
};

/// Gives buried texels, and those outside within `padding` of a chart, the mean of their valid neighbours, ring by
/// ring, so that bilinear look-ups at borders meet no black. Coverage (the fourth channel) stays as it is.
/// Shapes: one sheet: states [height * width]; rgba [height * width * 4].
FillCounts fill_from_neighbours(std::span<const TexelState> states, int width, int padding, std::span<float> rgba);

}  // namespace radbake::radiosity
