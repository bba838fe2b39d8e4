#pragma once

#include <string_view>

#include "common/base/result.h"
#include "common/scene/light_profile.h"

namespace radbake::gltf {

/// Largest file of measured intensities, bytes.
inline constexpr std::size_t kMaxIesBytes = std::size_t{1} << 20;

/// Reads a luminaire's photometric file of type C: its intensities times candela multiplier, ballast factor and, up to
/// the standard of 1995, ballast-lamp photometric factor, as the file's lamps give them. Keywords, tilt, lamps' lumens
/// and the luminous opening's size are skipped. Horizontal angles from 90 to 270 degrees become those all around.
///
/// Errors: kInvalidArgument: no TILT line, a number that is missing or is none, types A and B, too many angles or
/// intensities, such that are out of range, angles that do not ascend.
/// Source: IES LM-63-86, -91 and -95, ANSI/IESNA LM-63-02, ANSI/IES LM-63-19.
Result<LightProfile> read_ies(std::string_view text);

}  // namespace radbake::gltf
