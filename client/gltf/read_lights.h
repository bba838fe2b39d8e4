#pragma once

#include <span>
#include <vector>

#include "client/gltf/place_nodes.h"
#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::gltf {

/// The lamps of KHR_lights_punctual in the world: they shine along -Z of their node, and its scale changes nothing but
/// the direction. Lamps without intensity are left out.
///
/// Units:  cd for point and spot, lx for directional, each times the lamp's colour.
/// Errors: kInvalidArgument, naming the node: its place or direction is not finite, or a spot's inner cone is not
///         inside its outer cone.
Result<std::vector<Light>> read_lights(const tinygltf::Model& model, std::span<const PlacedNode> nodes);

}  // namespace radbake::gltf
