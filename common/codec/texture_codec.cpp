#include "common/codec/texture_codec.h"

#include <bit>
#include <cmath>
#include <cstring>

namespace radbake {

static_assert(std::endian::native == std::endian::little, "planes travel in little endian");

Result<std::string> encode_texture(const TexturePlane& plane) {
  const auto expected = static_cast<std::size_t>(plane.width) * plane.height * plane.channels;
  if (plane.values.size() != expected) {
    return invalid_argument("texture '" + plane.name + "' has " + std::to_string(plane.values.size()) +
                            " values, its size needs " + std::to_string(expected));
  }
  return std::string(reinterpret_cast<const char*>(plane.values.data()), plane.values.size() * sizeof(float));
}

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
  const std::string owner = "texture '" + texture.name() + "'";
  const std::uint64_t num_pixels = std::uint64_t{texture.width()} * texture.height();
  const std::string size = std::to_string(texture.width()) + " x " + std::to_string(texture.height());
  if (num_pixels == 0) return invalid_argument(owner + " is " + size + " pixels: it has none");
  if (num_pixels > max_pixels) {
    return Error{ErrorCode::kResourceExhausted, owner + " is " + size + " = " + std::to_string(num_pixels) +
                                                    " pixels; max_texture_pixels is " + std::to_string(max_pixels)};
  }
  if (texture.channels() != 3 && texture.channels() != 4) {
    return invalid_argument(owner + " has " + std::to_string(texture.channels()) + " channels: must be 3 or 4");
  }
  const std::uint64_t num_bytes = num_pixels * texture.channels() * sizeof(float);
  if (texture.blob().size_bytes() != num_bytes) {
    return invalid_argument(owner + " has a blob of " + std::to_string(texture.blob().size_bytes()) + " bytes, " +
                            size + " x " + std::to_string(texture.channels()) + " floats are " +
                            std::to_string(num_bytes));
  }
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
  plane.values.resize(blob.size() / sizeof(float));
  std::memcpy(plane.values.data(), blob.data(), plane.values.size() * sizeof(float));
  for (std::size_t i = 0; i < plane.values.size(); ++i) {
    if (std::isfinite(plane.values[i]) && plane.values[i] >= 0) continue;
    const std::size_t pixel = i / plane.channels;
    return invalid_argument("texture '" + plane.name + "' has the value " + std::to_string(plane.values[i]) +
                            " at pixel (" + std::to_string(pixel % plane.width) + ", " +
                            std::to_string(pixel / plane.width) + "): must be finite and not negative");
  }
  return plane;
}

}  // namespace radbake
