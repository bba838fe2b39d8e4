#include "client/cli/progress_line.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace radbake::cli {
namespace {

constexpr int kDefaultWidth = 80;
constexpr int kMaxBar = 30, kMinBar = 8;
constexpr std::size_t kStageWidth = 14;  // the longest of the stages that follow each other most often
constexpr std::size_t kPassWidth = 7;    // "pass 12"
constexpr std::size_t kTimeWidth = 22;
constexpr std::chrono::milliseconds kRedrawInterval{50};
constexpr std::chrono::seconds kPlainInterval{10};

int terminal_width() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kDefaultWidth;
}

}  // namespace

std::string format_seconds(double seconds) {
  const long long s = std::llround(std::clamp(seconds, 0.0, 1e9));
  char text[64];
  if (s < 60) {
    std::snprintf(text, sizeof text, "%lld s", s);
  } else if (s < 3600) {
    std::snprintf(text, sizeof text, "%lld min %02lld s", s / 60, s % 60);
  } else {
    std::snprintf(text, sizeof text, "%lld h %02lld min", s / 3600, s / 60 % 60);
  }
  return text;
}

std::string format_progress(const ProgressView& view, int width, bool has_color) {
  if (!(view.fraction >= 0)) return view.stage + " ...";
  const double fraction = std::min(view.fraction, 1.0);
  char percent[16];
  // Rounded down: 100 % is said when it is reached.
  std::snprintf(percent, sizeof percent, "%3d %%", static_cast<int>(fraction * 100));
  const bool has_detail = !view.detail.empty();
  const std::string time = view.seconds_left >= 0 ? format_seconds(view.seconds_left) + " left" : "";
  std::string after = has_detail ? "  " + view.detail : "";
  if (!time.empty()) after += (has_detail ? ", about " : "  ") + time;
  std::string name = view.stage;
  name.resize(std::max<std::size_t>(name.size(), has_detail ? kPassWidth : kStageWidth), ' ');

  // Blanks, brackets, percentage; and room for the longest time, so that the bar keeps its length.
  const std::size_t text = name.size() + 2 + 2 + 2 + 5 + std::max<std::size_t>(after.size() + 1, kTimeWidth);
  const int bar = std::min(kMaxBar, width - static_cast<int>(text));
  if (bar < kMinBar) {
    std::string line = name + "  " + percent + after;
    // A line that wraps cannot be drawn again.
    if (width > 0) line.resize(std::min<std::size_t>(line.size(), static_cast<std::size_t>(width) - 1));
    return line;
  }
  const int filled = static_cast<int>(fraction * bar);
  const std::string done(filled, '#'), open(bar - filled, '.');
  return name + "  [" + (has_color ? "\033[32m" + done + "\033[0m" : done) + open + "]  " + percent + after;
}

ProgressLine::ProgressLine() {
  const char* terminal = std::getenv("TERM");
  const char* no_color = std::getenv("NO_COLOR");
  is_terminal_ = isatty(STDERR_FILENO) && terminal != nullptr && std::string(terminal) != "dumb";
  has_color_ = is_terminal_ && (no_color == nullptr || *no_color == '\0');
}

void ProgressLine::show(const ProgressView& view) {
  const Clock::time_point now = Clock::now();
  const auto interval = is_terminal_ ? Clock::duration(kRedrawInterval) : Clock::duration(kPlainInterval);
  if (view.stage == stage_ && now - last_shown_ < interval) return;
  stage_ = view.stage;
  last_shown_ = now;
  if (is_terminal_) {
    const std::string line = format_progress(view, terminal_width(), has_color_);
    std::fprintf(stderr, "\r%s\033[K", line.c_str());
    is_shown_ = true;
  } else {
    // Without a bar and colours: for logs.
    std::fprintf(stderr, "%s\n", format_progress(view, 0, false).c_str());
  }
  std::fflush(stderr);
}

void ProgressLine::clear() {
  if (!is_shown_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  is_shown_ = false;
  stage_.clear();
}

}  // namespace radbake::cli
