#pragma once

#include <chrono>
#include <string>
#include <utility>
#include <vector>

#include "radbake/v1/result.pb.h"

namespace radbake::cli {

/// Seconds of the stages that follow each other.
class Stopwatch {
 public:
  /// Ends a stage: what went by since the last one ended.
  void end_stage(const std::string& name) {
    const Clock::time_point now = Clock::now();
    v1::StageSeconds& stage = stages_.emplace_back();
    stage.set_stage(name);
    stage.set_seconds(std::chrono::duration<double>(now - last_).count());
    last_ = now;
  }
  const std::vector<v1::StageSeconds>& stages() const { return stages_; }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point last_ = Clock::now();
  std::vector<v1::StageSeconds> stages_;
};

}  // namespace radbake::cli
