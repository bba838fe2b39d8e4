#pragma once

#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "client/cli/exit_code.h"
#include "common/base/result.h"
#include "common/scene/scene.h"
#include "radbake/v1/bake.pb.h"

namespace radbake::cli {

/// Where a command's results go: stdout; and what is to be said meanwhile: stderr.
class Reporter {
 public:
  virtual ~Reporter() = default;

  virtual void submitted(const v1::Bake& bake) = 0;
  virtual void warning(const Warning& warning) = 0;
  /// The client's own stages. `fraction`: of this stage; negative where it is not known.
  virtual void stage(const std::string& name, double fraction) = 0;
  virtual void watched(const v1::WatchBakeResponse& response) = 0;
  virtual void written(const std::string& job, const std::filesystem::path& folder,
                       const std::vector<std::string>& files) = 0;
  /// The answer of a command that has one: as text, as JSON.
  virtual void answer(const std::string& text, const nlohmann::ordered_json& json) = 0;
  /// Something to know that is no result.
  virtual void note(const std::string& text) = 0;
  virtual void failed(const Error& error, ExitCode exit_code) = 0;
  /// What fails from now on is of this trace.
  virtual void set_trace(const std::string& trace_id) = 0;
};

/// For people: progress as a line that redraws itself, or as plain lines where stderr is no terminal.
std::unique_ptr<Reporter> make_text_reporter();

/// For programs. `is_stream`: one event a line, the first of which is "submitted" or "failed"; else one object in all.
/// `trace_id`: told with what was submitted and with what failed, unless that has a trace of its own.
std::unique_ptr<Reporter> make_json_reporter(bool is_stream, const std::string& trace_id);

/// A bake's state in words: "form factors".
std::string stage_name(v1::BakeState state);

}  // namespace radbake::cli
