// The one file of this folder that knows Draco.
#include "client/gltf/decode_draco.h"

#include <draco/compression/decode.h>

#include <algorithm>
#include <array>
#include <exception>
#include <optional>

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

// Values of an attribute for all points. Shapes: sink is called once a point with N numbers.
template <int N, typename Sink>
Result<void> read_attribute(const draco::Mesh& mesh, const std::string& name, int unique_id, Sink&& sink) {
  const draco::PointAttribute* attribute = mesh.GetAttributeByUniqueId(static_cast<std::uint32_t>(unique_id));
  if (attribute == nullptr) return corrupt("attribute " + std::to_string(unique_id) + " (" + name + ") is not in it");
  if (attribute->num_components() != N) {
    return corrupt(name + " has " + std::to_string(attribute->num_components()) + " components, not " +
                   std::to_string(N));
  }
  // Not by ConvertValue: that looks at a flag which corrupt data leaves as neither true nor false.
  if (attribute->data_type() != draco::DT_FLOAT32) {
    return invalid_argument("Draco data holds " + name + " as integers; quantised meshes are not read by this version");
  }
  for (draco::PointIndex point(0); point < mesh.num_points(); ++point) {
    const draco::AttributeValueIndex value = attribute->mapped_index(point);
    std::array<float, N> numbers;
    if (value.value() >= attribute->size() || !attribute->GetValue<float, N>(value, &numbers)) {
      return corrupt(name + " of vertex " + std::to_string(point.value()) + " has no value");
    }
    sink(numbers);
  }
  return {};
}

Result<Mesh> convert(const draco::Mesh& decoded, const std::map<std::string, int>& attributes) {
  Mesh mesh;
  const auto id = [&](const char* name) {
    const auto it = attributes.find(name);
    return it == attributes.end() ? std::optional<int>() : std::optional(it->second);
  };
  const auto into3 = [](std::vector<Vec3>& out) {
    return [&out](const std::array<float, 3>& v) { out.push_back({v[0], v[1], v[2]}); };
  };
  const auto into2 = [](std::vector<Vec2>& out) {
    return [&out](const std::array<float, 2>& v) { out.push_back({v[0], v[1]}); };
  };
  if (!id("POSITION")) return corrupt("no attribute is named POSITION");
  RADBAKE_RETURN_IF_ERROR(read_attribute<3>(decoded, "POSITION", *id("POSITION"), into3(mesh.positions)));
  if (const auto normal = id("NORMAL")) {
    RADBAKE_RETURN_IF_ERROR(read_attribute<3>(decoded, "NORMAL", *normal, into3(mesh.normals)));
  }
  if (const auto uv = id("TEXCOORD_0")) {
    RADBAKE_RETURN_IF_ERROR(read_attribute<2>(decoded, "TEXCOORD_0", *uv, into2(mesh.texcoord0)));
  }
  if (const auto uv = id("TEXCOORD_1")) {
    RADBAKE_RETURN_IF_ERROR(read_attribute<2>(decoded, "TEXCOORD_1", *uv, into2(mesh.texcoord1)));
  }
  mesh.triangles.reserve(decoded.num_faces());
  for (draco::FaceIndex face(0); face < decoded.num_faces(); ++face) {
    const draco::Mesh::Face& corners = decoded.face(face);
    std::array<std::uint32_t, 3>& triangle = mesh.triangles.emplace_back();
    for (int i = 0; i < 3; ++i) {
      triangle[i] = corners[i].value();
      if (triangle[i] >= decoded.num_points()) {
        return corrupt("triangle " + std::to_string(face.value()) + " names vertex " + std::to_string(triangle[i]) +
                       " of " + std::to_string(decoded.num_points()));
      }
    }
  }
  return mesh;
}

}  // namespace

Result<Mesh> decode_draco(const DracoPrimitive& primitive) {
  // Hold the header against the accessors.
  RADBAKE_ASSIGN_OR_RETURN(const Claim claim, peek(primitive.bytes));
  if (claim.num_faces * 3 > primitive.num_indices) {
    return corrupt("it claims " + std::to_string(claim.num_faces) + " triangles, its indices accessor counts " +
                   std::to_string(primitive.num_indices) + " indices");
  }
  // Encoders split vertices where a surface is no manifold, at most one for each corner.
  if (claim.num_vertices > std::max(primitive.num_vertices, primitive.num_indices)) {
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
