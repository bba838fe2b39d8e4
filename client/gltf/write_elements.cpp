#include "client/gltf/write_elements.h"

#include <algorithm>
#include <limits>
#include <map>
#include <string_view>

namespace radbake::gltf {
namespace {

const std::map<int, std::size_t> kComponentBytes = {{kInt8, 1},   {kUint8, 1},  {kInt16, 2},
                                                    {kUint16, 2}, {kUint32, 4}, {kFloat, 4}};
const std::map<std::string_view, std::size_t> kNumComponents = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4},
                                                                {"MAT2", 4},   {"MAT3", 9}, {"MAT4", 16}};

template <typename T>
T load(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

double number_at(const Elements& elements, std::size_t element, std::size_t index) {
  const char* bytes =
      elements.bytes.data() + element * element_bytes(elements) + index * component_bytes(elements.component_type);
  switch (elements.component_type) {
    case kInt8: return load<std::int8_t>(bytes);
    case kUint8: return load<std::uint8_t>(bytes);
    case kInt16: return load<std::int16_t>(bytes);
    case kUint16: return load<std::uint16_t>(bytes);
    case kUint32: return load<std::uint32_t>(bytes);
    default: return load<float>(bytes);
  }
}

}  // namespace

std::size_t component_bytes(int component_type) { return kComponentBytes.at(component_type); }
std::size_t num_components(const std::string& type) { return kNumComponents.at(type); }

std::size_t element_bytes(int component_type, const std::string& type) {
  const std::size_t size = component_bytes(component_type);
  if (!type.starts_with("MAT")) return size * num_components(type);
  const std::size_t side = static_cast<std::size_t>(type.back() - '0');
  return side * ((side * size + 3) / 4 * 4);
}

Elements with_copies(Elements elements, std::span<const std::uint32_t> copied) {
  const std::size_t size = element_bytes(elements);
  elements.bytes.resize((elements.count + copied.size()) * size);
  for (const std::uint32_t source : copied) {
    std::memcpy(&elements.bytes[elements.count++ * size], &elements.bytes[source * size], size);
  }
  return elements;
}

double component(const Elements& elements, std::size_t element, std::size_t index) {
  const double number = number_at(elements, element, index);
  if (!elements.is_normalized) return number;
  // Source: glTF 2.0, 3.11 (conversion of normalised integers).
  switch (elements.component_type) {
    case kInt8: return std::max(number / 127, -1.0);
    case kUint8: return number / 255;
    case kInt16: return std::max(number / 32767, -1.0);
    case kUint16: return number / 65535;
    default: return number;
  }
}

ElementBounds bounds_of(const Elements& elements) {
  ElementBounds bounds{OrderedJson::array(), OrderedJson::array()};
  for (std::size_t c = 0; c < num_components(elements.type); ++c) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (std::size_t i = 0; i < elements.count; ++i) {
      low = std::min(low, number_at(elements, i, c));
      high = std::max(high, number_at(elements, i, c));
    }
    const auto as_json = [&](double number) {
      return elements.component_type == kFloat ? OrderedJson(number) : OrderedJson(static_cast<std::int64_t>(number));
    };
    bounds.min.push_back(as_json(low));
    bounds.max.push_back(as_json(high));
  }
  return bounds;
}

Elements index_elements(std::span<const std::array<std::uint32_t, 3>> triangles, std::size_t num_vertices) {
  const bool is_short = num_vertices <= std::numeric_limits<std::uint16_t>::max();
  Elements elements{is_short ? kUint16 : kUint32, "SCALAR", false, triangles.size() * 3, {}};
  elements.bytes.reserve(elements.count * (is_short ? 2 : 4));
  for (const auto& triangle : triangles) {
    for (const std::uint32_t vertex : triangle) {
      for (int shift = 0; shift < (is_short ? 16 : 32); shift += 8) {
        elements.bytes.push_back(static_cast<char>(vertex >> shift & 255));
      }
    }
  }
  return elements;
}

}  // namespace radbake::gltf
