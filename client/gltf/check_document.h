#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/gltf/entry.h"
#include "common/base/result.h"

namespace radbake::gltf {

/// Parses JSON with bounded depth and number of values.
Result<nlohmann::json> parse_json(const std::string& text);

/// Checks everything that the loader or we would otherwise trust: kinds, indices, sizes, ranges, extensions, URIs.
/// Sets each buffer's byteLength to the size of what it names (a file may be longer than what is used of it), and the
/// media type of its data URI to one that tinygltf knows.
///
/// After success every index is in range, every view lies inside its buffer, and every accessor inside its view.
/// Errors: kInvalidArgument with the guilty entry and value.
Result<void> check_document(nlohmann::json& document, const std::filesystem::path& folder, std::uint64_t bin_bytes);

// The parts of check_document, each in its own file.
Result<void> check_extensions(const Entry& root);
Result<void> check_buffers(nlohmann::json& document, const std::filesystem::path& folder, std::uint64_t bin_bytes);
Result<void> check_accessors(const Entry& root);
Result<void> check_meshes(const Entry& root);
Result<void> check_materials(const Entry& root);
Result<void> check_nodes(const Entry& root);
Result<void> check_lights(const Entry& root);

/// Extensions that are in use and that this version neither reads nor may leave out without effect on the light.
std::vector<std::string> ignored_extensions(const nlohmann::json& document);

/// Number of objects in a list of the file: 0 if it is absent.
std::size_t list_size(const Entry& root, const char* key);

}  // namespace radbake::gltf
