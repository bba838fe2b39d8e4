#include "client/image/decode_image.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstring>
#include <exception>
#include <memory>
#include <vector>

#include "client/image/box_reduction.h"
#include "client/image/oiio_setup.h"
#include "client/image/srgb.h"

namespace radbake::image {
namespace {

// Values of one band while it is decoded.
constexpr int kBandValues = 1 << 22;

// The readers of other formats never see bytes from a scene.
const char* extension_of(std::span<const std::byte> bytes) {
  const auto starts_with = [&](std::string_view magic) {
    return bytes.size() >= magic.size() && std::memcmp(bytes.data(), magic.data(), magic.size()) == 0;
  };
  if (starts_with("\x89PNG\r\n\x1a\n")) return "png";
  return starts_with("\xff\xd8\xff") ? "jpg" : nullptr;
}

// Values of 16 bits to linear light. A value of 8 bits comes as v * 257, so the table is exact for both.
std::vector<double> transfer_table(bool is_srgb) {
  std::vector<double> table(65536);
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double value = static_cast<double>(i) / 65535;
    table[i] = is_srgb ? srgb_to_linear(value) : value;
  }
  return table;
}

int reduced(int side, int longest, int max_side) {
  if (longest <= max_side) return side;
  return std::max(1, static_cast<int>((static_cast<long long>(side) * max_side + longest / 2) / longest));
}

Result<TexturePlane> decode(std::span<const std::byte> bytes, const char* extension, bool is_srgb, int max_side) {
  OIIO::Filesystem::IOMemReader reader(const_cast<std::byte*>(bytes.data()), bytes.size());
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // else colours come multiplied by opacity
  OIIO::Filesystem::IOProxy* proxy = &reader;
  config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);  // a configuration replaces the argument
  const auto input = OIIO::ImageInput::open(std::string("image.") + extension, &config, proxy);
  if (!input) return invalid_argument("cannot be decoded: " + OIIO::geterror());
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.width < 1 || spec.height < 1 || spec.width > kMaxImageSide || spec.height > kMaxImageSide) {
    return invalid_argument("its size of " + std::to_string(spec.width) + " x " + std::to_string(spec.height) +
                            " is above the limit of " + std::to_string(kMaxImageSide) + " a side");
  }
  const int n = spec.nchannels;
  if (n < 1 || n > 4 || spec.depth != 1) {
    return invalid_argument("it has " + std::to_string(n) + " channels; 1 to 4 are read");
  }
  const bool has_opacity = n == 2 || n == 4;
  const int longest = std::max(spec.width, spec.height);
  TexturePlane plane;
  plane.width = reduced(spec.width, longest, max_side);
  plane.height = reduced(spec.height, longest, max_side);
  plane.channels = has_opacity ? 4 : 3;
  BoxReduction reduction(spec.width, spec.height, plane.width, plane.height, plane.channels);
  const std::vector<double> table = transfer_table(is_srgb);

  // Band by band: decode, expand grey to colour, linearise, reduce.
  const int band_rows = std::clamp(kBandValues / (spec.width * n), 1, spec.height);
  std::vector<std::uint16_t> band(std::size_t(band_rows) * std::size_t(spec.width) * std::size_t(n));
  std::vector<double> row(std::size_t(spec.width) * std::size_t(plane.channels));
  for (int y = 0; y < spec.height; y += band_rows) {
    const int rows = std::min(band_rows, spec.height - y);
    if (!input->read_scanlines(0, 0, spec.y + y, spec.y + y + rows, 0, 0, n, OIIO::TypeDesc::UINT16, band.data())) {
      return invalid_argument("cannot be decoded: rows " + std::to_string(y) + " to " + std::to_string(y + rows - 1) +
                              " are corrupt");
    }
    for (int r = 0; r < rows; ++r) {
      const std::uint16_t* pixel = &band[std::size_t(r) * std::size_t(spec.width) * std::size_t(n)];
      for (std::size_t x = 0; x < std::size_t(spec.width); ++x, pixel += n) {
        double* out = &row[x * std::size_t(plane.channels)];
        for (int c = 0; c < 3; ++c) out[c] = table[pixel[n < 3 ? 0 : c]];
        if (has_opacity) out[3] = pixel[n - 1] / 65535.0;
      }
      reduction.add_row(row);
    }
  }
  plane.values = reduction.finish();
  return plane;
}

}  // namespace

Result<TexturePlane> decode_image(std::span<const std::byte> bytes, const std::string& name, bool is_srgb,
                                  int max_side) {
  const char* extension = extension_of(bytes);
  if (extension == nullptr) return invalid_argument("neither a PNG nor a JPEG image");
  try {
    set_up_oiio();
    Result<TexturePlane> plane = decode(bytes, extension, is_srgb, max_side);
    if (plane.ok()) plane->name = name;
    return plane;
  } catch (const std::exception& error) {
    return invalid_argument(std::string("cannot be decoded: ") + error.what());
  }
}

}  // namespace radbake::image
