#pragma once

#include <chrono>
#include <string>

namespace radbake::cli {

/// A time left, for people: "8 s", "2 min 05 s", "3 h 10 min".
std::string format_seconds(double seconds);

/// What a line of progress tells.
struct ProgressView {
  std::string stage;
  double fraction = -1;      ///< negative: not known
  double seconds_left = -1;  ///< negative: not known
  std::string detail = {};   ///< what is known of the result so far
};

/// One line of progress: stage, bar, percentage, detail, time left where it is known.
/// `width`: columns of the terminal; the bar shrinks, then goes, then what is too long. 0: no bar, and no bound.
std::string format_progress(const ProgressView& view, int width, bool has_color);

/// Progress on stderr: a line that redraws itself on a terminal, else a plain line at each new stage and now and then.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  void show(const ProgressView& view);
  /// Takes the line off the terminal, so that other text may be printed.
  void clear();
  bool has_color() const { return has_color_; }

 private:
  using Clock = std::chrono::steady_clock;
  bool is_terminal_ = false;
  bool has_color_ = false;
  bool is_shown_ = false;
  std::string stage_;
  Clock::time_point last_shown_;
};

}  // namespace radbake::cli
