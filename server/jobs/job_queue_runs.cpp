// What runs: workers are started for jobs, and what becomes of all workers is recorded.

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "common/log/log.h"
#include "server/jobs/job_queue.h"
#include "server/store/failpoint.h"

namespace radbake::jobs {

using store::JobRecord;
using store::JobState;
using store::StateChange;

void JobQueue::line_up(const JobRecord& job) {
  waiting_.push({job.name, job.owner.tenant, job.owner.client, job.owner.priority, job.id});
}

void JobQueue::run_waiting_jobs() {
  while (!is_refusing_ && !is_draining_ && standstill_.empty() && !waiting_.is_empty() &&
         num_running_ < options_.max_running) {
    const Waiting next = waiting_.pop();
    turns_[next.name] = next;
    if (const auto job = find_live(next.name)) start_job(job);
  }
}

void JobQueue::add_run(const std::shared_ptr<WorkerRun>& run) {
  {
    const std::lock_guard lock(mutex_);
    runs_[run->assignment().job] = run;
  }
  runs_changed_.notify_all();
}

RunEvents JobQueue::ends_of(const std::string& name, std::uint32_t attempt) {
  RunEvents events;
  events.on_outcome = [this, name, attempt](WorkOutcome outcome) {
    thread_.post([this, name, attempt, outcome = std::move(outcome)] { end_work(name, attempt, outcome); });
  };
  events.on_exit = [this, name](const WorkerExit& exit) { thread_.post([this, name, exit] { end_run(name, exit); }); };
  return events;
}

RunEvents JobQueue::events_of(const std::shared_ptr<Job>& job, const std::shared_ptr<TileSpool>& spool) {
  const JobRecord record = job->record();
  const std::string& name = record.name;
  const std::uint32_t attempt = record.attempt;
  RunEvents events = ends_of(name, attempt);
  events.on_progress = [this, job, name, last = JobState::kPreparing](const JobProgress& progress) mutable {
    if (!is_running(progress.state)) return;
    if (std::exchange(last, progress.state) != progress.state) {
      thread_.post([this, name, state = progress.state] { advance(name, state); });
    }
    job->set_progress(progress);
  };
  events.on_tile = [job, spool, is_full = false](const std::string& tile) mutable {
    if (is_full) return;
    // Tiles are a preview: without room for them the bake itself goes on.
    if (auto appended = spool->append(tile); !appended.ok()) {
      is_full = true;
      spdlog::warn("no more tiles of this attempt are kept: {}", appended.error().message);
    }
    job->tile_arrived();
  };
  events.on_checkpoint = [this, name, attempt](const store::CheckpointRecord& checkpoint) {
    thread_.post([this, name, attempt, checkpoint] { keep_checkpoint(name, attempt, checkpoint); });
  };
  events.on_drop_checkpoints = [this, name, attempt](const std::vector<std::string>& names) {
    thread_.post([this, name, attempt, names] { drop_checkpoints(name, attempt, names); });
  };
  return events;
}

Result<std::shared_ptr<WorkerRun>> JobQueue::begin_attempt(const std::shared_ptr<Job>& job) {
  const JobRecord record = job->record();
  RADBAKE_ASSIGN_OR_RETURN(store::ContentStore * content, content_.of(record.owner.tenant));
  RADBAKE_ASSIGN_OR_RETURN(std::vector<store::CheckpointRecord> checkpoints, store_.checkpoints(record));
  std::erase_if(checkpoints, [&](const auto& left) { return !content->contains(left.digest); });
  RADBAKE_ASSIGN_OR_RETURN(std::shared_ptr<TileSpool> spool, TileSpool::create(options_.spool_folder));
  // The attempt is on disk before there is a worker that claims it.
  RADBAKE_RETURN_IF_ERROR(
      change(job, {.state = JobState::kPreparing, .message = "attempt " + std::to_string(record.attempt) + " starts"}));
  job->set_tiles(spool);
  const auto limit = options_.bake_limit.count() > 0 ? std::optional(options_.bake_limit) : std::nullopt;
  return std::make_shared<WorkerRun>(WorkerRun::Assignment{.job = record.name,
                                                           .attempt = record.attempt,
                                                           .work = record.work,
                                                           .time_limit = limit,
                                                           .accepted_unix_ms = record.created_unix_ms,
                                                           .trace_id = record.owner.trace_id,
                                                           .checkpoints = std::move(checkpoints)},
                                     options_.worker, *content, events_of(job, spool));
}

void JobQueue::start_job(const std::shared_ptr<Job>& job) {
  const JobRecord record = job->record();
  auto begun = begin_attempt(job);
  if (!begun.ok()) {
    waiting_.settle(turns_.extract(record.name).mapped(), 0);
    line_up(record);
    return stand_still(begun.error());
  }
  const std::shared_ptr<WorkerRun> run = std::move(begun).value();
  if (to_finish_.contains(record.name)) run->request_finish();
  add_run(run);
  ++num_running_;
  store::failpoint("worker.starting");
  if (auto started = run->start(*gate_, std::move(ready_)); !started.ok()) {
    if (started.error().code == ErrorCode::kUnavailable) {
      run->kill("could not be started: " + started.error().message, WorkerRun::Blame::kServer);
    } else {
      fail(job, started.error());
    }
    thread_.post([this, name = record.name] { end_run(name, {}); });
  }
  store::failpoint("worker.started");
}

void JobQueue::advance(const std::string& name, JobState state) {
  const std::shared_ptr<Job> job = find_live(name);
  if (!job) return;
  const JobRecord record = job->record();
  // Passes go through the stages again; the record tells the furthest that was come to, and progress the present one.
  if (!is_running(record.state) || record.state >= state) return;
  if (auto changed = change(job, {.state = state}); !changed.ok()) {
    spdlog::error("{}: {}", name, changed.error().message);
  }
}

Result<void> JobQueue::change_one(const std::shared_ptr<Job>& job, const StateChange& change) {
  const JobRecord before = job->record();
  const std::string& name = before.name;
  const LogTrace trace(before.owner.trace_id);
  const std::int64_t entered_unix_ms = job->entered_unix_ms();
  RADBAKE_ASSIGN_OR_RETURN(store::RecordedChange recorded, store_.append_event(name, change));
  const JobRecord& record = recorded.record;
  if (options_.observer != nullptr) {
    constexpr double kMsPerSecond = 1000;
    options_.observer->state_changed(before.state, record.state,
                                     static_cast<double>(recorded.event.unix_ms - entered_unix_ms) / kMsPerSecond);
  }
  spdlog::info("{} {} (attempt {}): {}", name, job_state_name(record.state), record.attempt,
               record.error ? record.error->message : change.message);
  const bool has_ended = is_terminal(record.state);
  remove_blobs(record.owner.tenant, recorded.unneeded);
  job->set_record(std::move(recorded.record), std::move(recorded.event));
  if (has_ended) {
    to_finish_.erase(name);
    if (const auto sharers = sharers_.find(scoped(before.owner.tenant, before.bake_key)); sharers != sharers_.end()) {
      std::erase(sharers->second, job);
      if (sharers->second.empty()) sharers_.erase(sharers);
    }
    const std::lock_guard lock(mutex_);
    live_.erase(name);
  }
  return {};
}

Result<void> JobQueue::change(const std::shared_ptr<Job>& job, StateChange change) {
  if (change.message.empty()) change.message = job_state_name(change.state);
  RADBAKE_RETURN_IF_ERROR(change_one(job, change));
  // What somebody ended early is not what the others wait for.
  if (change.state == JobState::kCancelled || !change.is_whole) {
    hand_over_followers(job);
    return {};
  }
  for (const auto& follower : job->followers()) {
    if (is_terminal(change.state)) leave_leader(follower);
    if (auto changed = change_one(follower, change); !changed.ok() && is_terminal(change.state)) {
      stand_still(changed.error());
      unsaved_.push_back({follower, change});
    }
  }
  return {};
}

void JobQueue::end_job(const std::shared_ptr<Job>& job, StateChange end) {
  if (auto changed = change(job, end); !changed.ok()) {
    stand_still(changed.error());
    unsaved_.push_back({job, std::move(end)});
  } else if (const auto run = find_run(job->name())) {
    run->accept();
  }
}

void JobQueue::fail(const std::shared_ptr<Job>& job, Error error) {
  end_job(job, {.state = JobState::kFailed, .message = error.message, .error = error});
}

bool JobQueue::is_unsaved(const std::shared_ptr<Job>& job) const {
  return std::any_of(unsaved_.begin(), unsaved_.end(), [&](const Unsaved& end) { return end.job == job; });
}

void JobQueue::queue_again(const std::shared_ptr<Job>& job, const std::string& why, bool has_failed) {
  const JobRecord record = job->record();
  StateChange again{.state = JobState::kQueued,
                    .message = why,
                    .attempt = record.attempt + (is_running(record.state) ? 1 : 0),
                    .failed_attempts = record.failed_attempts + (has_failed ? 1 : 0)};
  if (auto changed = change(job, again); !changed.ok()) {
    stand_still(changed.error());
    unsaved_.push_back({job, std::move(again)});
  } else if (!is_draining_) {
    line_up(record);
  }
}

void JobQueue::stand_still(const Error& problem) {
  {
    const std::lock_guard lock(mutex_);
    if (standstill_.empty()) spdlog::error("no bake starts for now: {}", problem.message);
    standstill_ = problem.message;
    tried_at_ = WorkerRun::Clock::now();
  }
  runs_changed_.notify_all();
}

void JobQueue::try_again() {
  if (standstill_.empty()) return;
  if (auto content = content_.of(""); !content.ok() || !(*content)->probe().ok()) return;
  while (!unsaved_.empty()) {
    const auto [job, end] = unsaved_.front();
    if (!change(job, end).ok()) return;
    unsaved_.pop_front();
    if (!is_terminal(end.state)) {
      line_up(job->record());
    } else if (const auto run = find_run(job->name())) {
      run->accept();
    }
  }
  if (!ready_ && !is_draining_) {
    auto worker = ReadyWorker::start(options_.worker);
    if (!worker.ok()) return;
    ready_ = std::move(worker).value();
  }
  {
    const std::lock_guard lock(mutex_);
    standstill_.clear();
  }
  spdlog::info("bakes start again");
  run_waiting_jobs();
}

void JobQueue::keep_checkpoint(const std::string& name, std::uint32_t attempt,
                               const store::CheckpointRecord& checkpoint) {
  const auto job = find_live(name);
  if (!job || job->record().attempt != attempt) return;
  // Without it the bake itself goes on.
  const JobRecord record = job->record();
  auto replaced = store_.put_checkpoint(record, checkpoint);
  if (!replaced.ok()) {
    spdlog::warn("{}: checkpoint '{}' is not kept: {}", name, checkpoint.name, replaced.error().message);
    return;
  }
  remove_blobs(record.owner.tenant, *replaced);
  store::failpoint("checkpoint.kept");
  job->forget_lost_attempts();
}

void JobQueue::drop_checkpoints(const std::string& name, std::uint32_t attempt, const std::vector<std::string>& names) {
  const auto job = find_live(name);
  if (!job) return;
  const JobRecord record = job->record();
  if (record.attempt != attempt) return;
  if (auto dropped = store_.drop_checkpoints(record, names); !dropped.ok()) {
    spdlog::warn("{}: old checkpoints stay: {}", name, dropped.error().message);
  } else {
    remove_blobs(record.owner.tenant, *dropped);
  }
}

void JobQueue::remove_blobs(const std::string& tenant, const std::vector<Digest>& blobs) {
  if (blobs.empty()) return;
  if (auto content = content_.of(tenant); content.ok()) {
    for (const Digest& blob : blobs) (*content)->remove(blob);
  }
}

void JobQueue::end_work(const std::string& name, std::uint32_t attempt, WorkOutcome outcome) {
  const auto run = find_run(name);
  // Late words of an attempt that was given up.
  if (!run || run->assignment().attempt != attempt) return;
  using Kind = WorkOutcome::Kind;
  if (plans_.contains(name)) {
    switch (outcome.kind) {
      case Kind::kSucceeded: finish_plan(name, std::move(outcome.result)); break;
      case Kind::kFailed: finish_plan(name, std::move(outcome.error)); break;
      case Kind::kCancelled: finish_plan(name, Error{ErrorCode::kCancelled, "cancelled"}); break;
    }
    run->accept();
    return;
  }
  const auto job = find_live(name);
  if (!job || is_unsaved(job)) return;
  store::failpoint("result.publishing");
  if (outcome.kind == Kind::kFailed) {
    fail(job, std::move(outcome.error));
  } else if (outcome.kind == Kind::kSucceeded) {
    end_job(job, {.state = JobState::kSucceeded,
                  .result = std::move(outcome.result),
                  .outputs = std::move(outcome.outputs),
                  .is_whole = !to_finish_.contains(name)});
  } else if (run->is_cancel_requested()) {
    end_job(job, {.state = JobState::kCancelled});
  } else {
    fail(job, internal_error("the worker stopped without being asked to"));
  }
  store::failpoint("result.published");
}

void JobQueue::end_run(const std::string& name, const WorkerExit& exit) {
  const auto run = find_run(name);
  if (!run) return;
  const std::string killed_because = run->kill_reason();
  const LogTrace trace(run->assignment().trace_id);
  const bool was_stopped = !killed_because.empty() && !exit.reason.empty();
  const std::string reason =
      "the worker " + (killed_because.empty() ? exit.reason : killed_because) + (was_stopped ? " and was stopped" : "");
  if (run->assignment().is_plan) {
    finish_plan(name, run->is_cancel_requested() ? Error{ErrorCode::kCancelled, "cancelled"} : internal_error(reason));
  } else {
    --num_running_;
    if (options_.observer != nullptr) options_.observer->attempt_ended(attempt_end_of(*run));
    end_turn(*run, exit);
  }
  // Whoever still lives here got no outcome from its worker.
  if (const auto job = find_live(name); job && !is_unsaved(job)) end_job_run(job, *run, reason);
  {
    const std::lock_guard lock(mutex_);
    runs_.erase(name);
  }
  runs_changed_.notify_all();
  run_waiting_jobs();
  make_worker_ready();
}

void JobQueue::end_turn(const WorkerRun& run, const WorkerExit& exit) {
  const auto turn = turns_.extract(run.assignment().job);
  if (!turn) return;
  const bool had_process = !exit.reason.empty();
  if (!had_process) return waiting_.settle(turn.mapped(), 0);
  constexpr double kNewest = 0.3, kLeastSeconds = 1e-3;
  const double seconds = std::max(run.seconds(), kLeastSeconds);
  // What is usual now comes first: else the first long bake after short ones would cost its client a night of turns.
  usual_seconds_ = usual_seconds_ ? *usual_seconds_ + kNewest * (seconds - *usual_seconds_) : seconds;
  waiting_.settle(turn.mapped(), seconds / *usual_seconds_);
}

void JobQueue::end_job_run(const std::shared_ptr<Job>& job, const WorkerRun& run, const std::string& reason) {
  const std::uint32_t failed = job->record().failed_attempts + 1;
  if (run.is_cancel_requested()) return end_job(job, {.state = JobState::kCancelled, .message = reason});
  if (is_draining_) return queue_again(job, "the server is stopping; goes on at its next start", false);
  switch (run.blame()) {
    case WorkerRun::Blame::kBake: return fail(job, internal_error(reason));
    case WorkerRun::Blame::kServer: stand_still(internal_error(reason)); return queue_again(job, reason, false);
    case WorkerRun::Blame::kWorker: break;
  }
  if (failed >= options_.max_failed_attempts) {
    return fail(job,
                internal_error(reason + (failed > 1 ? " (" + std::to_string(failed) + " attempts in a row)" : "")));
  }
  queue_again(job, reason + "; it goes on in another attempt", true);
}

}  // namespace radbake::jobs
