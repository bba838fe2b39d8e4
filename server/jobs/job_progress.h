#pragma once

#include <cstdint>

#include "server/store/job_record.h"

namespace radbake::jobs {

/// How far a running job is, as its worker tells. Field for field radbake.v1.Progress.
struct JobProgress {
  store::JobState state = store::JobState::kPreparing;
  double fraction = 0;
  std::uint64_t steps_done = 0;
  std::uint64_t steps_total = 0;
  double seconds_left = -1;
  double residual = 0;
  std::uint32_t pass = 0;
  double relative_error = 0, relative_error_low = 0, relative_error_high = 0;
  double asked_error = 0;
};

}  // namespace radbake::jobs
