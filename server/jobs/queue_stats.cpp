#include <algorithm>

#include "server/jobs/job_queue.h"

// What the queue tells of itself, and how it comes to its end in good order.

namespace radbake::jobs {

QueueStats JobQueue::stats() const {
  const std::lock_guard lock(mutex_);
  QueueStats stats;
  std::uint64_t num_with_worker = 0;
  for (const auto& [name, run] : runs_) {
    ++(run->assignment().is_plan ? stats.num_plans : stats.num_running);
    num_with_worker += live_.contains(name);
  }
  stats.num_waiting = live_.size() - num_with_worker;
  return stats;
}

AttemptEnd JobQueue::attempt_end_of(const WorkerRun& run) const {
  // Whoever still lives here got no outcome from its worker, or the disk has not taken it yet.
  const auto job = find_live(run.assignment().job);
  if (!job || is_unsaved(job)) return AttemptEnd::kOutcome;
  if (run.is_cancel_requested()) return AttemptEnd::kCancelled;
  if (is_draining_) return AttemptEnd::kServerStopping;
  if (run.blame() == WorkerRun::Blame::kServer) return AttemptEnd::kServerFailed;
  return run.kill_reason().empty() ? AttemptEnd::kWorkerDied : AttemptEnd::kWorkerKilled;
}

bool JobQueue::will_finish_before(WorkerRun::Clock::time_point limit) const {
  const std::chrono::duration<double> left = limit - WorkerRun::Clock::now();
  return std::any_of(runs_.begin(), runs_.end(), [&](const auto& named_run) {
    const auto job = live_.find(named_run.first);
    if (job == live_.end()) return false;
    const Job::LatestProgress latest = job->second->progress();
    // Negative: the worker cannot tell yet.
    return latest.version > 0 && latest.progress.seconds_left >= 0 && latest.progress.seconds_left <= left.count();
  });
}

void JobQueue::refuse_new() {
  thread_.run([this] {
    const std::lock_guard lock(mutex_);
    is_refusing_ = true;
  });
}

void JobQueue::let_finish(std::chrono::milliseconds grace) {
  // Predictions change: look again, but not so often that it costs anything.
  constexpr std::chrono::milliseconds kLookInterval{20};
  const auto limit = WorkerRun::Clock::now() + grace;
  std::unique_lock lock(mutex_);
  while (will_finish_before(limit)) runs_changed_.wait_for(lock, kLookInterval);
}

}  // namespace radbake::jobs
