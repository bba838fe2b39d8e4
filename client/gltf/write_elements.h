#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

namespace radbake::gltf {

/// JSON whose objects keep the order of their keys: a file that is written again reads as it did.
using OrderedJson = nlohmann::ordered_json;

// Component types of accessors. Source: glTF 2.0, 3.6.2.2.
inline constexpr int kInt8 = 5120, kUint8 = 5121, kInt16 = 5122, kUint16 = 5123, kUint32 = 5125, kFloat = 5126;

/// Values of an accessor as they are in the file, in their own component type, one after the other: no stride, sparse
/// values in their places. Columns of matrices begin at multiples of 4 bytes, as in the file.
struct Elements {
  int component_type = kFloat;
  std::string type = "SCALAR";
  bool is_normalized = false;
  std::size_t count = 0;
  std::string bytes;  ///< [count * element_bytes(*this)]
};

/// Bytes of a component and of an element. Throws std::out_of_range for what glTF does not know.
std::size_t component_bytes(int component_type);
std::size_t num_components(const std::string& type);
std::size_t element_bytes(int component_type, const std::string& type);
inline std::size_t element_bytes(const Elements& elements) {
  return element_bytes(elements.component_type, elements.type);
}

/// Appends copies of elements. Precondition: each of `copied` is below elements.count.
Elements with_copies(Elements elements, std::span<const std::uint32_t> copied);

/// A component as a number; normalised integers as fractions. Precondition: no matrix.
double component(const Elements& elements, std::size_t element, std::size_t index);

/// min and max of each component, as accessors say it: integers as they are. Precondition: count > 0, no matrix.
struct ElementBounds {
  OrderedJson min, max;
};
ElementBounds bounds_of(const Elements& elements);

/// Floats as VEC2, VEC3 or VEC4.
template <std::size_t N>
Elements elements_of(const std::vector<std::array<float, N>>& values) {
  Elements elements{kFloat, "VEC" + std::to_string(N), false, values.size(), std::string(values.size() * 4 * N, '\0')};
  if (!values.empty()) std::memcpy(elements.bytes.data(), values.data(), elements.bytes.size());
  return elements;
}

/// Corners of triangles, in 16 bits where that holds every index below num_vertices and the mark of a restart.
Elements index_elements(std::span<const std::array<std::uint32_t, 3>> triangles, std::size_t num_vertices);

}  // namespace radbake::gltf
