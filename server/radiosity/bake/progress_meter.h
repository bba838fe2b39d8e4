#pragma once

#include <chrono>
#include <mutex>

#include "server/radiosity/bake/bake.h"
#include "server/radiosity/bake/cpu_clock.h"

namespace radbake::radiosity {

/// Turns the steps of the stages into one fraction that never falls, and a time left.
/// The stages' shares are their numbers of rays; the estimate corrects itself as the bake goes on.
class ProgressMeter {
 public:
  using Clock = std::chrono::steady_clock;

  /// When a bake began: the wall clock and this process's CPU seconds.
  struct Start {
    Clock::time_point wall = Clock::now();
    double cpu_seconds = process_cpu_seconds();
  };

  /// The bake began at `start`; it is prepared and its rays are known by now.
  ProgressMeter(BakeObserver& observer, const Start& start, double row_rays, double gather_rays);

  /// From any thread. Calls the observer at most about 20 times a second, and at the end of each stage.
  void report(BakeStage stage, std::uint64_t done, std::uint64_t total, double residual = 0);
  /// Calls the observer with a tile, apart from all other calls.
  void tile(const Tile& tile);
  /// The wall and CPU times of the stages that have ended and of the one that runs.
  std::vector<StageTime> stage_times();

 private:
  void enter(BakeStage stage);

  BakeObserver& observer_;
  std::mutex mutex_;
  double row_share_;
  double gather_share_;
  double fraction_ = 0;
  BakeStage stage_ = BakeStage::kPreparing;
  Clock::time_point start_;
  Clock::time_point stage_start_;
  double stage_cpu_start_;
  Clock::time_point last_report_{};
  std::vector<StageTime> times_;
};

}  // namespace radbake::radiosity
