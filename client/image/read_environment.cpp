#include "client/image/read_environment.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "client/image/box_reduction.h"
#include "client/image/decode_image.h"
#include "client/image/oiio_setup.h"
#include "common/base/check.h"

namespace radbake::image {
namespace {

namespace fs = std::filesystem;

// Values of one band while it is read.
constexpr int kBandValues = 1 << 22;
// Luminance, nit, of a pixel at most: sums over 16384 x 8192 of them stay within float32. The sun has 1.6e9.
constexpr double kMaxLuminance = 1e30;

/// OpenImageIO's name of a file's format, by its first bytes: the readers of other formats never see it.
Result<const char*> format_of(const fs::path& path) {
  if (fs::is_directory(path)) return invalid_argument("it is a folder");
  std::ifstream file(path, std::ios::binary);
  if (!file) return invalid_argument(fs::exists(path) ? "it cannot be read" : "there is no such file");
  std::string head(4, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (head == "\x76\x2f\x31\x01") return "openexr";
  if (head.compare(0, 2, "#?") == 0) return "hdr";
  return invalid_argument("neither a Radiance .hdr nor an OpenEXR image");
}

Result<void> check_shape(const OIIO::ImageSpec& spec) {
  const std::string size = std::to_string(spec.width) + " x " + std::to_string(spec.height);
  if (spec.width > kMaxImageSide || spec.height > kMaxImageSide) {
    return invalid_argument("its size of " + size + " is above the limit of " + std::to_string(kMaxImageSide) +
                            " a side");
  }
  if (spec.deep || spec.depth != 1 || spec.nchannels < 1) return invalid_argument("it is no flat image");
  if (spec.width != spec.full_width || spec.height != spec.full_height) {
    return invalid_argument("it is cropped: " + size + " pixels of " + std::to_string(spec.full_width) + " x " +
                            std::to_string(spec.full_height));
  }
  if (spec.width == 2 * spec.height) return {};
  return invalid_argument("it is " + size +
                          " pixels: an equirectangular image of all directions is twice as wide as high");
}

Error no_light(float value, double scale, int x, int y) {
  std::ostringstream text;
  text << "it has the value " << value << " at pixel (" << x << ", " << y << ")";
  if (scale != 1) text << ", to be scaled by " << scale;
  text << ": luminance is finite, not negative and at most " << kMaxLuminance << " nit";
  return invalid_argument(text.str());
}

Result<TexturePlane> read(const fs::path& path, const char* format, double scale, int max_width) {
  const auto input = OIIO::ImageInput::create(format);
  OIIO::ImageSpec spec;
  if (!input) return invalid_argument("cannot be read: " + OIIO::geterror());
  if (!input->open(path.string(), spec)) return invalid_argument("cannot be read: " + input->geterror());
  RADBAKE_RETURN_IF_ERROR(check_shape(spec));

  TexturePlane plane;
  plane.name = path.filename().string();
  plane.width = std::min(spec.width, max_width);
  plane.height = plane.width / 2;
  plane.channels = 3;
  plane.values.reserve(std::size_t(plane.width) * std::size_t(plane.height) * 3);
  const bool is_reduced = plane.width < spec.width;
  // The fourth channel sums the weights.
  BoxReduction reduction(spec.width, spec.height, plane.width, plane.height, 4);

  const int channels = spec.nchannels < 3 ? 1 : 3;
  const int step = std::max(1, spec.tile_height);
  const int wanted = kBandValues / (spec.width * channels);
  const int band_rows = std::min(std::max(1, wanted / step) * step, (spec.height + step - 1) / step * step);
  std::vector<float> band(std::size_t(band_rows) * std::size_t(spec.width) * std::size_t(channels));
  std::vector<double> row(std::size_t(spec.width) * 4);
  for (int y = 0; y < spec.height; y += band_rows) {
    const int rows = std::min(band_rows, spec.height - y);
    const int top = spec.y + y, bottom = top + rows;
    const bool is_read = spec.tile_width > 0 ? input->read_tiles(0, 0, spec.x, spec.x + spec.width, top, bottom, 0, 1,
                                                                 0, channels, OIIO::TypeDesc::FLOAT, band.data())
                                             : input->read_scanlines(0, 0, top, bottom, 0, 0, channels,
                                                                     OIIO::TypeDesc::FLOAT, band.data());
    if (!is_read) {
      return invalid_argument("cannot be read: rows " + std::to_string(y) + " to " + std::to_string(y + rows - 1) +
                              " are corrupt");
    }
    // What is reduced goes on as its mean; what is not keeps its bits.
    for (int r = 0; r < rows; ++r) {
      const double theta = std::numbers::pi * (y + r) / spec.height;
      const double weight = std::cos(theta) - std::cos(theta + std::numbers::pi / spec.height);
      const float* pixel = &band[std::size_t(r) * std::size_t(spec.width) * std::size_t(channels)];
      for (int x = 0; x < spec.width; ++x, pixel += channels) {
        for (int c = 0; c < 3; ++c) {
          const float value = pixel[channels < 3 ? 0 : c];
          const double luminance = value * scale;
          if (!(luminance >= 0 && luminance <= kMaxLuminance)) return no_light(value, scale, x, y + r);
          if (!is_reduced) plane.values.push_back(static_cast<float>(luminance));
          row[std::size_t(x) * 4 + std::size_t(c)] = weight * luminance;
        }
        row[std::size_t(x) * 4 + 3] = weight;
      }
      if (is_reduced) reduction.add_row(row);
    }
  }
  if (!is_reduced) return plane;
  const std::vector<float> sums = reduction.finish();
  for (std::size_t at = 0; at < sums.size(); at += 4) {
    for (std::size_t c = 0; c < 3; ++c) plane.values.push_back(sums[at + c] / sums[at + 3]);
  }
  return plane;
}

}  // namespace

Result<TexturePlane> read_environment(const fs::path& path, double scale, int max_width) {
  RADBAKE_CHECK_LT(0.0, scale);
  RADBAKE_CHECK_LE(2, max_width);
  const auto problem = [&](const std::string& why) { return invalid_argument(path.string() + ": " + why); };
  const Result<const char*> format = format_of(path);
  if (!format.ok()) return problem(format.error().message);
  try {
    set_up_oiio();
    Result<TexturePlane> plane = read(path, *format, scale, max_width);
    if (plane.ok()) return plane;
    return problem(plane.error().message);
  } catch (const std::exception& error) {
    return problem(std::string("cannot be read: ") + error.what());
  }
}

}  // namespace radbake::image
