#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/codec/grid.h"
#include "common/scene/scene.h"
#include "radbake/v1/scene.pb.h"

namespace radbake {

/// How the attributes of a mesh travel.
struct MeshLayout {
  Vec3 origin;
  Grid positions;
  bool has_normals = false;       ///< octahedral, 16 bits: turned by less than 1e-4 rad
  std::optional<Grid> texcoord0;  ///< absent: not sent
  std::optional<Grid> texcoord1;
  bool has_colors = false;  ///< float32
};

/// Unique ids of the attributes in a blob.
inline constexpr std::uint32_t kTexcoord0Id = 0;
inline constexpr std::uint32_t kTexcoord1Id = 1;
inline constexpr std::uint32_t kPositionId = 2;
inline constexpr std::uint32_t kNormalId = 3;
inline constexpr std::uint32_t kVertexId = 4;
inline constexpr std::uint32_t kColorId = 5;

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

/// The triangles with three different vertices, the smallest vertex of each first, sorted: the order of a decoded mesh.
Triangles canonical_triangles(const Triangles& triangles);

/// Encodes a mesh by Draco's edgebreaker. Vertices without a triangle and triangles with fewer than three different
/// vertices are not sent.
///
/// Precondition: indices are below positions.size(), positions and coordinates are finite.
/// Errors: kInvalidArgument when Draco refuses the mesh.
Result<std::string> encode_mesh(const Mesh& mesh, const MeshLayout& layout);

/// Decodes a mesh and holds it against its record. The blob is not trusted.
///
/// Vertices that no triangle uses come back at the origin.
/// Errors: kInvalidArgument; messages name the mesh and the value.
Result<Mesh> decode_mesh(const std::string& blob, const v1::MeshRecord& record, Vec3 origin);

}  // namespace radbake
