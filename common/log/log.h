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
/// Inside a LogTrace both say which trace they belong to: " [trace ID]" at the end, "trace_id" before the message.
///
/// Errors: kInvalidArgument for a level that does not exist.
Result<void> set_up_log(const LogOptions& options);

/// Gives the lines that this thread logs during its life a trace id. An empty id leaves what an outer one said.
class LogTrace {
 public:
  explicit LogTrace(const std::string& trace_id);
  ~LogTrace();
  LogTrace(const LogTrace&) = delete;
  LogTrace& operator=(const LogTrace&) = delete;

 private:
  std::string outer_;
};

/// Gives every line of the program a trace id, where no LogTrace gives another: for a process with one task. To be
/// called before there are threads that log.
void set_program_trace(const std::string& trace_id);

}  // namespace radbake
