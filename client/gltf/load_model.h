#pragma once

#include <tiny_gltf.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "common/base/result.h"

namespace radbake::gltf {

/// Loads a checked document with tinygltf: typed objects, buffers and the encoded bytes of images (Image::image; empty
/// where an external image is missing, which is an error only once a material needs it).
///
/// tinygltf sees a copy without what we do not use (animations, skins, cameras, extras), so that a fault there stops
/// nobody. Of a primitive compressed by Draco, it sees no indices (it would refuse those without a buffer view); they
/// move to member "indices" of the primitive's KHR_draco_mesh_compression. See decode_draco for the reason.
///
/// Precondition: check_document() has passed. Errors: kInvalidArgument with what tinygltf says.
Result<tinygltf::Model> load_model(const nlohmann::json& document, const std::string& bin,
                                   const std::filesystem::path& folder);

}  // namespace radbake::gltf
