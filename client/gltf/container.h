#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "common/base/result.h"

namespace radbake::gltf {

/// The two parts of a glTF file.
struct Container {
  std::string json;
  std::string bin;  ///< the binary chunk of a .glb; else empty
};

/// Reads a whole regular file. Errors: kInvalidArgument if it is missing, not a file, or above max_bytes.
Result<std::string> read_file(const std::filesystem::path& path, std::uint64_t max_bytes);

/// Reads a .gltf or .glb file, told apart by their first bytes, and takes a .glb's chunks apart.
///
/// Errors: kInvalidArgument: not a glTF, truncated, a chunk beyond the end, above kMaxFileBytes.
/// Source: glTF 2.0, 4.4 (binary glTF layout).
Result<Container> read_container(const std::filesystem::path& path);

}  // namespace radbake::gltf
