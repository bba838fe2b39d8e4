#pragma once

#include <atomic>
#include <stop_token>
#include <thread>

namespace radbake::cli {

/// Turns Ctrl-C (SIGINT) into stop requests, so that everything that is to be cleaned up is. SIGTERM, and SIGHUP unless
/// it is ignored, count for the first two: who sends them does not wait for results. One signal more than there are
/// tokens ends the program at once.
///
/// Construct before any other thread is started: threads inherit the blocked signals.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// Requested by the first signal: end with what there is, or stop where there is nothing yet.
  std::stop_token once() const { return once_.get_token(); }
  /// Requested by the second: stop and clean up.
  std::stop_token twice() const { return twice_.get_token(); }
  /// Requested by the third: stop waiting for others.
  std::stop_token thrice() const { return thrice_.get_token(); }

 private:
  void wait_for_signals();

  std::stop_source once_, twice_, thrice_;
  std::atomic<bool> is_over_ = false;
  std::thread thread_;
};

}  // namespace radbake::cli
