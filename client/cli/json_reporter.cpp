#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "client/cli/proto_json.h"
#include "client/cli/reporter.h"

namespace radbake::cli {
namespace {

using Json = nlohmann::ordered_json;

class JsonReporter final : public Reporter {
 public:
  JsonReporter(bool is_stream, std::string trace_id) : is_stream_(is_stream), trace_id_(std::move(trace_id)) {}

  void submitted(const v1::Bake& bake) override {
    event("submitted", {{"trace_id", trace_id_}, {"bake", to_json(bake)}});
    is_submitted_ = true;
    for (const Warning& warning : held_) this->warning(warning);
    held_.clear();
  }

  void warning(const Warning& warning) override {
    // The job's name comes first.
    if (is_stream_ && !is_submitted_) {
      held_.push_back(warning);
    } else {
      event("warning", {{"id", warning.id}, {"text", warning.text}});
    }
  }

  void stage(const std::string&, double) override {}

  void watched(const v1::WatchBakeResponse& response) override {
    is_submitted_ = true;
    switch (response.kind_case()) {
      case v1::WatchBakeResponse::kSnapshot: return event("snapshot", {{"bake", to_json(response.snapshot())}});
      case v1::WatchBakeResponse::kEvent: return event("state", {{"change", to_json(response.event())}});
      case v1::WatchBakeResponse::kProgress: return event("progress", {{"progress", to_json(response.progress())}});
      case v1::WatchBakeResponse::kFinished: return event("finished", {{"bake", to_json(response.finished())}});
      default: return;
    }
  }

  void written(const std::string& job, const std::filesystem::path& folder,
               const std::vector<std::string>& files) override {
    const Json result = {{"bake", job}, {"folder", folder.string()}, {"files", files}};
    is_stream_ ? event("written", result) : print(result);
  }

  void answer(const std::string&, const Json& json) override { print(json); }
  void note(const std::string& text) override { std::fprintf(stderr, "radbake: %s\n", text.c_str()); }

  void failed(const Error& error, ExitCode exit_code) override {
    std::fprintf(stderr, "radbake: error: %s\n", error.message.c_str());
    const Json failure = {{"code", error_code_name(error.code)},
                          {"exit_code", static_cast<int>(exit_code)},
                          {"message", error.message},
                          {"trace_id", trace_id_}};
    is_stream_ ? event("failed", {{"error", failure}}) : print({{"error", failure}});
  }

  void set_trace(const std::string& trace_id) override { trace_id_ = trace_id; }

 private:
  void event(const std::string& name, const Json& fields) {
    if (!is_stream_) return;
    Json line = {{"event", name}};
    line.update(fields);
    print(line);
  }

  void print(const Json& json) {
    const std::string text = to_line(json) + "\n";
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
  }

  bool is_stream_;
  std::string trace_id_;
  bool is_submitted_ = false;
  std::vector<Warning> held_;
};

}  // namespace

std::unique_ptr<Reporter> make_json_reporter(bool is_stream, const std::string& trace_id) {
  return std::make_unique<JsonReporter>(is_stream, trace_id);
}

}  // namespace radbake::cli
