#include "common/codec/texture_codec.h"

#include <bit>
#include <cmath>
#include <cstring>

namespace radbake {

static_assert(std::endian::native == std::endian::little, "planes travel in little endian");

namespace {

constexpr int kEnvironmentChannels = 3;

std::string size_in_words(std::uint64_t width, std::uint64_t height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

/// "texture 'wood'" as it stands in messages.
std::string texture_owner(const std::string& name) { return "texture '" + name + "'"; }
std::string environment_owner(const std::string& name) { return "the environment '" + name + "'"; }

Result<std::string> encode_plane(const TexturePlane& plane, const std::string& owner) {
  const auto expected = static_cast<std::size_t>(plane.width) * plane.height * plane.channels;
  if (plane.values.size() != expected) {
    return invalid_argument(owner + " has " + std::to_string(plane.values.size()) + " values, its size needs " +
                            std::to_string(expected));
  }
  return std::string(reinterpret_cast<const char*>(plane.values.data()), plane.values.size() * sizeof(float));
}

/// A size within the limit of pixels, and a blob of just that size. `Record`: has width, height and blob.
template <typename Record>
Result<void> check_plane(const Record& record, std::uint64_t channels, std::uint64_t max_pixels,
                         const std::string& owner) {
  const std::uint64_t num_pixels = std::uint64_t{record.width()} * record.height();
  const std::string size = size_in_words(record.width(), record.height());
  if (num_pixels == 0) return invalid_argument(owner + " is " + size + " pixels: it has none");
  if (num_pixels > max_pixels) {
    return Error{ErrorCode::kResourceExhausted, owner + " is " + size + " = " + std::to_string(num_pixels) +
                                                    " pixels; max_texture_pixels is " + std::to_string(max_pixels)};
  }
  const std::uint64_t num_bytes = num_pixels * channels * sizeof(float);
  if (record.blob().size_bytes() == num_bytes) return {};
  return invalid_argument(owner + " has a blob of " + std::to_string(record.blob().size_bytes()) + " bytes, " + size +
                          " x " + std::to_string(channels) + " floats are " + std::to_string(num_bytes));
}

/// Fills the values of a plane whose size is set.
Result<void> read_values(const std::string& blob, const std::string& owner, TexturePlane& plane) {
  plane.values.resize(blob.size() / sizeof(float));
  std::memcpy(plane.values.data(), blob.data(), plane.values.size() * sizeof(float));
  for (std::size_t i = 0; i < plane.values.size(); ++i) {
    if (std::isfinite(plane.values[i]) && plane.values[i] >= 0) continue;
    const std::size_t pixel = i / plane.channels;
    return invalid_argument(owner + " has the value " + std::to_string(plane.values[i]) + " at pixel (" +
                            std::to_string(pixel % plane.width) + ", " + std::to_string(pixel / plane.width) +
                            "): must be finite and not negative");
  }
  return {};
}

}  // namespace

Result<std::string> encode_texture(const TexturePlane& plane) { return encode_plane(plane, texture_owner(plane.name)); }

v1::Texture to_proto(const TexturePlane& plane) {
  v1::Texture out;
  out.set_name(plane.name);
  out.set_width(static_cast<std::uint32_t>(plane.width));
  out.set_height(static_cast<std::uint32_t>(plane.height));
  out.set_channels(static_cast<std::uint32_t>(plane.channels));
  // The enumerators have the same order.
  out.set_wrap_s(static_cast<v1::Wrap>(plane.wrap_s));
  out.set_wrap_t(static_cast<v1::Wrap>(plane.wrap_t));
  return out;
}

Result<void> check_texture(const v1::Texture& texture, std::uint64_t max_pixels) {
  const std::string owner = texture_owner(texture.name());
  if (texture.channels() != 3 && texture.channels() != 4) {
    return invalid_argument(owner + " has " + std::to_string(texture.channels()) + " channels: must be 3 or 4");
  }
  RADBAKE_RETURN_IF_ERROR(check_plane(texture, texture.channels(), max_pixels, owner));
  if (!v1::Wrap_IsValid(texture.wrap_s()) || !v1::Wrap_IsValid(texture.wrap_t())) {
    return invalid_argument(owner + " has wrap modes " + std::to_string(texture.wrap_s()) + " and " +
                            std::to_string(texture.wrap_t()) + ": not known");
  }
  return {};
}

Result<TexturePlane> decode_texture(const std::string& blob, const v1::Texture& texture) {
  TexturePlane plane;
  plane.name = texture.name();
  plane.width = static_cast<int>(texture.width());
  plane.height = static_cast<int>(texture.height());
  plane.channels = static_cast<int>(texture.channels());
  plane.wrap_s = static_cast<Wrap>(texture.wrap_s());
  plane.wrap_t = static_cast<Wrap>(texture.wrap_t());
  RADBAKE_RETURN_IF_ERROR(read_values(blob, texture_owner(plane.name), plane));
  return plane;
}

Result<std::string> encode_environment(const TexturePlane& plane) {
  const std::string owner = environment_owner(plane.name);
  if (plane.channels != kEnvironmentChannels) {
    return invalid_argument(owner + " has " + std::to_string(plane.channels) + " channels: must be 3");
  }
  if (plane.width != 2 * plane.height) {
    return invalid_argument(owner + " is " + std::to_string(plane.width) + " x " + std::to_string(plane.height) +
                            " pixels: must be twice as wide as high");
  }
  return encode_plane(plane, owner);
}

v1::Environment environment_to_proto(const TexturePlane& plane) {
  v1::Environment out;
  out.set_name(plane.name);
  out.set_width(static_cast<std::uint32_t>(plane.width));
  out.set_height(static_cast<std::uint32_t>(plane.height));
  return out;
}

Result<void> check_environment(const v1::Environment& environment, std::uint64_t max_pixels) {
  const std::string owner = environment_owner(environment.name());
  RADBAKE_RETURN_IF_ERROR(check_plane(environment, kEnvironmentChannels, max_pixels, owner));
  if (environment.width() == std::uint64_t{2} * environment.height()) return {};
  return invalid_argument(owner + " is " + size_in_words(environment.width(), environment.height()) +
                          " pixels: must be twice as wide as high");
}

Result<TexturePlane> decode_environment(const std::string& blob, const v1::Environment& environment) {
  TexturePlane plane;
  plane.name = environment.name();
  plane.width = static_cast<int>(environment.width());
  plane.height = static_cast<int>(environment.height());
  plane.channels = kEnvironmentChannels;
  RADBAKE_RETURN_IF_ERROR(read_values(blob, environment_owner(plane.name), plane));
  return plane;
}

}  // namespace radbake
