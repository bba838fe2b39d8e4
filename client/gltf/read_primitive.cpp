#include "client/gltf/read_primitive.h"

#include <cmath>
#include <cstring>
#include <optional>
#include <span>

#include "client/gltf/decode_draco.h"
#include "client/gltf/entry.h"

namespace radbake::gltf {
namespace {

constexpr const char* kDraco = "KHR_draco_mesh_compression";

std::string accessor_name(int accessor, const char* attribute) {
  return numbered("accessor", static_cast<std::size_t>(accessor)) + " (" + attribute + ")";
}

std::optional<int> attribute_of(const tinygltf::Primitive& primitive, const char* name) {
  const auto it = primitive.attributes.find(name);
  return it == primitive.attributes.end() ? std::optional<int>() : std::optional(it->second);
}

template <typename T>
T load(const unsigned char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

// Elements of an accessor in their buffer. Accessors lie inside their views and buffers: check_document saw to it.
struct Elements {
  const unsigned char* first = nullptr;
  std::size_t stride = 0;
  std::size_t count = 0;
};

Result<Elements> elements_of(const tinygltf::Model& model, int index, const std::string& name) {
  const tinygltf::Accessor& accessor = model.accessors[index];
  if (accessor.sparse.isSparse) return invalid_argument(name + " is sparse, which this version does not read");
  if (accessor.bufferView < 0) return invalid_argument(name + " has no bufferView");
  const tinygltf::BufferView& view = model.bufferViews[accessor.bufferView];
  Elements elements;
  elements.first = model.buffers[view.buffer].data.data() + view.byteOffset + accessor.byteOffset;
  elements.stride = static_cast<std::size_t>(accessor.ByteStride(view));
  elements.count = accessor.count;
  return elements;
}

// One component as glTF converts it: unsigned integers are normalised. Precondition: a type that read_floats allows.
double component(const unsigned char* bytes, int type) {
  switch (type) {
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE: return load<std::uint8_t>(bytes) / 255.0;
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT: return load<std::uint16_t>(bytes) / 65535.0;
    default: return load<float>(bytes);
  }
}

// Reads an accessor of two or three components a vertex.
template <typename Vector, int N>
Result<std::vector<Vector>> read_vectors(const tinygltf::Model& model, int index, const char* attribute,
                                         std::size_t num_vertices) {
  const std::string name = accessor_name(index, attribute);
  const tinygltf::Accessor& accessor = model.accessors[index];
  if (accessor.type != (N == 3 ? TINYGLTF_TYPE_VEC3 : TINYGLTF_TYPE_VEC2)) {
    return invalid_argument(name + " is not of type VEC" + std::to_string(N));
  }
  const int type = accessor.componentType;
  const bool is_fraction =
      N == 2 && accessor.normalized &&
      (type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE || type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT);
  if (type != TINYGLTF_COMPONENT_TYPE_FLOAT && !is_fraction) {
    return invalid_argument(name + " holds components of type " + std::to_string(type) +
                            "; quantised meshes are not read by this version");
  }
  if (accessor.count != num_vertices) {
    return invalid_argument(name + " counts " + std::to_string(accessor.count) + ", but its primitive has " +
                            std::to_string(num_vertices) + " vertices");
  }
  std::vector<Vector> vectors(accessor.count);
  if (vectors.empty()) return vectors;
  RADBAKE_ASSIGN_OR_RETURN(const Elements elements, elements_of(model, index, name));
  const std::size_t size = static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(type));
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    const unsigned char* bytes = elements.first + i * elements.stride;
    vectors[i].x = component(bytes, type);
    vectors[i].y = component(bytes + size, type);
    if constexpr (N == 3) vectors[i].z = component(bytes + 2 * size, type);
  }
  return vectors;
}

Result<std::vector<std::uint32_t>> read_indices(const tinygltf::Model& model, int index) {
  const std::string name = accessor_name(index, "indices");
  const tinygltf::Accessor& accessor = model.accessors[index];
  const int type = accessor.componentType;
  if (accessor.type != TINYGLTF_TYPE_SCALAR ||
      (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
       type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)) {
    return invalid_argument(name + " does not hold unsigned integers");
  }
  std::vector<std::uint32_t> indices(accessor.count);
  if (indices.empty()) return indices;
  RADBAKE_ASSIGN_OR_RETURN(const Elements elements, elements_of(model, index, name));
  for (std::size_t i = 0; i < indices.size(); ++i) {
    const unsigned char* bytes = elements.first + i * elements.stride;
    indices[i] = type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE    ? load<std::uint8_t>(bytes)
                 : type == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT ? load<std::uint16_t>(bytes)
                                                                  : load<std::uint32_t>(bytes);
  }
  return indices;
}

Result<Mesh> read_plain(const tinygltf::Model& model, const tinygltf::Primitive& primitive, int position) {
  Mesh mesh;
  const std::size_t n = model.accessors[position].count;
  RADBAKE_ASSIGN_OR_RETURN(mesh.positions, (read_vectors<Vec3, 3>(model, position, "POSITION", n)));
  if (const auto normal = attribute_of(primitive, "NORMAL")) {
    RADBAKE_ASSIGN_OR_RETURN(mesh.normals, (read_vectors<Vec3, 3>(model, *normal, "NORMAL", n)));
  }
  if (const auto uv = attribute_of(primitive, "TEXCOORD_0")) {
    RADBAKE_ASSIGN_OR_RETURN(mesh.texcoord0, (read_vectors<Vec2, 2>(model, *uv, "TEXCOORD_0", n)));
  }
  if (const auto uv = attribute_of(primitive, "TEXCOORD_1")) {
    RADBAKE_ASSIGN_OR_RETURN(mesh.texcoord1, (read_vectors<Vec2, 2>(model, *uv, "TEXCOORD_1", n)));
  }
  // Without indices, each three vertices are a triangle.
  const int index = primitive.indices;
  std::vector<std::uint32_t> indices;
  if (index >= 0) {
    RADBAKE_ASSIGN_OR_RETURN(indices, read_indices(model, index));
  }
  const std::string source = index >= 0 ? accessor_name(index, "indices") : accessor_name(position, "POSITION");
  const std::size_t num_corners = index >= 0 ? indices.size() : n;
  if (num_corners % 3 != 0) {
    return invalid_argument(source + " counts " + std::to_string(num_corners) + ", not a multiple of three");
  }
  mesh.triangles.resize(num_corners / 3);
  for (std::size_t i = 0; i < num_corners; ++i) {
    const std::size_t vertex = index >= 0 ? indices[i] : i;
    if (vertex >= n) {
      return invalid_argument(source + ": index " + std::to_string(vertex) + " of triangle " + std::to_string(i / 3) +
                              " is out of range, its primitive has " + std::to_string(n) + " vertices");
    }
    mesh.triangles[i / 3][i % 3] = static_cast<std::uint32_t>(vertex);
  }
  return mesh;
}

Result<Mesh> read_compressed(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                             const tinygltf::Value& draco) {
  const tinygltf::BufferView& view = model.bufferViews[draco.Get("bufferView").GetNumberAsInt()];
  const PrimitiveSize size = size_of_primitive(model, primitive);
  DracoPrimitive compressed;
  compressed.bytes =
      std::as_bytes(std::span(model.buffers[view.buffer].data)).subspan(view.byteOffset, view.byteLength);
  compressed.num_vertices = size.num_vertices;
  compressed.num_indices = size.num_triangles * 3;
  for (const std::string& name : draco.Get("attributes").Keys()) {
    compressed.attributes[name] = draco.Get("attributes").Get(name).GetNumberAsInt();
  }
  Result<Mesh> mesh = decode_draco(compressed);
  if (mesh.ok()) return mesh;
  return invalid_argument(numbered("buffer view", draco.Get("bufferView").GetNumberAsInt()) + ": " +
                          mesh.error().message);
}

template <typename Vector>
Result<void> check_finite(const std::vector<Vector>& vectors, const tinygltf::Primitive& primitive,
                          const char* attribute) {
  for (std::size_t i = 0; i < vectors.size(); ++i) {
    if (is_finite(vectors[i])) continue;
    return invalid_argument(accessor_name(attribute_of(primitive, attribute).value_or(0), attribute) +
                            ": the value of vertex " + std::to_string(i) + " is NaN or infinite");
  }
  return {};
}

const tinygltf::Value* draco_of(const tinygltf::Primitive& primitive) {
  const auto it = primitive.extensions.find(kDraco);
  return it == primitive.extensions.end() ? nullptr : &it->second;
}

}  // namespace

PrimitiveSize size_of_primitive(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  const auto position = attribute_of(primitive, "POSITION");
  if (!position) return {};
  const tinygltf::Value* draco = draco_of(primitive);
  const int indices =
      draco != nullptr && draco->Has("indices") ? draco->Get("indices").GetNumberAsInt() : primitive.indices;
  const std::size_t num_vertices = model.accessors[*position].count;
  return {num_vertices, (indices >= 0 ? model.accessors[indices].count : num_vertices) / 3};
}

Result<Mesh> read_primitive(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  const auto position = attribute_of(primitive, "POSITION");
  if (!position) return invalid_argument("it has no POSITION");
  const tinygltf::Value* draco = draco_of(primitive);
  RADBAKE_ASSIGN_OR_RETURN(Mesh mesh,
                           draco ? read_compressed(model, primitive, *draco) : read_plain(model, primitive, *position));
  RADBAKE_RETURN_IF_ERROR(check_finite(mesh.positions, primitive, "POSITION"));
  RADBAKE_RETURN_IF_ERROR(check_finite(mesh.texcoord0, primitive, "TEXCOORD_0"));
  RADBAKE_RETURN_IF_ERROR(check_finite(mesh.texcoord1, primitive, "TEXCOORD_1"));
  return mesh;
}

}  // namespace radbake::gltf
