#pragma once

#include "client/gltf/entry.h"
#include "client/gltf/load_model.h"
#include "common/base/result.h"

namespace radbake::gltf {

/// The custom property of a node or mesh that says how fine its lightmap is: a factor on the bake's texels per metre.
/// Flat in `extras`, where exporters put what an artist adds to an object or its mesh.
inline constexpr const char* kTexelDensityKey = "radbake_texel_density";

/// Errors: kInvalidArgument, naming node or mesh and the value: no number from kMinTexelDensity to kMaxTexelDensity.
Result<void> check_texel_density(const Entry& node_or_mesh);

/// The factor of a mesh as a node places it: the node's own, else the mesh's, else 1.
double texel_density(const tinygltf::Node& node, const tinygltf::Mesh& mesh);

}  // namespace radbake::gltf
