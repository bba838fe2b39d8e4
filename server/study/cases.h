#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/base/result.h"

namespace radbake::study {

/// Reads a file that holds a list of JSON objects. Errors: kInvalidArgument with the file's name and what is wrong.
Result<nlohmann::ordered_json> read_cases(const std::filesystem::path& path);

/// Writes a text file, whole or not at all. Errors: kInternal with the file's name.
Result<void> write_text(const std::filesystem::path& path, const std::string& text);

/// A case's id as text.
std::string id_of(const nlohmann::ordered_json& result);

/// Counts judgements for the last line of a table.
class Tally {
 public:
  /// "pass", "FAIL", or "" where no answer is known.
  std::string judge(const nlohmann::ordered_json& result);
  /// The line of a case that has an error.
  std::string refuse(const nlohmann::ordered_json& result);
  /// `what`: cases, solves.
  std::string summary(const std::string& what) const;

 private:
  std::size_t passed_ = 0, judged_ = 0, refused_ = 0;
};

}  // namespace radbake::study
