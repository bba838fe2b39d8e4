#pragma once

#include <string>

#include "common/base/result.h"
#include "common/scene/scene.h"
#include "radbake/v1/scene.pb.h"

namespace radbake {

/// The blob of a texture: its values as they lie in memory.
///
/// Errors: kInvalidArgument when the number of values is not width * height * channels.
Result<std::string> encode_texture(const TexturePlane& plane);

/// A texture's record but for the digest.
v1::Texture to_proto(const TexturePlane& plane);

/// Checks what a record declares: a size within the limit of pixels, 3 or 4 channels, and a blob of just that size.
Result<void> check_texture(const v1::Texture& texture, std::uint64_t max_pixels);

/// Reads a blob whose record was checked. Values must be finite and not negative.
Result<TexturePlane> decode_texture(const std::string& blob, const v1::Texture& texture);

/// The blob of a sky of every direction, float32 x 3.
///
/// Errors: kInvalidArgument when it has not 3 channels, is not twice as wide as high, or its values are not as many.
Result<std::string> encode_environment(const TexturePlane& plane);

/// A sky's record but for the digest.
v1::Environment environment_to_proto(const TexturePlane& plane);

/// As check_texture(); its width must be twice its height.
Result<void> check_environment(const v1::Environment& environment, std::uint64_t max_pixels);

/// Reads a blob whose record was checked. Values must be finite and not negative.
Result<TexturePlane> decode_environment(const std::string& blob, const v1::Environment& environment);

}  // namespace radbake
