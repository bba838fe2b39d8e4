#pragma once

#include <string>

#include "client/gltf/load_model.h"
#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::gltf {

/// What a primitive holds.
struct FilePrimitive {
  /// In the coordinates of its mesh: vertices as in the file, triangles as primitive_triangles() numbers them.
  /// Name and material are the caller's to set.
  Mesh mesh;
  bool has_colors_out_of_range = false;  ///< COLOR_0 had values outside 0 to 1, which are limited to it
  bool has_translucent_colors = false;   ///< COLOR_0 has opacity below 1, which is not kept
};

/// Reads a primitive of triangles. `texcoord0_set`: which TEXCOORD_n becomes texcoord0; texcoord1 is TEXCOORD_1.
///
/// Errors: kInvalidArgument, naming the accessor: index out of range, NaN or infinite, of a kind that is not read,
/// corrupt Draco.
Result<FilePrimitive> read_primitive(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                     int texcoord0_set);

/// What a primitive will take in memory, known before any is taken.
struct PrimitiveSize {
  std::uint64_t num_vertices = 0;
  std::uint64_t num_triangles = 0;
};
PrimitiveSize size_of_primitive(const tinygltf::Model& model, const tinygltf::Primitive& primitive);

}  // namespace radbake::gltf
