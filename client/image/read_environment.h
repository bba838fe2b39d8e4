#pragma once

#include <filesystem>

#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::image {

/// Directions of a sky are at most 360 / 1024 = 0.35 degrees wide: finer than the sun, 0.53 degrees.
inline constexpr int kMaxEnvironmentWidth = 1024;

/// Reads a sky of every direction: an equirectangular Radiance .hdr or OpenEXR image, rows from the top (+Y), x
/// scale = luminance in nit. Its numbers are linear light in Rec.709; one channel is grey, opacity is ignored.
///
/// Wider images are reduced to max_width: each pixel becomes the mean over its directions, rows weighted by their solid
/// angle, so that the light of a sun of a few pixels is kept.
///
///   L' = sum w_k L_k / sum w_k,   w of a row from theta_0 to theta_1: cos theta_0 - cos theta_1
///
/// Memory: one band of rows beside the result, whatever the image's size.
/// Precondition: 0 < scale, finite; max_width even, at least 2.
/// Errors: kInvalidArgument, naming the file: not there, neither of the two formats, corrupt, not twice as wide as
/// high, sides above kMaxImageSide, values that are negative or not finite (also after scaling), with their pixel.
Result<TexturePlane> read_environment(const std::filesystem::path& path, double scale,
                                      int max_width = kMaxEnvironmentWidth);

}  // namespace radbake::image
