#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "radbake/v1/result.pb.h"
#include "server/radiosity/bake/bake.h"

namespace radbake::worker {

/// Which attempt at which job a process works on, and how long it took to come up.
struct WorkerIdentity {
  std::string job;
  std::uint32_t attempt = 1;
  double start_seconds =
      0;  ///< from the creation of the process, or from when it was told its job, to its first message
  std::vector<int> inputs = {};  ///< descriptors as they were handed over, in the order of StartWork.inputs; empty:
                                 ///< they were inherited under the numbers that it names
};

/// Seconds since the kernel created this process, in its ticks of 10 ms; 0 where /proc does not tell.
double seconds_since_process_start();

/// Takes the wall and CPU time of the stages that the worker adds to those of the bake.
class StageClock {
 public:
  /// Ends the running stage and begins another.
  void begin(const std::string& stage);
  /// Ends the running stage.
  void end();
  const std::vector<radiosity::StageTime>& stages() const { return stages_; }

 private:
  using Clock = std::chrono::steady_clock;
  std::string running_;
  Clock::time_point began_at_;
  double cpu_began_at_ = 0;
  std::vector<radiosity::StageTime> stages_;
};

/// Fills in what may differ between equal runs: this process's CPU time and peak memory, the host, the rest as given.
v1::RunReport run_report(const WorkerIdentity& identity, const std::vector<radiosity::StageTime>& stages,
                         double wall_seconds, std::uint32_t threads);

}  // namespace radbake::worker
