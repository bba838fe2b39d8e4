#pragma once

#include <string>

#include "common/base/result.h"
#include "common/geometry/vector.h"
#include "common/scene/scene.h"

namespace radbake::cli {

/// "R,G,B": three finite numbers >= 0.
/// Errors: kInvalidArgument names the number.
Result<Vec3> parse_rgb(const std::string& text);

/// "DX,DY,DZ:R,G,B": the direction in which the sun's light travels (not zero; any length) and its illuminance in lx.
/// Errors: kInvalidArgument names the number.
Result<DirectionalLight> parse_sun(const std::string& text);

}  // namespace radbake::cli
