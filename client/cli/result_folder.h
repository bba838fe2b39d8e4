#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace radbake::cli {

/// Results on their way to a folder: built beside it, so that a reader never sees half of them.
///
/// A new folder appears by one rename, with all in it. Into a folder that exists the files are renamed one by one:
/// an old report.json goes first and the new one comes last, so where there is a report.json, it and the files that it
/// names are of one bake, also after a power loss.
class ResultFolder {
 public:
  /// Errors: kInvalidArgument when the folder is not empty (and `force` is not given), is no folder, or cannot be
  /// written to. Nothing is left behind then.
  static Result<ResultFolder> open(const std::filesystem::path& folder, bool force);
  /// Removes what was built, unless it was published.
  ~ResultFolder();
  ResultFolder(ResultFolder&& other) noexcept;
  ResultFolder& operator=(ResultFolder&&) = delete;

  /// Where to build: every file in here is published.
  const std::filesystem::path& building() const { return building_; }
  const std::filesystem::path& folder() const { return folder_; }

  /// Makes the files appear. Errors: kInternal with the file's name.
  Result<void> publish();

 private:
  ResultFolder() = default;
  std::filesystem::path folder_;
  std::filesystem::path building_;  ///< empty: published or moved from
  bool existed_ = false;
};

/// The report's name in a result folder.
inline constexpr char kReportName[] = "report.json";

}  // namespace radbake::cli
