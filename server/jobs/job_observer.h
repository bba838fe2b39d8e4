#pragma once

#include "server/store/job_record.h"

namespace radbake::jobs {

/// How a worker's attempt at a job ended.
enum class AttemptEnd {
  kOutcome,         ///< the worker reported one, good or bad
  kCancelled,       ///< as it was asked to
  kServerStopping,  ///< the job goes back to the queue
  kWorkerDied,      ///< by itself, without an outcome
  kWorkerKilled,    ///< it overstepped one of its limits
  kServerFailed,    ///< could not start it or keep what it sent
};

/// Is told what becomes of jobs, for numbers about them. Calls come from the queue's thread and must be quick.
class JobObserver {
 public:
  virtual ~JobObserver() = default;
  /// A job leaves a state after so many seconds in it; it is recorded already.
  virtual void state_changed(store::JobState from, store::JobState to, double seconds_in_from) = 0;
  virtual void attempt_ended(AttemptEnd end) = 0;
  /// A submit that was, or was not, answered by a bake that has ended or runs.
  virtual void cache_looked_up(bool is_hit) = 0;
};

}  // namespace radbake::jobs
