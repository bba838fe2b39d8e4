#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "common/base/result.h"

namespace radbake::study {

/// Reads a file that holds a list of JSON objects. Errors: kInvalidArgument with the file's name and what is wrong.
Result<nlohmann::ordered_json> read_cases(const std::filesystem::path& path);

/// Writes a text file, whole or not at all. Errors: kInternal with the file's name.
Result<void> write_text(const std::filesystem::path& path, const std::string& text);

}  // namespace radbake::study
