#include "client/gltf/weld_vertices.h"

#include <bit>
#include <unordered_set>

#include "client/gltf/read_gltf.h"

namespace radbake::gltf {
namespace {

// Calls sink with every number of a vertex, as bits.
template <typename Sink>
void for_each_bits(const Mesh& mesh, std::uint32_t v, Sink&& sink) {
  const auto number = [&](double value) { sink(std::bit_cast<std::uint64_t>(value)); };
  for (const auto* vectors : {&mesh.positions, &mesh.normals, &mesh.colors}) {
    if (vectors->empty()) continue;
    number((*vectors)[v].x), number((*vectors)[v].y), number((*vectors)[v].z);
  }
  for (const auto* vectors : {&mesh.texcoord0, &mesh.texcoord1}) {
    if (vectors->empty()) continue;
    number((*vectors)[v].x), number((*vectors)[v].y);
  }
}

std::size_t hash_of(const Mesh& mesh, std::uint32_t v) {
  std::uint64_t hash = 0;
  // Multiplication carries low bits up, the shift brings them down again.
  for_each_bits(mesh, v, [&](std::uint64_t bits) {
    hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  });
  return hash;
}

bool are_equal(const Mesh& mesh, std::uint32_t a, std::uint32_t b) {
  std::array<std::uint64_t, 13> bits{};
  std::size_t n = 0;
  for_each_bits(mesh, a, [&](std::uint64_t value) { bits[n++] = value; });
  bool is_equal = true;
  n = 0;
  for_each_bits(mesh, b, [&](std::uint64_t value) { is_equal = bits[n++] == value && is_equal; });
  return is_equal;
}

template <typename Vector>
std::vector<Vector> picked(const std::vector<Vector>& values, const std::vector<std::uint32_t>& vertices) {
  std::vector<Vector> result;
  if (values.empty()) return result;
  result.reserve(vertices.size());
  for (const std::uint32_t vertex : vertices) result.push_back(values[vertex]);
  return result;
}

}  // namespace

Vec3 area_vector(const Mesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const Vec3 origin = mesh.positions[triangle[0]];
  return cross(mesh.positions[triangle[1]] - origin, mesh.positions[triangle[2]] - origin) * 0.5;
}

WeldedMesh weld_vertices(const Mesh& mesh) {
  WeldedMesh result;
  result.scene_vertex.assign(mesh.positions.size(), kNoVertex);
  // The first vertex of each kind that a triangle uses, and its number.
  const auto hash = [&](std::uint32_t v) { return hash_of(mesh, v); };
  const auto equal = [&](std::uint32_t a, std::uint32_t b) { return are_equal(mesh, a, b); };
  std::unordered_set<std::uint32_t, decltype(hash), decltype(equal)> kinds(mesh.positions.size(), hash, equal);
  std::vector<std::uint32_t> first;
  for (const auto& corners : mesh.triangles) {
    if (length(area_vector(mesh, corners)) == 0) {
      ++result.num_triangles_dropped;
      continue;
    }
    std::array<std::uint32_t, 3>& triangle = result.mesh.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      std::uint32_t& vertex = result.scene_vertex[corners[k]];
      if (vertex == kNoVertex) {
        const auto [kind, is_new] = kinds.insert(corners[k]);
        if (is_new) {
          vertex = static_cast<std::uint32_t>(first.size());
          first.push_back(corners[k]);
        } else {
          vertex = result.scene_vertex[*kind];
        }
      }
      triangle[k] = vertex;
    }
  }
  result.mesh.positions = picked(mesh.positions, first);
  result.mesh.normals = picked(mesh.normals, first);
  result.mesh.texcoord0 = picked(mesh.texcoord0, first);
  result.mesh.texcoord1 = picked(mesh.texcoord1, first);
  result.mesh.colors = picked(mesh.colors, first);
  return result;
}

}  // namespace radbake::gltf
