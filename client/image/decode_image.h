#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::image {

/// A bake sees textures through patches and texels far coarser than this.
inline constexpr int kDefaultMaxSide = 512;
/// Widest and highest image that is decoded.
inline constexpr int kMaxImageSide = 16384;

/// Decodes a PNG or JPEG file to a plane of three channels, or four with opacity, in linear light.
///
/// With is_srgb, colours go from sRGB to linear light (opacity never). Larger images are then reduced, in linear light
/// and by the mean over each texel's area, so that no side exceeds max_side. Colours are not weighted by opacity.
/// Memory: one band of rows beside the result, whatever the image's size.
///
/// Errors: kInvalidArgument: neither PNG nor JPEG (what glTF allows), sides above kMaxImageSide, corrupt.
/// Source: IEC 61966-2-1 (sRGB).
Result<TexturePlane> decode_image(std::span<const std::byte> bytes, const std::string& name, bool is_srgb,
                                  int max_side = kDefaultMaxSide);

}  // namespace radbake::image
