#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "client/gltf/place_nodes.h"
#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::gltf {

/// The lamps of KHR_lights_punctual and the luminaires of EXT_lights_ies in the world: they shine along -Z of their
/// node, and its scale changes nothing but the direction; horizontal angle 0 of a luminaire is +X, 90 degrees +Y, also
/// where the node mirrors. Those without intensity are left out. Luminaires with one entry of the file share a profile.
///
/// folder: of the scene's file, in which files of intensities lie.
/// Units:  cd for point and spot, lx for directional, each times the lamp's colour.
/// Errors: kInvalidArgument, naming the node: its place or direction is not finite, or a spot's inner cone is not
///         inside its outer cone, or a file of intensities cannot be read.
Result<std::vector<Light>> read_lights(const tinygltf::Model& model, const std::filesystem::path& folder,
                                       std::span<const PlacedNode> nodes);

/// The bytes of a profile that is a file in the scene's folder, or a data URI in base64.
/// Errors: kInvalidArgument, as resolve_uri(), or above kMaxIesBytes.
Result<std::string> read_ies_uri(const std::filesystem::path& folder, const std::string& uri);

}  // namespace radbake::gltf
