#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

namespace radbake::gltf {

/// glTF's componentType.
enum ComponentType : int { kInt8 = 5120, kUint8 = 5121, kInt16 = 5122, kUint16 = 5123, kUint32 = 5125, kFloat = 5126 };

namespace internal {
template <typename T>
double number_at(const unsigned char* bytes, bool is_normalized) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  if (!is_normalized || !std::numeric_limits<T>::is_integer) return value;
  // The lowest signed value stands for -1 as its neighbour does.
  return std::max(value / static_cast<double>(std::numeric_limits<T>::max()), -1.0);
}
}  // namespace internal

/// One component as a number. `is_normalized`: integers stand for fractions from -1 or 0 to 1.
/// Source: glTF 2.0, 3.11 (animations' table of conversions, which accessors share).
inline double component_value(const unsigned char* bytes, int type, bool is_normalized) {
  switch (type) {
    case kInt8: return internal::number_at<std::int8_t>(bytes, is_normalized);
    case kUint8: return internal::number_at<std::uint8_t>(bytes, is_normalized);
    case kInt16: return internal::number_at<std::int16_t>(bytes, is_normalized);
    case kUint16: return internal::number_at<std::uint16_t>(bytes, is_normalized);
    case kUint32: return internal::number_at<std::uint32_t>(bytes, is_normalized);
    default: return internal::number_at<float>(bytes, is_normalized);
  }
}

/// Bytes of one component of a type that glTF knows.
inline std::size_t component_bytes(int type) {
  return type == kInt8 || type == kUint8 ? 1 : type == kInt16 || type == kUint16 ? 2 : 4;
}

/// "16-bit signed integers", for messages.
inline std::string in_words(int type, bool is_normalized) {
  const char* kind = type == kInt8     ? "8-bit signed integers"
                     : type == kUint8  ? "8-bit unsigned integers"
                     : type == kInt16  ? "16-bit signed integers"
                     : type == kUint16 ? "16-bit unsigned integers"
                     : type == kUint32 ? "32-bit unsigned integers"
                     : type == kFloat  ? "floats"
                                       : "an unknown type";
  return (is_normalized && type != kFloat ? "normalised " : "") + std::string(kind);
}

}  // namespace radbake::gltf
