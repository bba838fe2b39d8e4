#include "client/gltf/read_primitive.h"

#include <algorithm>
#include <optional>
#include <span>

#include "client/gltf/decode_draco.h"
#include "client/gltf/entry.h"
#include "client/gltf/primitive_triangles.h"
#include "client/gltf/read_accessor.h"

namespace radbake::gltf {
namespace {

constexpr const char* kDraco = "KHR_draco_mesh_compression";

std::optional<int> attribute_of(const tinygltf::Primitive& primitive, const std::string& name) {
  const auto it = primitive.attributes.find(name);
  return it == primitive.attributes.end() ? std::optional<int>() : std::optional(it->second);
}

const tinygltf::Value* draco_of(const tinygltf::Primitive& primitive) {
  const auto it = primitive.extensions.find(kDraco);
  return it == primitive.extensions.end() ? nullptr : &it->second;
}

// Attributes of a primitive by name, wherever they come from, and its triangles.
struct Attributes {
  std::map<std::string, std::vector<Numbers>> values;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

Result<Attributes> read_plain(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                              const std::vector<std::string>& names) {
  Attributes result;
  const int position = *attribute_of(primitive, "POSITION");
  const std::size_t n = model.accessors[position].count;
  for (const std::string& name : names) {
    const std::optional<int> accessor = attribute_of(primitive, name);
    if (!accessor) continue;
    RADBAKE_ASSIGN_OR_RETURN(result.values[name], read_attribute(model, *accessor, name, n));
  }
  const int index = primitive.indices;
  std::vector<std::uint32_t> corners;
  if (index >= 0) {
    RADBAKE_ASSIGN_OR_RETURN(corners, read_indices(model, index));
  } else {
    corners = consecutive_corners(n);
  }
  auto triangles = primitive_triangles(primitive.mode, corners, n);
  if (!triangles.ok()) {
    const std::string source = index >= 0 ? accessor_name(index, "indices") : accessor_name(position, "POSITION");
    return invalid_argument(source + ": " + triangles.error().message);
  }
  result.triangles = std::move(triangles).value();
  return result;
}

Result<Attributes> read_compressed(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                   const tinygltf::Value& draco, const std::vector<std::string>& names) {
  const tinygltf::BufferView& view = model.bufferViews[draco.Get("bufferView").GetNumberAsInt()];
  const PrimitiveSize size = size_of_primitive(model, primitive);
  DracoPrimitive compressed;
  compressed.bytes =
      std::as_bytes(std::span(model.buffers[view.buffer].data)).subspan(view.byteOffset, view.byteLength);
  compressed.num_vertices = size.num_vertices;
  compressed.num_triangles = size.num_triangles;
  for (const std::string& name : draco.Get("attributes").Keys()) {
    if (std::find(names.begin(), names.end(), name) == names.end()) continue;
    // Whether integers stand for fractions is said by the accessor, where there is one.
    const std::optional<int> accessor = attribute_of(primitive, name);
    compressed.attributes.push_back(
        {name, draco.Get("attributes").Get(name).GetNumberAsInt(), accessor && model.accessors[*accessor].normalized});
  }
  Result<DecodedPrimitive> decoded = decode_draco(compressed);
  if (!decoded.ok()) {
    return invalid_argument(numbered("buffer view", draco.Get("bufferView").GetNumberAsInt()) + ": " +
                            decoded.error().message);
  }
  return Attributes{std::move(decoded->attributes), std::move(decoded->triangles)};
}

std::vector<Vec3> as_vec3(const std::vector<Numbers>& values) {
  std::vector<Vec3> vectors;
  vectors.reserve(values.size());
  for (const Numbers& v : values) vectors.push_back({v[0], v[1], v[2]});
  return vectors;
}

std::vector<Vec2> as_vec2(const std::vector<Numbers>& values) {
  std::vector<Vec2> vectors;
  vectors.reserve(values.size());
  for (const Numbers& v : values) vectors.push_back({v[0], v[1]});
  return vectors;
}

Result<void> check_finite(const tinygltf::Primitive& primitive, const std::string& attribute,
                          const std::vector<Numbers>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (std::all_of(values[i].begin(), values[i].end(), [](double number) { return std::isfinite(number); })) continue;
    return invalid_argument(accessor_name(attribute_of(primitive, attribute).value_or(0), attribute) +
                            ": the value of vertex " + std::to_string(i) + " is NaN or infinite");
  }
  return {};
}

}  // namespace

PrimitiveSize size_of_primitive(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  const auto position = attribute_of(primitive, "POSITION");
  if (!position) return {};
  const tinygltf::Value* draco = draco_of(primitive);
  const int indices =
      draco != nullptr && draco->Has("indices") ? draco->Get("indices").GetNumberAsInt() : primitive.indices;
  const std::size_t num_vertices = model.accessors[*position].count;
  const std::size_t num_corners = indices >= 0 ? model.accessors[indices].count : num_vertices;
  return {num_vertices, num_triangles_of(primitive.mode, num_corners)};
}

Result<FilePrimitive> read_primitive(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                     int texcoord0_set) {
  if (!attribute_of(primitive, "POSITION")) return invalid_argument("it has no POSITION");
  const std::string texcoord0 = "TEXCOORD_" + std::to_string(texcoord0_set);
  const std::vector<std::string> names = {"POSITION", "NORMAL", texcoord0, "TEXCOORD_1", "COLOR_0"};
  const tinygltf::Value* draco = draco_of(primitive);
  RADBAKE_ASSIGN_OR_RETURN(Attributes attributes, draco ? read_compressed(model, primitive, *draco, names)
                                                        : read_plain(model, primitive, names));
  // Unusable normals are replaced, and so wait until the triangles are placed.
  for (const auto& [name, values] : attributes.values) {
    if (name != "NORMAL") RADBAKE_RETURN_IF_ERROR(check_finite(primitive, name, values));
  }
  FilePrimitive result;
  result.mesh.positions = as_vec3(attributes.values["POSITION"]);
  result.mesh.normals = as_vec3(attributes.values["NORMAL"]);
  result.mesh.texcoord0 = as_vec2(attributes.values[texcoord0]);
  result.mesh.texcoord1 = as_vec2(attributes.values["TEXCOORD_1"]);
  result.mesh.triangles = std::move(attributes.triangles);
  for (const Numbers& color : attributes.values["COLOR_0"]) {
    Vec3 limited;
    for (int c = 0; c < 3; ++c) limited[c] = std::clamp(color[static_cast<std::size_t>(c)], 0.0, 1.0);
    result.has_colors_out_of_range |= limited != Vec3{color[0], color[1], color[2]};
    result.has_translucent_colors |= color[3] < 1;
    result.mesh.colors.push_back(limited);
  }
  return result;
}

}  // namespace radbake::gltf
