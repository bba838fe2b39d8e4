// The one file of this folder that knows Draco.
#include "client/gltf/decode_draco.h"

#include <draco/compression/decode.h>

#include <algorithm>
#include <exception>

#include "client/gltf/component.h"

namespace radbake::gltf {
namespace {

Error corrupt(const std::string& why) { return invalid_argument("corrupt Draco data: " + why); }

// Sizes that a compressed mesh claims.
struct Claim {
  std::uint64_t num_vertices = 0;
  std::uint64_t num_faces = 0;
};

// Reads the header and the first numbers of the connectivity, without taking memory.
Result<Claim> peek(std::span<const std::byte> bytes) {
  std::size_t offset = 0;
  const auto u8 = [&]() -> unsigned { return offset < bytes.size() ? static_cast<unsigned>(bytes[offset++]) : 0; };
  const auto varint = [&]() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 35; shift += 7) {
      const unsigned byte = u8();
      value |= std::uint64_t{byte & 127u} << shift;
      if (byte < 128) break;
    }
    return value;
  };
  for (const char c : {'D', 'R', 'A', 'C', 'O'}) {
    if (u8() != static_cast<unsigned char>(c)) return corrupt("it does not start with DRACO");
  }
  const unsigned major = u8(), minor = u8(), encoder = u8(), method = u8(), flags = u8() | u8() << 8;
  if (major != 2 || minor != 2) {
    return corrupt("version " + std::to_string(major) + "." + std::to_string(minor) + ", and glTF asks for 2.2");
  }
  if (encoder != 1) return corrupt("it holds a point cloud, not a mesh");
  if (flags & 0x8000u) return invalid_argument("Draco data with metadata is not read");
  Claim claim;
  if (method == 0) {
    claim.num_faces = varint();
    claim.num_vertices = varint();
  } else if (method == 1) {
    u8();  // kind of traversal
    claim.num_vertices = varint();
    claim.num_faces = varint();
  } else {
    return corrupt("encoding method " + std::to_string(method));
  }
  if (offset >= bytes.size()) return corrupt("truncated in its header");
  return claim;
}

// The type of components as glTF numbers it; 0 for one that it does not know.
int component_type(draco::DataType type) {
  switch (type) {
    case draco::DT_INT8: return kInt8;
    case draco::DT_UINT8: return kUint8;
    case draco::DT_INT16: return kInt16;
    case draco::DT_UINT16: return kUint16;
    case draco::DT_UINT32: return kUint32;
    case draco::DT_FLOAT32: return kFloat;
    default: return 0;
  }
}

// Values of an attribute for all points.
Result<std::vector<Numbers>> read_attribute(const draco::Mesh& mesh, const DracoAttribute& wanted) {
  const std::string name = "attribute " + std::to_string(wanted.unique_id) + " (" + wanted.name + ")";
  const draco::PointAttribute* attribute = mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(wanted.unique_id));
  if (attribute == nullptr) return corrupt(name + " is not in it");
  const int type = component_type(attribute->data_type()), num_components = attribute->num_components();
  const Result<void> is_fit = check_attribute_type(wanted.name, num_components, type, wanted.is_normalized);
  if (!is_fit.ok()) return corrupt(name + " " + is_fit.error().message);
  const std::size_t size = component_bytes(type), element = size * static_cast<std::size_t>(num_components);
  std::vector<Numbers> values(mesh.num_points(), zeros(num_components));
  for (draco::PointIndex point(0); point < mesh.num_points(); ++point) {
    // Not by ConvertValue: that looks at a flag which corrupt data leaves as neither true nor false.
    const draco::AttributeValueIndex value = attribute->mapped_index(point);
    if (value.value() >= attribute->size() ||
        static_cast<std::size_t>(attribute->GetBytePos(value)) + element > attribute->buffer()->data_size()) {
      return corrupt(name + " has no value for vertex " + std::to_string(point.value()));
    }
    const unsigned char* bytes = attribute->GetAddress(value);
    for (std::size_t c = 0; c < static_cast<std::size_t>(num_components); ++c) {
      values[point.value()][c] = component_value(bytes + c * size, type, wanted.is_normalized);
    }
  }
  return values;
}

Result<DecodedPrimitive> convert(const draco::Mesh& decoded, const std::vector<DracoAttribute>& attributes) {
  DecodedPrimitive result;
  for (const DracoAttribute& attribute : attributes) {
    RADBAKE_ASSIGN_OR_RETURN(result.attributes[attribute.name], read_attribute(decoded, attribute));
  }
  if (!result.attributes.contains("POSITION")) return corrupt("no attribute is named POSITION");
  result.triangles.reserve(decoded.num_faces());
  for (draco::FaceIndex face(0); face < decoded.num_faces(); ++face) {
    const draco::Mesh::Face& corners = decoded.face(face);
    std::array<std::uint32_t, 3>& triangle = result.triangles.emplace_back();
    for (int i = 0; i < 3; ++i) {
      triangle[i] = corners[i].value();
      if (triangle[i] >= decoded.num_points()) {
        return corrupt("triangle " + std::to_string(face.value()) + " names vertex " + std::to_string(triangle[i]) +
                       " of " + std::to_string(decoded.num_points()));
      }
    }
  }
  return result;
}

}  // namespace

Result<DecodedPrimitive> decode_draco(const DracoPrimitive& primitive) {
  // Hold the header against the accessors.
  RADBAKE_ASSIGN_OR_RETURN(const Claim claim, peek(primitive.bytes));
  if (claim.num_faces > primitive.num_triangles) {
    return corrupt("it claims " + std::to_string(claim.num_faces) + " triangles, its indices accessor makes " +
                   std::to_string(primitive.num_triangles));
  }
  // Encoders split vertices where a surface is no manifold, at most one for each corner.
  if (claim.num_vertices > std::max(primitive.num_vertices, 3 * primitive.num_triangles)) {
    return corrupt("it claims " + std::to_string(claim.num_vertices) + " vertices, its POSITION accessor counts " +
                   std::to_string(primitive.num_vertices));
  }
  try {
    draco::DecoderBuffer buffer;
    buffer.Init(reinterpret_cast<const char*>(primitive.bytes.data()), primitive.bytes.size());
    draco::Decoder decoder;
    auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
    if (!decoded.ok()) return corrupt(decoded.status().error_msg_string());
    return convert(*decoded.value(), primitive.attributes);
  } catch (const std::exception& error) {
    return corrupt(error.what());
  }
}

}  // namespace radbake::gltf
