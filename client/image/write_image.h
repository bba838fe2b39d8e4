#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace radbake::image {

/// Writes float32 EXR with zip compression: scene-linear Rec.709, values in `unit` (in the metadata).
/// The bytes depend on the arguments alone. The file appears whole or not at all, also after a power
/// loss: written aside, brought to the disk and renamed.
///
/// Shapes: values [height * width * channels], rows from the top; channels 1 to 4: R, G, B, A.
/// Errors: kInternal if it cannot be written; kInvalidArgument if values have another size.
Result<void> write_exr(const std::filesystem::path& path, int width, int height, int channels,
                       std::span<const float> values, const std::string& unit = "lx");

/// Writes a preview for the eye: PNG, 8 bits, opaque.
///
///   L = luminance / (95th percentile of the luminance of covered texels)     L' = L (1 + L / 16) / (1 + L)
/// so the percentile comes out at 53 % (75 % after sRGB's curve) and four times that at white. Texels that are not
/// covered (A = 0) do not count. Without an alpha channel all are covered.
///
/// Shapes: as write_exr, channels 3 or 4. Errors: as write_exr.
/// Source: Reinhard et al. 2002, eq. 4, with L_white = 4.
Result<void> write_preview_png(const std::filesystem::path& path, int width, int height, int channels,
                               std::span<const float> values);

/// Writes the first three channels as Radiance HDR (RGBE): 8 bits a channel and a shared exponent, within 1 % of each
/// texel's brightest channel. Linear Rec.709, lx. Values that are negative or not finite become 0.
///
/// Shapes: as write_exr, channels 3 or 4. Errors: as write_exr.
/// Source: Ward 1991, "Real pixels".
Result<void> write_hdr(const std::filesystem::path& path, int width, int height, int channels,
                       std::span<const float> values);

/// Writes the first three channels as RGBM in a PNG of 8 bits a channel, linear:
///
///   lx = (R, G, B) / 255 * A / 255 * multiplier
///
/// A is the smallest that holds the brightest channel, so colours keep 8 bits down to 1/255 of the multiplier.
/// Values above the multiplier become it; those that are negative or not finite become 0.
/// Shapes: as write_exr, channels 3 or 4. Errors: as write_exr. Precondition: multiplier > 0.
Result<void> write_rgbm_png(const std::filesystem::path& path, int width, int height, int channels,
                            std::span<const float> values, double multiplier);

/// The first three channels over `intensity`, as a PNG of 16 bits a channel in memory: linear, and without a chunk that
/// would make a reader convert it. Values above the intensity become it; those that are negative or not finite, 0.
///
/// Shapes: as write_exr, channels 3 or 4. Errors: as write_exr. Precondition: intensity > 0.
Result<std::string> encode_linear_png(int width, int height, int channels, std::span<const float> values,
                                      double intensity);

/// Writes a picture as it is: PNG, 8 bits, opaque.
/// Shapes: rgb [height * width * 3], sRGB, rows from the top. Errors: as write_exr.
Result<void> write_png(const std::filesystem::path& path, int width, int height, std::span<const std::uint8_t> rgb);

/// Pixels of an image file. Shapes: values [height * width * channels], rows from the top.
struct Pixels {
  int width = 0, height = 0, channels = 0;
  std::vector<float> values;
};

/// Reads what write_exr wrote. Errors: kInvalidArgument, naming the file.
Result<Pixels> read_exr(const std::filesystem::path& path);

}  // namespace radbake::image
