#pragma once

#include <filesystem>
#include <string>

#include "common/base/result.h"

namespace radbake::gltf {

/// The file that a URI names. Only files inside the folder are given out, symbolic links followed: a scene from
/// somebody else must not make a client upload other files of its machine.
///
/// Errors: kInvalidArgument for a scheme, an absolute path, "..", or a file that is missing or outside the folder.
Result<std::filesystem::path> resolve_uri(const std::filesystem::path& folder, const std::string& uri);

/// The same for a path relative to the folder, without escapes.
Result<std::filesystem::path> resolve_path(const std::filesystem::path& folder, const std::filesystem::path& relative);

}  // namespace radbake::gltf
