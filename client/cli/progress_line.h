#pragma once

#include <chrono>
#include <string>

namespace radbake::cli {

/// A time left, for people: "8 s", "2 min 05 s", "3 h 10 min".
std::string format_seconds(double seconds);

/// One line of progress: stage, bar, percentage, time left where it is known.
/// `width`: columns of the terminal; the bar shrinks, then goes. `fraction`: negative where it is not known.
std::string format_progress(const std::string& stage, double fraction, double seconds_left, int width, bool has_color);

/// Progress on stderr: a line that redraws itself on a terminal, else a plain line at each new stage and now and then.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine() { clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// `seconds_left`: negative where it is not known.
  void show(const std::string& stage, double fraction, double seconds_left);
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
