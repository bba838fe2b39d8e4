#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "client/gltf/place_nodes.h"
#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::gltf {

/// The lamps of KHR_lights_punctual and the luminaires of EXT_lights_ies in the world: they shine along -Z of their
/// node, and its scale changes nothing but the direction; horizontal angle 0 of a luminaire is +X, 90 degrees +Y. Those
/// without intensity are left out.
///
/// folder: of the scene's file, in which files of intensities lie.
/// Units:  cd for point and spot, lx for directional, each times the lamp's colour.
/// Errors: kInvalidArgument, naming the node: its place or direction is not finite, or a spot's inner cone is not
///         inside its outer cone, or a file of intensities cannot be read.
Result<std::vector<Light>> read_lights(const tinygltf::Model& model, const std::filesystem::path& folder,
                                       std::span<const PlacedNode> nodes);

}  // namespace radbake::gltf
