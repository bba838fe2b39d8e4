#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "client/image/map_difference.h"

namespace radbake::image {

/// A picture for the eye: 8 bits a channel, red, green, blue, sRGB. Shapes: rgb [height * width * 3], rows from the
/// top.
struct Picture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

/// Where a map is brighter (red) and darker (blue) than its reference.
struct DifferencePicture {
  Picture picture;
  double limit = 0;  ///< the relative difference of the full colours; larger ones have them too
};

/// Draws TexelDifference of each texel of a mask, white where there is none; what is not compared is dark grey.
///
/// The limit is the 99th percentile of |difference|, up to the next of 1, 2, 5 x 10^k. Maps narrower than 512 texels
/// are enlarged by whole texels. Below the map stands the scale with its two ends, in percent. Precondition:
/// compare_maps() took the pair and the mask.
DifferencePicture draw_difference(const MapPair& pair, std::span<const std::uint8_t> mask);

}  // namespace radbake::image
