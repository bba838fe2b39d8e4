#pragma once

#include <string>

#include "common/base/result.h"

namespace radbake {

/// How a program logs.
struct LogOptions {
  std::string program;         ///< in every line: radbaked, radbake-worker
  std::string level = "info";  ///< trace, debug, info, warning, error or off
  bool is_json = false;        ///< one JSON object a line instead of text
};

/// Sends spdlog's default logger to stderr, in the UTC clock. Each line is written at once and whole.
///
///   text: 2026-01-31T12:00:00.123Z info radbaked: message
///   JSON: {"time":"2026-01-31T12:00:00.123Z","level":"info","program":"radbaked","pid":7,"message":"message"}
///
/// Errors: kInvalidArgument for a level that does not exist.
Result<void> set_up_log(const LogOptions& options);

}  // namespace radbake
