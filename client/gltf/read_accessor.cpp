#include "client/gltf/read_accessor.h"

#include "client/gltf/component.h"
#include "client/gltf/entry.h"
#include "client/gltf/limits.h"

namespace radbake::gltf {
namespace {

const unsigned char* bytes_at(const tinygltf::Model& model, int view_index, std::size_t offset) {
  const tinygltf::BufferView& view = model.bufferViews[view_index];
  return model.buffers[view.buffer].data.data() + view.byteOffset + offset;
}

// A small file may count any number of zeros.
Result<void> check_backing(const tinygltf::Accessor& accessor, const std::string& name) {
  if (accessor.bufferView >= 0 || accessor.count <= kMaxUnbackedElements) return {};
  return invalid_argument(name + " counts " + std::to_string(accessor.count) + " elements without a bufferView; " +
                          std::to_string(kMaxUnbackedElements) + " are allowed");
}

// Calls sink(element, bytes) for the elements of the buffer view, then for those that are replaced; the rest is zero.
template <typename Sink>
Result<void> for_each_element(const tinygltf::Model& model, int index, const std::string& name, Sink&& sink) {
  const tinygltf::Accessor& accessor = model.accessors[index];
  if (accessor.bufferView >= 0 && accessor.count > 0) {
    const unsigned char* first = bytes_at(model, accessor.bufferView, accessor.byteOffset);
    const auto stride = static_cast<std::size_t>(accessor.ByteStride(model.bufferViews[accessor.bufferView]));
    for (std::size_t i = 0; i < accessor.count; ++i) sink(i, first + i * stride);
  }
  if (!accessor.sparse.isSparse) return {};
  // Both lists are tightly packed.
  const auto& sparse = accessor.sparse;
  const auto index_offset = static_cast<std::size_t>(sparse.indices.byteOffset);
  const unsigned char* indices = bytes_at(model, sparse.indices.bufferView, index_offset);
  const auto value_offset = static_cast<std::size_t>(sparse.values.byteOffset);
  const unsigned char* values = bytes_at(model, sparse.values.bufferView, value_offset);
  const std::size_t index_size = component_bytes(sparse.indices.componentType);
  const std::size_t value_size =
      component_bytes(accessor.componentType) *
      static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)));
  std::uint64_t least = 0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(sparse.count); ++k) {
    const auto element =
        static_cast<std::uint64_t>(component_value(indices + k * index_size, sparse.indices.componentType, false));
    const std::string entry = name + ": its sparse index " + std::to_string(k) + " is " + std::to_string(element);
    if (element >= accessor.count) {
      return invalid_argument(entry + ", but it counts " + std::to_string(accessor.count) + " elements");
    }
    if (element < least) {
      return invalid_argument(entry + " after " + std::to_string(least - 1) + ": sparse indices must ascend");
    }
    least = element + 1;
    sink(element, values + k * value_size);
  }
  return {};
}

}  // namespace

std::string accessor_name(int accessor, const std::string& attribute) {
  return numbered("accessor", static_cast<std::size_t>(accessor)) + " (" + attribute + ")";
}

Result<void> check_attribute_type(const std::string& attribute, int num_components, int type, bool is_normalized) {
  const bool is_color = attribute.starts_with("COLOR"), is_normal = attribute == "NORMAL";
  const int expected = attribute.starts_with("TEXCOORD") ? 2 : 3;
  if (num_components != expected && !(is_color && num_components == 4)) {
    return invalid_argument("holds " + std::to_string(num_components) + " numbers a vertex, not " +
                            std::to_string(expected) + (is_color ? " or 4" : ""));
  }
  const bool is_signed = type == kInt8 || type == kInt16, is_unsigned = type == kUint8 || type == kUint16;
  const bool is_allowed = is_color    ? is_unsigned && is_normalized
                          : is_normal ? is_signed && is_normalized
                                      : is_signed || is_unsigned;
  if (type == kFloat || is_allowed) return {};
  return invalid_argument("holds " + in_words(type, is_normalized) + ", not floats or " +
                          (is_color    ? "normalised unsigned integers of 8 or 16 bits"
                           : is_normal ? "normalised signed integers of 8 or 16 bits"
                                       : "integers of 8 or 16 bits"));
}

Result<std::vector<Numbers>> read_attribute(const tinygltf::Model& model, int index, const std::string& attribute,
                                            std::size_t num_vertices) {
  const std::string name = accessor_name(index, attribute);
  const tinygltf::Accessor& accessor = model.accessors[index];
  const int type = accessor.componentType;
  const bool is_vector =
      accessor.type == TINYGLTF_TYPE_VEC2 || accessor.type == TINYGLTF_TYPE_VEC3 || accessor.type == TINYGLTF_TYPE_VEC4;
  if (!is_vector) return invalid_argument(name + " holds no vectors");
  const int num_components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
  const Result<void> is_fit = check_attribute_type(attribute, num_components, type, accessor.normalized);
  if (!is_fit.ok()) return invalid_argument(name + " " + is_fit.error().message);
  if (accessor.count != num_vertices) {
    return invalid_argument(name + " counts " + std::to_string(accessor.count) + ", but its primitive has " +
                            std::to_string(num_vertices) + " vertices");
  }
  RADBAKE_RETURN_IF_ERROR(check_backing(accessor, name));
  std::vector<Numbers> values(accessor.count, zeros(num_components));
  const std::size_t size = component_bytes(type);
  RADBAKE_RETURN_IF_ERROR(for_each_element(model, index, name, [&](std::size_t i, const unsigned char* bytes) {
    for (int c = 0; c < num_components; ++c) {
      values[i][static_cast<std::size_t>(c)] =
          component_value(bytes + static_cast<std::size_t>(c) * size, type, accessor.normalized);
    }
  }));
  return values;
}

Result<std::vector<std::uint32_t>> read_indices(const tinygltf::Model& model, int index) {
  const std::string name = accessor_name(index, "indices");
  const tinygltf::Accessor& accessor = model.accessors[index];
  const int type = accessor.componentType;
  if (accessor.type != TINYGLTF_TYPE_SCALAR || (type != kUint8 && type != kUint16 && type != kUint32)) {
    return invalid_argument(name + " holds " +
                            (accessor.type != TINYGLTF_TYPE_SCALAR ? "vectors" : in_words(type, false)) +
                            ", not unsigned integers");
  }
  RADBAKE_RETURN_IF_ERROR(check_backing(accessor, name));
  std::vector<std::uint32_t> indices(accessor.count);
  RADBAKE_RETURN_IF_ERROR(for_each_element(model, index, name, [&](std::size_t i, const unsigned char* bytes) {
    indices[i] = static_cast<std::uint32_t>(component_value(bytes, type, false));
  }));
  return indices;
}

}  // namespace radbake::gltf
