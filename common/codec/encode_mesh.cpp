#include <draco/compression/expert_encode.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>

#include "common/codec/mesh_codec.h"

namespace radbake {
namespace {

constexpr int kNormalBits = 16;
// Draco's middle: slower settings gain a few per cent of size for several times the time.
constexpr int kSpeed = 5;

/// The part of a mesh that is sent: its triangles over consecutive points, and the vertex of each point.
struct SentMesh {
  std::vector<std::uint32_t> vertices;
  Triangles triangles;
};

SentMesh sent_part(const Mesh& mesh) {
  constexpr auto kNone = std::numeric_limits<std::uint32_t>::max();
  SentMesh sent;
  std::vector<std::uint32_t> point_of(mesh.positions.size(), kNone);
  for (const auto& [a, b, c] : mesh.triangles) {
    if (a == b || b == c || c == a) continue;
    auto& triangle = sent.triangles.emplace_back();
    for (int corner = 0; const std::uint32_t vertex : {a, b, c}) {
      if (point_of[vertex] == kNone) {
        point_of[vertex] = static_cast<std::uint32_t>(sent.vertices.size());
        sent.vertices.push_back(vertex);
      }
      triangle[corner++] = point_of[vertex];
    }
  }
  return sent;
}

/// Adds an attribute with one value a point. value_of(vertex) gives a std::array of its components.
template <typename ValueOf>
int add_attribute(draco::Mesh& out, const SentMesh& sent, draco::GeometryAttribute::Type type, std::uint32_t unique_id,
                  draco::DataType data_type, ValueOf value_of) {
  const auto num_components = static_cast<std::uint8_t>(value_of(sent.vertices[0]).size());
  draco::GeometryAttribute attribute;
  attribute.Init(type, nullptr, num_components, data_type, false,
                 std::int64_t{draco::DataTypeLength(data_type)} * num_components, 0);
  const int id = out.AddAttribute(attribute, true, static_cast<std::uint32_t>(sent.vertices.size()));
  out.attribute(id)->set_unique_id(unique_id);
  for (std::uint32_t point = 0; point < sent.vertices.size(); ++point) {
    const auto value = value_of(sent.vertices[point]);
    out.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(point), value.data());
  }
  return id;
}

void quantise(draco::ExpertEncoder& encoder, int attribute, const Grid& grid, int num_components) {
  if (!grid.is_quantised()) return;
  // Draco's step is range / (2^bits - 1): exact in float32 for a power of two. Origin 0 makes the indices signed.
  const float origin[3] = {0, 0, 0};
  const double range = grid.step * (std::ldexp(1.0, grid.bits) - 1);
  encoder.SetAttributeExplicitQuantization(attribute, grid.bits, num_components, origin, static_cast<float>(range));

  // Draco keeps options as text with six decimals, which would change the range: write all its digits over it.
  char digits[32];
  std::snprintf(digits, sizeof digits, "%.17g", range);
  draco::Options options = *encoder.options().FindAttributeOptions(attribute);
  options.SetString("quantization_range", digits);
  encoder.options().SetAttributeOptions(attribute, options);
}

std::string encode(const Mesh& mesh, const MeshLayout& layout, const SentMesh& sent, std::string& problem) {
  // Copy the geometry: one point a vertex, so that connectivity is by vertex and not by position.
  using Type = draco::GeometryAttribute;
  draco::Mesh out;
  out.set_num_points(static_cast<std::uint32_t>(sent.vertices.size()));
  out.SetNumFaces(sent.triangles.size());
  for (std::uint32_t face = 0; face < sent.triangles.size(); ++face) {
    const auto& [a, b, c] = sent.triangles[face];
    out.SetFace(draco::FaceIndex(face), {draco::PointIndex(a), draco::PointIndex(b), draco::PointIndex(c)});
  }
  const int position = add_attribute(out, sent, Type::POSITION, kPositionId, draco::DT_FLOAT32, [&](std::uint32_t v) {
    const Vec3 p = mesh.positions[v] - layout.origin;
    return std::array{layout.positions.round(p.x), layout.positions.round(p.y), layout.positions.round(p.z)};
  });
  add_attribute(out, sent, Type::GENERIC, kVertexId, draco::DT_UINT32, [](std::uint32_t v) { return std::array{v}; });
  draco::ExpertEncoder encoder(out);
  quantise(encoder, position, layout.positions, 3);
  if (layout.has_normals) {
    const int normal = add_attribute(out, sent, Type::NORMAL, kNormalId, draco::DT_FLOAT32, [&](std::uint32_t v) {
      const Vec3 n = mesh.normals[v];
      return std::array{static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
    });
    encoder.SetAttributeQuantization(normal, kNormalBits);
  }
  const auto add_texcoord = [&](const std::optional<Grid>& grid, const std::vector<Vec2>& values, std::uint32_t id) {
    if (!grid) return;
    const int texcoord = add_attribute(out, sent, Type::TEX_COORD, id, draco::DT_FLOAT32, [&](std::uint32_t v) {
      return std::array{grid->round(values[v].x), grid->round(values[v].y)};
    });
    quantise(encoder, texcoord, *grid, 2);
  };
  add_texcoord(layout.texcoord0, mesh.texcoord0, kTexcoord0Id);
  add_texcoord(layout.texcoord1, mesh.texcoord1, kTexcoord1Id);
  if (layout.has_colors) {
    add_attribute(out, sent, Type::COLOR, kColorId, draco::DT_FLOAT32, [&](std::uint32_t v) {
      const Vec3 c = mesh.colors[v];
      return std::array{static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)};
    });
  }

  // All attributes are by vertex: one connectivity serves them all.
  encoder.SetSpeedOptions(kSpeed, kSpeed);
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  encoder.options().SetGlobalBool("split_mesh_on_seams", true);
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  if (!status.ok()) problem = status.error_msg_string();
  return {buffer.data(), buffer.size()};
}

}  // namespace

Triangles canonical_triangles(const Triangles& triangles) {
  Triangles sorted;
  sorted.reserve(triangles.size());
  for (auto triangle : triangles) {
    if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0]) continue;
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
    sorted.push_back(triangle);
  }
  std::sort(sorted.begin(), sorted.end());
  return sorted;
}

Result<std::string> encode_mesh(const Mesh& mesh, const MeshLayout& layout) {
  const SentMesh sent = sent_part(mesh);
  std::string problem;
  try {
    if (sent.triangles.empty()) return invalid_argument("mesh '" + mesh.name + "' has no triangle");
    std::string blob = encode(mesh, layout, sent, problem);
    if (problem.empty()) return blob;
  } catch (const std::exception& exception) {
    problem = exception.what();
  }
  return invalid_argument("mesh '" + mesh.name + "' cannot be encoded: " + problem);
}

}  // namespace radbake
