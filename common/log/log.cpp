#include "common/log/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

namespace radbake {
namespace {

thread_local std::string thread_trace;
std::string program_trace;

/// Control characters as spaces: what a client wrote must not look like a line of ours.
std::string in_one_line(std::string text) {
  std::replace_if(
      text.begin(), text.end(), [](unsigned char letter) { return letter < 0x20 || letter == 0x7f; }, ' ');
  return text;
}

/// Formats a line as text or as a JSON object. spdlog's own patterns do not escape the message.
class LineFormatter : public spdlog::formatter {
 public:
  LineFormatter(std::string program, bool is_json) : program_(std::move(program)), is_json_(is_json) {}

  void format(const spdlog::details::log_msg& line, spdlog::memory_buf_t& out) override {
    const auto since_epoch = line.time.time_since_epoch();
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(since_epoch);
    const auto millis = std::chrono::duration_cast<std::chrono::milliseconds>(since_epoch - seconds);
    const std::time_t clock = seconds.count();
    std::tm utc{};
    gmtime_r(&clock, &utc);
    const std::string time =
        fmt::format("{:04}-{:02}-{:02}T{:02}:{:02}:{:02}.{:03}Z", utc.tm_year + 1900, utc.tm_mon + 1, utc.tm_mday,
                    utc.tm_hour, utc.tm_min, utc.tm_sec, millis.count());
    const auto level_view = spdlog::level::to_string_view(line.level);
    const std::string level(level_view.data(), level_view.size());
    const std::string message(line.payload.data(), line.payload.size());
    const std::string& trace = thread_trace.empty() ? program_trace : thread_trace;
    std::string text;
    if (is_json_) {
      nlohmann::ordered_json object = {{"time", time}, {"level", level}, {"program", program_}, {"pid", getpid()}};
      if (!trace.empty()) object["trace_id"] = trace;
      object["message"] = message;
      text = object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    } else {
      text = fmt::format("{} {} {}: {}{}\n", time, level, program_, in_one_line(message),
                         trace.empty() ? "" : " [trace " + trace + "]");
    }
    out.append(text.data(), text.data() + text.size());
  }

  std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<LineFormatter>(program_, is_json_);
  }

 private:
  std::string program_;
  bool is_json_;
};

}  // namespace

Result<void> set_up_log(const LogOptions& options) {
  // from_str answers "off" for what it does not know.
  const spdlog::level::level_enum level = spdlog::level::from_str(options.level);
  if (level == spdlog::level::off && options.level != "off") {
    return invalid_argument("log level '" + options.level + "' is none of trace, debug, info, warning, error, off");
  }
  try {
    auto logger = std::make_shared<spdlog::logger>(options.program, std::make_shared<spdlog::sinks::stderr_sink_mt>());
    logger->set_formatter(std::make_unique<LineFormatter>(options.program, options.is_json));
    logger->set_level(level);
    logger->flush_on(spdlog::level::trace);
    spdlog::set_default_logger(std::move(logger));
  } catch (const std::exception& problem) {
    return internal_error(std::string("log: ") + problem.what());
  }
  return {};
}

LogTrace::LogTrace(const std::string& trace_id) : outer_(thread_trace) {
  if (!trace_id.empty()) thread_trace = trace_id;
}

LogTrace::~LogTrace() { thread_trace = std::move(outer_); }

void set_program_trace(const std::string& trace_id) { program_trace = trace_id; }

}  // namespace radbake
