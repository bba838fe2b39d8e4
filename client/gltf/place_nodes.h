#pragma once

#include <vector>

#include "client/gltf/load_model.h"
#include "common/base/result.h"
#include "common/geometry/transform.h"

namespace radbake::gltf {

/// A node of the scene with its place in the world.
struct PlacedNode {
  int node = 0;
  Transform to_world;
};

/// The nodes of the default scene (else the first one, else all), parents before children.
///
/// Precondition: the node tree has no cycle. Errors: kInvalidArgument, naming the node whose matrix is not affine or
/// whose rotation is zero.
Result<std::vector<PlacedNode>> place_nodes(const tinygltf::Model& model);

/// "node 4 'Lamp'".
std::string node_name(const tinygltf::Model& model, int node);

}  // namespace radbake::gltf
