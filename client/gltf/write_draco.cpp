#include "client/gltf/write_draco.h"

#include <draco/compression/decode.h>

#include <exception>
#include <limits>
#include <optional>

namespace radbake::gltf {
namespace {

Error corrupt(const std::string& why) { return invalid_argument("corrupt Draco data: " + why); }

template <typename T>
std::int64_t integer_at(const std::uint8_t* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return static_cast<std::int64_t>(value);
}

/// An integer of any of Draco's types; nothing for types that are no integers.
std::optional<std::int64_t> integer_of(draco::DataType type, const std::uint8_t* bytes) {
  switch (type) {
    case draco::DT_INT8: return integer_at<std::int8_t>(bytes);
    case draco::DT_UINT8: return integer_at<std::uint8_t>(bytes);
    case draco::DT_INT16: return integer_at<std::int16_t>(bytes);
    case draco::DT_UINT16: return integer_at<std::uint16_t>(bytes);
    case draco::DT_INT32: return integer_at<std::int32_t>(bytes);
    case draco::DT_UINT32: return integer_at<std::uint32_t>(bytes);
    default: return std::nullopt;
  }
}

template <typename T>
bool append(std::string& bytes, std::int64_t value) {
  if (value < std::int64_t{std::numeric_limits<T>::min()} || value > std::int64_t{std::numeric_limits<T>::max()}) {
    return false;
  }
  const T narrow = static_cast<T>(value);
  bytes.append(reinterpret_cast<const char*>(&narrow), sizeof(T));
  return true;
}

bool append(std::string& bytes, int component_type, std::int64_t value) {
  switch (component_type) {
    case kInt8: return append<std::int8_t>(bytes, value);
    case kUint8: return append<std::uint8_t>(bytes, value);
    case kInt16: return append<std::int16_t>(bytes, value);
    case kUint16: return append<std::uint16_t>(bytes, value);
    case kUint32: return append<std::uint32_t>(bytes, value);
    default: return false;
  }
}

Result<Elements> read_attribute(const draco::Mesh& mesh, const std::string& name, const DracoAttribute& wanted) {
  const draco::PointAttribute* attribute = mesh.GetAttributeByUniqueId(wanted.unique_id);
  if (attribute == nullptr) {
    return corrupt("attribute " + std::to_string(wanted.unique_id) + " (" + name + ") is not in it");
  }
  const std::size_t n = num_components(wanted.accessor.type);
  if (static_cast<std::size_t>(attribute->num_components()) != n) {
    return corrupt(name + " has " + std::to_string(attribute->num_components()) + " components, its accessor is a " +
                   wanted.accessor.type);
  }
  Elements elements = wanted.accessor;
  elements.count = mesh.num_points();
  elements.bytes.clear();
  const bool is_float = attribute->data_type() == draco::DT_FLOAT32 && elements.component_type == kFloat;
  const std::size_t width = static_cast<std::size_t>(draco::DataTypeLength(attribute->data_type()));
  for (draco::PointIndex point(0); point < mesh.num_points(); ++point) {
    const draco::AttributeValueIndex value = attribute->mapped_index(point);
    const auto beyond = [&](const std::string& why) {
      return corrupt(name + " of vertex " + std::to_string(point.value()) + " " + why);
    };
    if (value.value() >= attribute->size()) return beyond("has no value");
    const std::uint8_t* const bytes = attribute->GetAddress(value);
    if (is_float) elements.bytes.append(reinterpret_cast<const char*>(bytes), n * sizeof(float));
    for (std::size_t c = 0; !is_float && c < n; ++c) {
      const std::optional<std::int64_t> number = integer_of(attribute->data_type(), bytes + c * width);
      if (number && append(elements.bytes, elements.component_type, *number)) continue;
      return beyond("does not fit components of type " + std::to_string(elements.component_type));
    }
  }
  return elements;
}

}  // namespace

Result<DracoElements> decode_draco_elements(std::string_view bytes,
                                            const std::map<std::string, DracoAttribute>& attributes) {
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(bytes.data(), bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) return corrupt(decoded.status().error_msg_string());
    const draco::Mesh& mesh = *decoded.value();
    DracoElements elements;
    for (const auto& [name, wanted] : attributes) {
      RADBAKE_ASSIGN_OR_RETURN(elements.attributes[name], read_attribute(mesh, name, wanted));
    }
    elements.triangles.reserve(mesh.num_faces());
    for (draco::FaceIndex face(0); face < mesh.num_faces(); ++face) {
      const draco::Mesh::Face& corners = mesh.face(face);
      auto& triangle = elements.triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        triangle[k] = corners[k].value();
        if (triangle[k] < mesh.num_points()) continue;
        return corrupt("triangle " + std::to_string(face.value()) + " names vertex " + std::to_string(triangle[k]));
      }
    }
    return elements;
  } catch (const std::exception& error) {
    return corrupt(error.what());
  }
}

}  // namespace radbake::gltf
