#pragma once

#include <array>
#include <chrono>
#include <mutex>

#include "server/radiosity/bake/bake.h"
#include "server/radiosity/bake/cpu_clock.h"

namespace radbake::radiosity {

/// Turns the steps of the stages of all passes into one fraction that never falls, and a time left.
/// Within a pass the stages' shares are their numbers of rays; the estimate corrects itself as the bake goes on.
class ProgressMeter {
 public:
  using Clock = std::chrono::steady_clock;

  /// When a bake began: the wall clock and this process's CPU seconds.
  struct Start {
    Clock::time_point wall = Clock::now();
    double cpu_seconds = process_cpu_seconds();
  };

  /// The bake began at `start`; it is prepared by now.
  ProgressMeter(BakeObserver& observer, const Start& start, double asked_error);

  /// A pass begins that takes a share of all that is left.
  void begin_pass(int pass, double share_of_rest, double row_rays, double gather_rays);
  /// From any thread. Calls the observer at most about 20 times a second, and at the end of each stage. Stages of later
  /// passes are all told as kGathering: what the caller sees never goes back.
  void report(BakeStage stage, std::uint64_t done, std::uint64_t total, double residual = 0);
  /// A share of the pass's rows was kept by an earlier attempt: what is done without work tells nothing of the time
  /// left.
  void recall_rows(double share);
  /// The map's error as the pass that ends leaves it.
  void end_pass(double relative_error, double low, double high);
  /// Calls the observer with a tile, apart from all other calls.
  void tile(const Tile& tile);
  /// The wall and CPU times of the stages, of all passes together.
  std::vector<StageTime> stage_times();
  double seconds() const;
  double cpu_seconds() const { return process_cpu_seconds() - start_.cpu_seconds; }

 private:
  void enter(BakeStage stage);

  BakeObserver& observer_;
  std::mutex mutex_;
  Start start_;
  double pass_begin_ = 0, pass_end_ = 1;  ///< fractions
  double row_share_ = 0, gather_share_ = 0;
  double recalled_ = 0;  ///< of the fraction
  BakeProgress progress_;
  BakeStage stage_ = BakeStage::kPreparing;
  Clock::time_point stage_start_;
  double stage_cpu_start_;
  Clock::time_point last_report_{};
  std::array<StageTime, 4> times_;
};

}  // namespace radbake::radiosity
