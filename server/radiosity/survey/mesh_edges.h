#pragma once

#include <cstdint>
#include <vector>

#include "server/radiosity/survey/surfaces.h"

namespace radbake::radiosity {

/// Normals nearer than a degree are one: light has no step there.
inline bool are_same_normal(Vec3 a, Vec3 b) {
  constexpr double kCosineOfOneDegree = 0.99984769515639127;
  return dot(a, b) >= kCosineOfOneDegree;
}

/// The triangles of a scene mesh: [begin, end) of the surfaces'.
struct MeshRange {
  std::uint32_t begin = 0, end = 0;
};

/// Shape: [scene meshes].
std::vector<MeshRange> mesh_ranges(const Surfaces& surfaces);

/// Two triangles of a mesh that meet at an edge, each from its own side, and at no third.
struct SharedEdge {
  std::uint32_t a = 0, b = 0;        ///< triangles
  int edge_of_a = 0, edge_of_b = 0;  ///< from corner k to corner k + 1
};

/// The shared edges of the triangles [begin, end), by position: vertices at one place are one. In the order of the
/// triangles.
std::vector<SharedEdge> shared_edges(const Surfaces& surfaces, std::uint32_t begin, std::uint32_t end);

}  // namespace radbake::radiosity
