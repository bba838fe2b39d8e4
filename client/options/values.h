#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"
#include "common/geometry/vector.h"
#include "common/scene/scene.h"

namespace radbake::options {

/// "R,G,B": three finite numbers >= 0.
/// Errors: kInvalidArgument names the number.
Result<Vec3> parse_rgb(const std::string& text);

/// "DX,DY,DZ:R,G,B": the direction in which the sun's light travels (not zero; any length) and its illuminance in lx.
/// Errors: kInvalidArgument names the number.
Result<DirectionalLight> parse_sun(const std::string& text);

/// "N", "NK", "NM" or "NG": bytes, 1024 a step; at least 1K.
/// Errors: kInvalidArgument names the value.
Result<std::uint64_t> parse_bytes(const std::string& text);

}  // namespace radbake::options
