#pragma once

#include <string>

#include "client/gltf/load_model.h"
#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::gltf {

/// Triangles of a primitive in the coordinates of its mesh: vertices numbered and triangles ordered as in the file.
/// Name and material are the caller's to set.
///
/// Errors: kInvalidArgument, naming the accessor: index out of range, NaN or infinite, of a kind that is not read,
/// sparse, corrupt Draco.
Result<Mesh> read_primitive(const tinygltf::Model& model, const tinygltf::Primitive& primitive);

/// What a primitive will take in memory, known before any is taken.
struct PrimitiveSize {
  std::uint64_t num_vertices = 0;
  std::uint64_t num_triangles = 0;
};
PrimitiveSize size_of_primitive(const tinygltf::Model& model, const tinygltf::Primitive& primitive);

}  // namespace radbake::gltf
