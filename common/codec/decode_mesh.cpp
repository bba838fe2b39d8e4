#include <algorithm>
#include <cmath>

#include "common/codec/decode_draco.h"
#include "common/codec/draco_peek.h"
#include "common/codec/mesh_codec.h"

namespace radbake {
namespace {

using Type = draco::GeometryAttribute;

// One for each attribute beside the position: vertex id, normal, two texture coordinates, colour.
constexpr unsigned kMaxConnectivities = 5;

std::string in_words(std::uint64_t found, const char* what, std::uint64_t declared) {
  return "has " + std::to_string(found) + " " + what + ", its record says " + std::to_string(declared);
}

/// Holds what a blob claims against its record, before memory is taken for it.
Result<void> check_claims(const std::string& blob, const v1::MeshRecord& record) {
  RADBAKE_ASSIGN_OR_RETURN(const DracoClaims claims, peek_draco(blob));
  if (claims.num_faces != record.num_triangles()) {
    return invalid_argument(in_words(claims.num_faces, "triangles", record.num_triangles()));
  }
  // Points split where the surface is not manifold, at most to one for each corner.
  const std::uint64_t num_corners = 3 * std::uint64_t{record.num_triangles()};
  if (claims.num_points > num_corners || claims.num_split_symbols > claims.num_faces) {
    return invalid_argument("has " + std::to_string(claims.num_points) + " points and " +
                            std::to_string(claims.num_split_symbols) + " splits for " + std::to_string(num_corners) +
                            " corners");
  }
  if (claims.num_connectivities > kMaxConnectivities) {
    return invalid_argument("has " + std::to_string(claims.num_connectivities) + " attribute connectivities, at most " +
                            std::to_string(kMaxConnectivities) + " are allowed");
  }
  return {};
}

/// What a mesh of this record has, in this order: the vertex id and the position first.
std::vector<ExpectedAttribute> expected_attributes(const v1::MeshRecord& record) {
  std::vector<ExpectedAttribute> expected = {
      {kVertexId, Type::GENERIC, draco::DT_UINT32, 1, "vertex id"},
      {kPositionId, Type::POSITION, draco::DT_FLOAT32, 3, "position"},
  };
  if (record.has_normals()) expected.push_back({kNormalId, Type::NORMAL, draco::DT_FLOAT32, 3, "normal"});
  if (record.has_texcoord0()) expected.push_back({kTexcoord0Id, Type::TEX_COORD, draco::DT_FLOAT32, 2, "texcoord 0"});
  if (record.has_texcoord1()) expected.push_back({kTexcoord1Id, Type::TEX_COORD, draco::DT_FLOAT32, 2, "texcoord 1"});
  if (record.has_colors()) expected.push_back({kColorId, Type::COLOR, draco::DT_FLOAT32, 3, "colour"});
  return expected;
}

/// The attribute of an id, which is there, with a value for every point.
Result<const draco::PointAttribute*> attribute_of(const draco::Mesh& decoded, std::uint32_t unique_id,
                                                  const char* name) {
  const draco::PointAttribute* attribute = decoded.GetAttributeByUniqueId(unique_id);
  for (std::uint32_t point = 0; point < decoded.num_points(); ++point) {
    if (attribute->mapped_index(draco::PointIndex(point)).value() >= attribute->size()) {
      return invalid_argument(std::string("has no ") + name + " for point " + std::to_string(point));
    }
  }
  return attribute;
}

/// Reads float attributes into a vertex array; absent ones leave it empty.
struct FloatAttribute {
  const draco::PointAttribute* attribute = nullptr;
  const char* name = "";

  /// The value of a point; z is 0 where the attribute has two components.
  Result<Vec3> at(std::uint32_t point) const {
    float value[3] = {0, 0, 0};
    attribute->GetMappedValue(draco::PointIndex(point), value);
    const Vec3 result{value[0], value[1], value[2]};
    if (!is_finite(result)) return invalid_argument(std::string("has a ") + name + " that is not finite");
    return result;
  }
};

Result<FloatAttribute> float_attribute(const draco::Mesh& decoded, bool is_declared, std::uint32_t id,
                                       const char* name) {
  if (!is_declared) return FloatAttribute{};
  RADBAKE_ASSIGN_OR_RETURN(const auto* attribute, attribute_of(decoded, id, name));
  return FloatAttribute{attribute, name};
}

Result<Mesh> read(const draco::Mesh& decoded, const v1::MeshRecord& record, Vec3 origin) {
  // Check the counts and that every point has every value.
  if (decoded.num_faces() != record.num_triangles()) {
    return invalid_argument(in_words(decoded.num_faces(), "triangles after decoding", record.num_triangles()));
  }
  RADBAKE_ASSIGN_OR_RETURN(const auto* ids, attribute_of(decoded, kVertexId, "vertex id"));
  RADBAKE_ASSIGN_OR_RETURN(const auto position, float_attribute(decoded, true, kPositionId, "position"));
  RADBAKE_ASSIGN_OR_RETURN(const auto normal, float_attribute(decoded, record.has_normals(), kNormalId, "normal"));
  RADBAKE_ASSIGN_OR_RETURN(const auto texcoord0,
                           float_attribute(decoded, record.has_texcoord0(), kTexcoord0Id, "texcoord 0"));
  RADBAKE_ASSIGN_OR_RETURN(const auto texcoord1,
                           float_attribute(decoded, record.has_texcoord1(), kTexcoord1Id, "texcoord 1"));
  RADBAKE_ASSIGN_OR_RETURN(const auto color, float_attribute(decoded, record.has_colors(), kColorId, "colour"));

  // Put every point back to its vertex.
  const std::uint32_t num_vertices = record.num_vertices();
  Mesh mesh;
  mesh.name = record.name();
  mesh.material = static_cast<int>(record.material());
  mesh.positions.assign(num_vertices, origin);
  if (normal.attribute) mesh.normals.assign(num_vertices, Vec3{0, 0, 1});
  if (texcoord0.attribute) mesh.texcoord0.resize(num_vertices);
  if (texcoord1.attribute) mesh.texcoord1.resize(num_vertices);
  if (color.attribute) mesh.colors.assign(num_vertices, Vec3{1, 1, 1});
  std::vector<std::uint32_t> vertex_of(decoded.num_points());
  for (std::uint32_t point = 0; point < decoded.num_points(); ++point) {
    std::uint32_t vertex = 0;
    ids->GetMappedValue(draco::PointIndex(point), &vertex);
    if (vertex >= num_vertices) {
      return invalid_argument("has vertex id " + std::to_string(vertex) + " of " + std::to_string(num_vertices) +
                              " vertices");
    }
    vertex_of[point] = vertex;
    RADBAKE_ASSIGN_OR_RETURN(const Vec3 p, position.at(point));
    mesh.positions[vertex] = origin + p;
    if (normal.attribute) {
      RADBAKE_ASSIGN_OR_RETURN(const Vec3 n, normal.at(point));
      if (!(length(n) > 0)) return invalid_argument("has a normal of length 0 at vertex " + std::to_string(vertex));
      mesh.normals[vertex] = normalized(n);
    }
    if (texcoord0.attribute) {
      RADBAKE_ASSIGN_OR_RETURN(const Vec3 t, texcoord0.at(point));
      mesh.texcoord0[vertex] = {t.x, t.y};
    }
    if (texcoord1.attribute) {
      RADBAKE_ASSIGN_OR_RETURN(const Vec3 t, texcoord1.at(point));
      mesh.texcoord1[vertex] = {t.x, t.y};
    }
    if (color.attribute) {
      RADBAKE_ASSIGN_OR_RETURN(const Vec3 c, color.at(point));
      if (min_component(c) < 0 || max_component(c) > 1) {
        return invalid_argument("has a colour outside 0 to 1 at vertex " + std::to_string(vertex));
      }
      mesh.colors[vertex] = c;
    }
  }

  // Bring the triangles into the order that depends on the ids alone.
  Triangles triangles(decoded.num_faces());
  for (std::uint32_t face = 0; face < decoded.num_faces(); ++face) {
    for (int corner = 0; corner < 3; ++corner) {
      const std::uint32_t point = decoded.face(draco::FaceIndex(face))[corner].value();
      if (point >= decoded.num_points()) {
        return invalid_argument("has point " + std::to_string(point) + " of " + std::to_string(decoded.num_points()) +
                                " in triangle " + std::to_string(face));
      }
      triangles[face][corner] = vertex_of[point];
    }
  }
  mesh.triangles = canonical_triangles(triangles);
  if (mesh.triangles.size() != triangles.size()) {
    return invalid_argument("has " + std::to_string(triangles.size() - mesh.triangles.size()) +
                            " triangles that use a vertex twice");
  }
  return mesh;
}

}  // namespace

Result<Mesh> decode_mesh(const std::string& blob, const v1::MeshRecord& record, Vec3 origin) {
  const auto named = [&](const Error& error) {
    return Error{error.code, "mesh '" + record.name() + "' " + error.message};
  };
  if (auto checked = check_claims(blob, record); !checked.ok()) return named(checked.error());
  auto decoded = decode_draco(blob, expected_attributes(record));
  if (!decoded.ok()) return named(decoded.error());
  auto mesh = read(**decoded, record, origin);
  if (!mesh.ok()) return named(mesh.error());
  return mesh;
}

}  // namespace radbake
