#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/base/result.h"
#include "common/geometry/vector.h"
#include "common/scene/scene.h"

namespace radbake::options {

/// "R,G,B": three finite numbers >= 0.
/// Errors: kInvalidArgument names the number.
Result<Vec3> parse_rgb(const std::string& text);

/// Angular diameter of the sun as it is seen from here, degrees.
inline constexpr double kSunDegrees = 0.53;

/// "DX,DY,DZ:R,G,B[:DEGREES]": the direction in which the sun's light travels (not zero; any length), its illuminance
/// in lx, and the angular diameter of its disc, at least 0 and below 180; kSunDegrees where there is none.
/// Errors: kInvalidArgument names the number.
Result<DirectionalLight> parse_sun(const std::string& text);

/// A sky from an image.
struct SkyImage {
  std::filesystem::path file;
  double scale = 1;  ///< of the image's values to nit
};

/// "FILE[:SCALE]": what follows the last colon is the scale if it is a number.
/// Errors: kInvalidArgument for no file, or a scale that is not positive and finite.
Result<SkyImage> parse_sky_image(const std::string& text);

/// "N", "NK", "NM" or "NG": bytes, 1024 a step; at least 1K.
/// Errors: kInvalidArgument names the value.
Result<std::uint64_t> parse_bytes(const std::string& text);

/// "N%" or a fraction: above 0 and below 1. Returns the fraction.
/// Errors: kInvalidArgument names the value.
Result<double> parse_share(const std::string& text);

/// "N" or "Ns" (seconds), "Nms", "Nm" (minutes), "Nh": milliseconds, from 1 to 30 days.
/// Errors: kInvalidArgument names the value.
Result<std::uint64_t> parse_milliseconds(const std::string& text);

}  // namespace radbake::options
