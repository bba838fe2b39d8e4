#pragma once

#include <atomic>
#include <stop_token>
#include <thread>

namespace radbake::cli {

/// Turns Ctrl-C (SIGINT, SIGTERM, and SIGHUP unless it is ignored) into stop requests, so that everything that is to be
/// cleaned up is. The third signal ends the program at once.
///
/// Construct before any other thread is started: threads inherit the blocked signals.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// Requested by the first signal: stop and clean up.
  std::stop_token once() const { return once_.get_token(); }
  /// Requested by the second: stop waiting for others.
  std::stop_token twice() const { return twice_.get_token(); }

 private:
  void wait_for_signals();

  std::stop_source once_, twice_;
  std::atomic<bool> is_over_ = false;
  std::thread thread_;
};

}  // namespace radbake::cli
