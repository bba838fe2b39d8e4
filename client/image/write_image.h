#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace radbake::image {

/// Writes float32 EXR with zip compression: scene-linear Rec.709, values in lx (in the metadata).
/// The bytes depend on the arguments alone. The file appears whole or not at all, also after a power
/// loss: written aside, brought to the disk and renamed.
///
/// Shapes: values [height * width * channels], rows from the top; channels 1 to 4: R, G, B, A.
/// Errors: kInternal if it cannot be written; kInvalidArgument if values have another size.
Result<void> write_exr(const std::filesystem::path& path, int width, int height, int channels,
                       std::span<const float> values);

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

/// Pixels of an image file. Shapes: values [height * width * channels], rows from the top.
struct Pixels {
  int width = 0, height = 0, channels = 0;
  std::vector<float> values;
};

/// Reads what write_exr wrote. Errors: kInvalidArgument, naming the file.
Result<Pixels> read_exr(const std::filesystem::path& path);

}  // namespace radbake::image
