#include <cstdio>

#include "client/cli/progress_line.h"
#include "client/cli/reached_error.h"
#include "client/cli/reporter.h"

namespace radbake::cli {
namespace {

class TextReporter final : public Reporter {
 public:
  void submitted(const v1::Bake& bake) override { print(bake.name() + "\n"); }

  void warning(const Warning& warning) override { say("warning: ", "33", warning.text); }

  void stage(const std::string& name, double fraction) override { line_.show({name, fraction}); }

  void watched(const v1::WatchBakeResponse& response) override {
    if (response.has_progress()) {
      show(response.progress());
    } else if (response.has_snapshot() && response.snapshot().state() < v1::SUCCEEDED) {
      const v1::Bake& bake = response.snapshot();
      if (bake.has_progress()) {
        show(bake.progress());
      } else {
        line_.show({stage_name(bake.state()), 0});
      }
    } else if (response.has_event() && response.event().attempt() > 1 && response.event().state() < v1::SUCCEEDED) {
      // Progress shows an ordinary change of state; that a bake starts again needs words.
      note(response.event().message());
    } else if (response.has_finished()) {
      line_.clear();
    }
  }

  void written(const std::string&, const std::filesystem::path& folder,
               const std::vector<std::string>& files) override {
    std::string text;
    for (const std::string& file : files) text += (folder / file).string() + "\n";
    print(text);
  }

  void answer(const std::string& text, const nlohmann::ordered_json&) override { print(text); }
  void note(const std::string& text) override { say("", "", text); }
  void failed(const Error& error, ExitCode) override { say("error: ", "31", error.message); }
  void set_trace(const std::string&) override {}

 private:
  void show(const v1::Progress& progress) {
    ProgressView view{stage_name(progress.state()), progress.fraction(), progress.seconds_left()};
    view.detail = progress_words(progress);
    // Once there is a whole map, passes over it follow each other faster than their stages can be read.
    const bool is_between = progress.state() > v1::QUEUED && progress.state() < v1::WRITING;
    if (!view.detail.empty() && is_between) view.stage = "pass " + std::to_string(progress.pass() + 1);
    line_.show(view);
  }

  void print(const std::string& text) {
    line_.clear();
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
  }

  void say(const std::string& label, const std::string& color, const std::string& text) {
    line_.clear();
    const bool is_coloured = line_.has_color() && !label.empty();
    const std::string shown = is_coloured ? "\033[" + color + "m" + label + "\033[0m" : label;
    std::fprintf(stderr, "radbake: %s%s\n", shown.c_str(), text.c_str());
  }

  ProgressLine line_;
};

}  // namespace

std::unique_ptr<Reporter> make_text_reporter() { return std::make_unique<TextReporter>(); }

std::string stage_name(v1::BakeState state) {
  switch (state) {
    case v1::QUEUED: return "queued";
    case v1::PREPARING: return "preparing";
    case v1::FORM_FACTORS: return "form factors";
    case v1::SOLVING: return "solving";
    case v1::GATHERING: return "gathering";
    case v1::WRITING: return "writing";
    case v1::SUCCEEDED: return "succeeded";
    case v1::FAILED: return "failed";
    case v1::CANCELLED: return "cancelled";
    default: return "waiting";
  }
}

}  // namespace radbake::cli
