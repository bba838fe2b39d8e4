#include "client/image/write_image.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <system_error>

#include "client/image/oiio_setup.h"
#include "client/image/srgb.h"
#include "common/base/check.h"

namespace radbake::image {
namespace {

constexpr double kExposedPercentile = 0.95;
constexpr double kWhite = 4;

Error cannot_write(const std::filesystem::path& path, const std::string& why) {
  return internal_error("cannot write " + path.string() + ": " + why);
}

Result<void> check_shape(const std::filesystem::path& path, int width, int height, int channels, int fewest,
                         std::size_t num_values) {
  if (width > 0 && height > 0 && channels >= fewest && channels <= 4 &&
      num_values == std::size_t(width) * std::size_t(height) * std::size_t(channels)) {
    return {};
  }
  return invalid_argument("cannot write " + path.string() + ": " + std::to_string(num_values) +
                          " values are no image of " + std::to_string(width) + " x " + std::to_string(height) +
                          " with " + std::to_string(channels) + " channels");
}

// Writes all bytes and brings them to the disk. Returns errno, or 0.
int write_through(const std::filesystem::path& path, const std::vector<unsigned char>& bytes) {
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (fd < 0) return errno;
  int failure = 0;
  for (std::size_t done = 0; done < bytes.size() && failure == 0;) {
    const ssize_t written = write(fd, bytes.data() + done, bytes.size() - done);
    if (written >= 0) done += std::size_t(written);
    if (written < 0 && errno != EINTR) failure = errno;
  }
  if (failure == 0 && fsync(fd) != 0) failure = errno;
  if (close(fd) != 0 && failure == 0) failure = errno;
  return failure;
}

// Writes aside and renames, so that nobody sees half a file, also after a power loss.
Result<void> write_file(const std::filesystem::path& path, const std::vector<unsigned char>& bytes) {
  const std::filesystem::path aside = path.string() + "." + std::to_string(getpid()) + ".part";
  std::error_code error(write_through(aside, bytes), std::generic_category());
  if (!error) std::filesystem::rename(aside, path, error);
  if (error) {
    std::error_code ignored;
    std::filesystem::remove(aside, ignored);
    return cannot_write(path, error.message());
  }
  // The name itself. Not every file system can do that for a folder, and the file is there.
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (const int fd = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); fd >= 0) {
    fsync(fd);
    close(fd);
  }
  return {};
}

// Encodes in memory. `name`: its extension names the format.
Result<std::vector<unsigned char>> encode_in_memory(const std::string& name, const OIIO::ImageSpec& spec,
                                                    OIIO::TypeDesc type, const void* pixels) {
  try {
    set_up_oiio();
    std::vector<unsigned char> bytes;
    OIIO::Filesystem::IOVecOutput memory(bytes);
    const auto output = OIIO::ImageOutput::create(name, &memory);
    if (!output) return internal_error(OIIO::geterror());
    if (!output->open(name, spec) || !output->write_image(type, pixels) || !output->close()) {
      return internal_error(output->geterror());
    }
    return bytes;
  } catch (const std::exception& error) {
    return internal_error(error.what());
  }
}

// Encodes in memory, with the format that the path's extension names, and writes.
Result<void> encode(const std::filesystem::path& path, const OIIO::ImageSpec& spec, OIIO::TypeDesc type,
                    const void* pixels) {
  const Result<std::vector<unsigned char>> bytes = encode_in_memory(path.filename().string(), spec, type, pixels);
  return bytes.ok() ? write_file(path, *bytes) : cannot_write(path, bytes.error().message);
}

// A number that an image of integers can hold: 0 for what is negative or not finite.
double shown_value(float value, double highest) {
  return std::isfinite(value) ? std::clamp(static_cast<double>(value), 0.0, highest) : 0;
}

double luminance(const float* rgb) { return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]; }

// What the preview shows as 1. The brightest texel where the percentile is dark.
double exposed_luminance(std::span<const float> values, int channels) {
  std::vector<double> covered;
  for (std::size_t at = 0; at < values.size(); at += std::size_t(channels)) {
    if (channels == 4 && !(values[at + 3] > 0)) continue;
    const double y = luminance(&values[at]);
    if (std::isfinite(y)) covered.push_back(y);
  }
  if (covered.empty()) return 0;
  const auto rank = covered.begin() + std::ptrdiff_t(kExposedPercentile * double(covered.size() - 1));
  std::nth_element(covered.begin(), rank, covered.end());
  return *rank > 0 ? *rank : *std::max_element(covered.begin(), covered.end());
}

}  // namespace

Result<void> write_exr(const std::filesystem::path& path, int width, int height, int channels,
                       std::span<const float> values, const std::string& unit) {
  RADBAKE_RETURN_IF_ERROR(check_shape(path, width, height, channels, 1, values.size()));
  OIIO::ImageSpec spec(width, height, channels, OIIO::TypeDesc::FLOAT);
  spec.attribute("compression", "zip");
  spec.attribute("oiio:ColorSpace", "Linear");
  constexpr float kRec709[8] = {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f};
  spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), kRec709);
  spec.attribute("unit", unit);
  spec.attribute("DateTime", "");  // else the time of writing goes in, and equal maps have other bytes
  return encode(path, spec, OIIO::TypeDesc::FLOAT, values.data());
}

Result<void> write_preview_png(const std::filesystem::path& path, int width, int height, int channels,
                               std::span<const float> values) {
  RADBAKE_RETURN_IF_ERROR(check_shape(path, width, height, channels, 3, values.size()));
  const double exposed = exposed_luminance(values, channels);
  std::vector<unsigned char> pixels;
  pixels.reserve(std::size_t(width) * std::size_t(height) * 3);
  for (std::size_t at = 0; at < values.size(); at += std::size_t(channels)) {
    // Compress the luminance and keep the colour.
    const double y = exposed > 0 ? luminance(&values[at]) / exposed : 0;
    const double scale = exposed > 0 ? (1 + y / (kWhite * kWhite)) / (1 + y) / exposed : 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double shown = linear_to_srgb(std::clamp(values[at + c] * scale, 0.0, 1.0));
      pixels.push_back(std::isfinite(shown) ? static_cast<unsigned char>(std::lround(255 * shown)) : 0);
    }
  }
  const OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
  return encode(path, spec, OIIO::TypeDesc::UINT8, pixels.data());
}

Result<void> write_hdr(const std::filesystem::path& path, int width, int height, int channels,
                       std::span<const float> values) {
  RADBAKE_RETURN_IF_ERROR(check_shape(path, width, height, channels, 3, values.size()));
  std::vector<float> pixels;
  pixels.reserve(std::size_t(width) * std::size_t(height) * 3);
  for (std::size_t at = 0; at < values.size(); at += std::size_t(channels)) {
    for (std::size_t c = 0; c < 3; ++c) {
      pixels.push_back(static_cast<float>(shown_value(values[at + c], std::numeric_limits<float>::max())));
    }
  }
  const OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::FLOAT);
  return encode(path, spec, OIIO::TypeDesc::FLOAT, pixels.data());
}

Result<void> write_rgbm_png(const std::filesystem::path& path, int width, int height, int channels,
                            std::span<const float> values, double multiplier) {
  RADBAKE_CHECK_LT(0.0, multiplier);
  RADBAKE_RETURN_IF_ERROR(check_shape(path, width, height, channels, 3, values.size()));
  std::vector<unsigned char> pixels;
  pixels.reserve(std::size_t(width) * std::size_t(height) * 4);
  for (std::size_t at = 0; at < values.size(); at += std::size_t(channels)) {
    double rgb[3];
    for (std::size_t c = 0; c < 3; ++c) rgb[c] = shown_value(values[at + c], multiplier) / multiplier;
    // Not below 1: a texel without M has no colour, and neighbours are filtered with it.
    const double m = std::max(1.0, std::ceil(255 * std::max({rgb[0], rgb[1], rgb[2]})));
    for (const double value : rgb) {
      pixels.push_back(static_cast<unsigned char>(std::min(255L, std::lround(255 * 255 * value / m))));
    }
    pixels.push_back(static_cast<unsigned char>(m));
  }
  OIIO::ImageSpec spec(width, height, 4, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:UnassociatedAlpha", 1);  // else colours are divided by what is no opacity
  return encode(path, spec, OIIO::TypeDesc::UINT8, pixels.data());
}

Result<std::string> encode_linear_png(int width, int height, int channels, std::span<const float> values,
                                      double intensity) {
  RADBAKE_CHECK_LT(0.0, intensity);
  RADBAKE_RETURN_IF_ERROR(check_shape("a lightmap as PNG", width, height, channels, 3, values.size()));
  std::vector<std::uint16_t> pixels;
  pixels.reserve(std::size_t(width) * std::size_t(height) * 3);
  for (std::size_t at = 0; at < values.size(); at += std::size_t(channels)) {
    for (std::size_t c = 0; c < 3; ++c) {
      pixels.push_back(
          static_cast<std::uint16_t>(std::lround(65535 * (shown_value(values[at + c], intensity) / intensity))));
    }
  }
  const OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT16);
  const auto bytes = encode_in_memory("lightmap.png", spec, OIIO::TypeDesc::UINT16, pixels.data());
  if (!bytes.ok()) return internal_error("cannot encode a lightmap as PNG: " + bytes.error().message);
  return std::string(bytes->begin(), bytes->end());
}

Result<void> write_png(const std::filesystem::path& path, int width, int height, std::span<const std::uint8_t> rgb) {
  RADBAKE_RETURN_IF_ERROR(check_shape(path, width, height, 3, 3, rgb.size()));
  const OIIO::ImageSpec spec(width, height, 3, OIIO::TypeDesc::UINT8);
  return encode(path, spec, OIIO::TypeDesc::UINT8, rgb.data());
}

Result<Pixels> read_exr(const std::filesystem::path& path) {
  try {
    set_up_oiio();
    const auto input = OIIO::ImageInput::open(path.string());
    if (!input) return invalid_argument("cannot read " + path.string() + ": " + OIIO::geterror());
    const OIIO::ImageSpec& spec = input->spec();
    Pixels pixels{spec.width, spec.height, spec.nchannels, {}};
    pixels.values.resize(std::size_t(spec.width) * std::size_t(spec.height) * std::size_t(spec.nchannels));
    if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, pixels.values.data())) {
      return invalid_argument("cannot read " + path.string() + ": " + input->geterror());
    }
    return pixels;
  } catch (const std::exception& error) {
    return invalid_argument("cannot read " + path.string() + ": " + error.what());
  }
}

}  // namespace radbake::image
