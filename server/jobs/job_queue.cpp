#include "server/jobs/job_queue.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "common/log/log.h"

namespace radbake::jobs {

using store::JobRecord;
using store::JobState;
using store::StateChange;

JobQueue::JobQueue(QueueOptions options, store::JobStore& jobs, store::ContentStore& content)
    : options_(std::move(options)), store_(jobs), content_(content) {}

JobQueue::~JobQueue() {
  drain();
  watchdog_ = {};
}

Result<void> JobQueue::start(WorkerGate& gate) {
  gate_ = &gate;
  raise_open_file_limit();
  watchdog_ = std::jthread([this](std::stop_token stop) { watch_limits(stop); });
  RADBAKE_RETURN_IF_ERROR(thread_.run([this] { return recover(); }));
  has_recovered_ = true;
  return {};
}

Result<void> JobQueue::check_recovered() const {
  if (has_recovered_) return {};
  return Error{ErrorCode::kUnavailable, "the server is starting and takes up its bakes: try again"};
}

Result<void> JobQueue::recover() {
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<JobRecord> records, store_.unfinished());
  for (const JobRecord& record : records) {
    RADBAKE_ASSIGN_OR_RETURN(std::vector<store::JobEvent> events, store_.events_after(record.name, 0));
    const auto job = std::make_shared<Job>(record, std::move(events));
    {
      const std::lock_guard lock(mutex_);
      live_[record.name] = job;
    }
    if (is_running(record.state)) {
      const std::uint32_t lost = record.lost_attempts + 1;
      if (lost >= options_.max_lost_attempts) {
        RADBAKE_RETURN_IF_ERROR(change(job, {JobState::kFailed, record.attempt, lost, "given up", "",
                                             internal_error("the server ended unexpectedly " + std::to_string(lost) +
                                                            " times while this bake ran; the limit is " +
                                                            std::to_string(options_.max_lost_attempts))}));
        continue;
      }
      RADBAKE_RETURN_IF_ERROR(change(job, {JobState::kQueued, record.attempt + 1, lost,
                                           "the server ended unexpectedly; queued again", "", std::nullopt}));
    }
    waiting_.push_back(job);
  }
  run_waiting_jobs();
  thread_.post([this] { make_worker_ready(); });
  return {};
}

void JobQueue::make_worker_ready() {
  // Not beside work, which it would take time from.
  if (!options_.keeps_worker_ready || ready_ || is_refusing_ || is_draining_ || !runs_.empty()) return;
  auto worker = ReadyWorker::start(options_.worker);
  if (worker.ok()) {
    ready_ = std::move(worker).value();
  } else {
    spdlog::warn("no worker could be started ahead of need: {}", worker.error().message);
  }
}

Result<std::shared_ptr<Job>> JobQueue::find_request(const std::string& request_id, const std::string& body_sha256) {
  RADBAKE_RETURN_IF_ERROR(check_recovered());
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<JobRecord> record, store_.find_request(request_id, body_sha256));
  if (!record) return std::shared_ptr<Job>();
  return find(record->name);
}

Result<std::shared_ptr<Job>> JobQueue::submit(const store::NewJob& job) {
  return thread_.run([&] { return accept_job(job); });
}

Result<std::shared_ptr<Job>> JobQueue::accept_job(const store::NewJob& new_job) {
  RADBAKE_ASSIGN_OR_RETURN(const std::shared_ptr<Job> known, find_request(new_job.request_id, new_job.body_sha256));
  if (known) return known;
  if (is_refusing_ || is_draining_) {
    return Error{ErrorCode::kUnavailable, "the server is stopping: submit again later"};
  }
  if (waiting_.size() >= options_.max_queued) {
    return Error{ErrorCode::kResourceExhausted, std::to_string(waiting_.size()) +
                                                    " bakes are waiting, max_queued_bakes is " +
                                                    std::to_string(options_.max_queued)};
  }
  RADBAKE_ASSIGN_OR_RETURN(JobRecord record, store_.create(new_job));
  record.trace_id = new_job.trace_id;
  const LogTrace trace(record.trace_id);
  RADBAKE_ASSIGN_OR_RETURN(std::vector<store::JobEvent> events, store_.events_after(record.name, 0));
  const auto job = std::make_shared<Job>(record, std::move(events));
  {
    const std::lock_guard lock(mutex_);
    live_[record.name] = job;
  }
  waiting_.push_back(job);
  spdlog::info("{} queued: '{}', bake key {}", record.name, record.label, record.bake_key);
  // The answer to the submit does not wait for the worker's start.
  thread_.post([this] { run_waiting_jobs(); });
  return job;
}

std::shared_ptr<Job> JobQueue::find_live(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = live_.find(name);
  return found == live_.end() ? nullptr : found->second;
}

std::shared_ptr<WorkerRun> JobQueue::find_run(const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = runs_.find(name);
  return found == runs_.end() ? nullptr : found->second;
}

Result<std::shared_ptr<Job>> JobQueue::find(const std::string& name) {
  RADBAKE_RETURN_IF_ERROR(check_recovered());
  if (auto live = find_live(name)) return live;
  // It has ended, or never was: a view of what is stored.
  RADBAKE_ASSIGN_OR_RETURN(JobRecord record, store_.get(name));
  RADBAKE_ASSIGN_OR_RETURN(std::vector<store::JobEvent> events, store_.events_after(name, 0));
  return std::make_shared<Job>(std::move(record), std::move(events));
}

Result<std::vector<JobRecord>> JobQueue::list(std::uint32_t num_jobs, std::int64_t before_id) {
  return store_.list(num_jobs, before_id);
}

Job::LatestProgress JobQueue::progress_of(const std::string& name) const {
  const auto live = find_live(name);
  return live ? live->progress() : Job::LatestProgress{};
}

Result<std::shared_ptr<Job>> JobQueue::cancel(const std::string& name) {
  RADBAKE_ASSIGN_OR_RETURN(std::shared_ptr<Job> job, find(name));
  RADBAKE_RETURN_IF_ERROR(thread_.run([&] { return cancel_live(name); }));
  return job;
}

void JobQueue::request_cancel(WorkerRun& run) {
  run.request_cancel();
  // Lets the watchdog look more often from now on. Under the lock, so that it is not between its look and its wait.
  const std::lock_guard lock(mutex_);
  runs_changed_.notify_all();
}

Result<void> JobQueue::cancel_live(const std::string& name) {
  const std::shared_ptr<Job> job = find_live(name);
  if (!job) return {};
  if (const auto run = find_run(name)) {
    request_cancel(*run);
    return {};
  }
  std::erase(waiting_, job);
  const JobRecord record = job->record();
  return change(job, {JobState::kCancelled, record.attempt, record.lost_attempts, "cancelled before it ran", "", {}});
}

Result<std::shared_ptr<Job>> JobQueue::finish(const std::string& name) {
  RADBAKE_ASSIGN_OR_RETURN(std::shared_ptr<Job> job, find(name));
  thread_.run([&] { finish_live(name); });
  return job;
}

void JobQueue::finish_live(const std::string& name) {
  if (!find_live(name)) return;
  to_finish_.insert(name);
  if (const auto run = find_run(name)) run->request_finish();
}

void JobQueue::run_waiting_jobs() {
  while (!is_refusing_ && !is_draining_ && !waiting_.empty() && num_running_ < options_.max_running) {
    const std::shared_ptr<Job> job = waiting_.front();
    waiting_.pop_front();
    start_job(job);
  }
}

void JobQueue::add_run(const std::shared_ptr<WorkerRun>& run) {
  {
    const std::lock_guard lock(mutex_);
    runs_[run->assignment().job] = run;
  }
  runs_changed_.notify_all();
}

void JobQueue::start_job(const std::shared_ptr<Job>& job) {
  const JobRecord record = job->record();
  const std::string name = record.name;
  // The attempt is on disk before there is a worker that claims it.
  if (auto changed = change(job, {JobState::kPreparing,
                                  record.attempt,
                                  record.lost_attempts,
                                  "attempt " + std::to_string(record.attempt) + " starts",
                                  "",
                                  {}});
      !changed.ok()) {
    return fail(job, changed.error());
  }
  auto spool = TileSpool::create(options_.spool_folder);
  if (!spool.ok()) return fail(job, spool.error());
  job->set_tiles(*spool);

  RunEvents events;
  events.on_progress = [this, job, last = JobState::kPreparing](const JobProgress& progress) mutable {
    if (!is_running(progress.state)) return;
    if (std::exchange(last, progress.state) != progress.state) {
      thread_.post([this, name = job->record().name, state = progress.state] { advance(name, state); });
    }
    job->set_progress(progress);
  };
  events.on_tile = [job, spool = *spool, is_full = false](const std::string& tile) mutable {
    if (is_full) return;
    // Tiles are a preview: without room for them the bake itself goes on.
    if (auto appended = spool->append(tile); !appended.ok()) {
      is_full = true;
      spdlog::warn("no more tiles of this attempt are kept: {}", appended.error().message);
    }
    job->tile_arrived();
  };
  events.on_outcome = [this, name](WorkOutcome outcome) {
    thread_.post([this, name, outcome = std::move(outcome)] { end_work(name, outcome); });
  };
  events.on_exit = [this, name](const WorkerExit& exit) { thread_.post([this, name, exit] { end_run(name, exit); }); };
  const auto run =
      std::make_shared<WorkerRun>(WorkerRun::Assignment{name, record.attempt, false, record.work, std::nullopt,
                                                        record.created_unix_ms, record.trace_id},
                                  options_.worker, content_, std::move(events));
  if (to_finish_.contains(name)) run->request_finish();
  add_run(run);
  ++num_running_;
  if (auto started = run->start(*gate_, std::move(ready_)); !started.ok()) {
    fail(job, started.error());
    end_run(name, {});
  }
}

void JobQueue::advance(const std::string& name, JobState state) {
  const std::shared_ptr<Job> job = find_live(name);
  if (!job) return;
  const JobRecord record = job->record();
  // Passes go through the stages again; the record tells the furthest that was come to, and progress the present one.
  if (!is_running(record.state) || record.state >= state) return;
  if (auto changed = change(job, {state, record.attempt, record.lost_attempts, "", "", {}}); !changed.ok()) {
    spdlog::error("{}: {}", name, changed.error().message);
  }
}

Result<void> JobQueue::change(const std::shared_ptr<Job>& job, StateChange change) {
  const JobRecord before = job->record();
  const std::string& name = before.name;
  const LogTrace trace(before.trace_id);
  if (change.message.empty()) change.message = job_state_name(change.state);
  const std::int64_t entered_unix_ms = job->entered_unix_ms();
  RADBAKE_ASSIGN_OR_RETURN(store::RecordedChange recorded, store_.append_event(name, change));
  recorded.record.trace_id = before.trace_id;
  const JobRecord& record = recorded.record;
  if (options_.observer != nullptr) {
    constexpr double kMsPerSecond = 1000;
    options_.observer->state_changed(before.state, record.state,
                                     static_cast<double>(recorded.event.unix_ms - entered_unix_ms) / kMsPerSecond);
  }
  spdlog::info("{} {} (attempt {}): {}", name, job_state_name(record.state), record.attempt,
               record.error ? record.error->message : change.message);
  const bool has_ended = is_terminal(record.state);
  job->set_record(std::move(recorded.record), std::move(recorded.event));
  if (has_ended) {
    to_finish_.erase(name);
    const std::lock_guard lock(mutex_);
    live_.erase(name);
  }
  return {};
}

void JobQueue::fail(const std::shared_ptr<Job>& job, Error error) {
  const JobRecord record = job->record();
  const auto stored = change(job, {JobState::kFailed, record.attempt, record.lost_attempts, error.message, "", error});
  if (stored.ok()) return;
  // The disk refuses even this. Tell the watchers; the next start of the server runs the job again.
  spdlog::error("{} failed and cannot be recorded: {}", record.name, stored.error().message);
  job->close();
  const std::lock_guard lock(mutex_);
  live_.erase(record.name);
}

void JobQueue::end_work(const std::string& name, WorkOutcome outcome) {
  const auto run = find_run(name);
  if (plans_.contains(name)) {
    switch (outcome.kind) {
      case WorkOutcome::Kind::kSucceeded: finish_plan(name, std::move(outcome.result)); break;
      case WorkOutcome::Kind::kFailed: finish_plan(name, std::move(outcome.error)); break;
      case WorkOutcome::Kind::kCancelled: finish_plan(name, Error{ErrorCode::kCancelled, "cancelled"}); break;
    }
  } else if (const auto job = find_live(name)) {
    const JobRecord record = job->record();
    StateChange end{JobState::kSucceeded, record.attempt, record.lost_attempts, "", "", {}};
    if (outcome.kind == WorkOutcome::Kind::kCancelled) {
      end.state = JobState::kCancelled;
      if (!run || !run->is_cancel_requested()) {
        outcome = {WorkOutcome::Kind::kFailed, "", internal_error("the worker stopped without being asked to")};
      }
    }
    if (outcome.kind == WorkOutcome::Kind::kSucceeded) end.result = std::move(outcome.result);
    if (outcome.kind == WorkOutcome::Kind::kFailed) {
      fail(job, std::move(outcome.error));
    } else if (auto changed = change(job, std::move(end)); !changed.ok()) {
      fail(job, changed.error());
    }
  }
  if (run) run->accept();
}

void JobQueue::end_run(const std::string& name, const WorkerExit& exit) {
  const auto run = find_run(name);
  if (!run) return;
  const std::string killed_because = run->kill_reason();
  const LogTrace trace(run->assignment().trace_id);
  const std::string reason =
      "the worker " + (killed_because.empty() ? exit.reason : killed_because + " and was stopped");
  if (run->assignment().is_plan) {
    finish_plan(name, run->is_cancel_requested() ? Error{ErrorCode::kCancelled, "cancelled"} : internal_error(reason));
  } else {
    --num_running_;
    if (options_.observer != nullptr) options_.observer->attempt_ended(attempt_end_of(*run));
    // Whoever still lives here got no outcome from its worker.
    if (const auto job = find_live(name)) {
      const JobRecord record = job->record();
      if (run->is_cancel_requested()) {
        if (auto changed = change(job, {JobState::kCancelled, record.attempt, record.lost_attempts, reason, "", {}});
            !changed.ok()) {
          fail(job, changed.error());
        }
      } else if (is_draining_) {
        if (auto changed = change(job, {JobState::kQueued,
                                        record.attempt + 1,
                                        record.lost_attempts,
                                        "the server is stopping; runs again at its next start",
                                        "",
                                        {}});
            !changed.ok()) {
          spdlog::error("{}: {}", name, changed.error().message);
        }
      } else {
        fail(job, internal_error(reason));
      }
    }
  }
  {
    const std::lock_guard lock(mutex_);
    runs_.erase(name);
  }
  runs_changed_.notify_all();
  run_waiting_jobs();
  make_worker_ready();
}

Result<std::string> JobQueue::start_plan(const store::Work& work, const std::string& trace_id, PlanDone on_done) {
  RADBAKE_RETURN_IF_ERROR(check_recovered());
  return thread_.run([&] { return start_plan_run(work, trace_id, std::move(on_done)); });
}

Result<std::string> JobQueue::start_plan_run(const store::Work& work, const std::string& trace_id, PlanDone on_done) {
  if (is_refusing_ || is_draining_) return Error{ErrorCode::kUnavailable, "the server is stopping: plan again later"};
  if (plans_.size() >= options_.max_running_plans) {
    return Error{ErrorCode::kResourceExhausted, std::to_string(plans_.size()) +
                                                    " plans are being made, max_running_plans is " +
                                                    std::to_string(options_.max_running_plans)};
  }
  const std::string name = "plans/" + std::to_string(next_plan_++);
  RunEvents events;
  events.on_progress = [](const JobProgress&) {};
  events.on_tile = [](const std::string&) {};
  events.on_outcome = [this, name](WorkOutcome outcome) {
    thread_.post([this, name, outcome = std::move(outcome)] { end_work(name, outcome); });
  };
  events.on_exit = [this, name](const WorkerExit& exit) { thread_.post([this, name, exit] { end_run(name, exit); }); };
  const auto run =
      std::make_shared<WorkerRun>(WorkerRun::Assignment{name, 1, true, work, options_.plan_limit, 0, trace_id},
                                  options_.worker, content_, std::move(events));
  add_run(run);
  if (auto started = run->start(*gate_, std::move(ready_)); !started.ok()) {
    const std::lock_guard lock(mutex_);
    runs_.erase(name);
    return started.error();
  }
  plans_[name] = std::move(on_done);
  return name;
}

void JobQueue::cancel_plan(const std::string& name) {
  thread_.post([this, name] {
    if (const auto run = find_run(name)) request_cancel(*run);
  });
}

void JobQueue::finish_plan(const std::string& name, Result<std::string> plan) {
  const auto found = plans_.find(name);
  if (found == plans_.end()) return;
  const PlanDone on_done = std::move(found->second);
  plans_.erase(found);
  on_done(std::move(plan));
}

Result<std::shared_ptr<WorkerRun>> JobQueue::greet(const WorkerHello& hello, std::shared_ptr<WorkerLink> link) {
  const auto run = find_run(hello.job);
  if (!run) {
    return Error{ErrorCode::kFailedPrecondition, "no worker is expected for '" + hello.job.substr(0, 100) + "'"};
  }
  RADBAKE_RETURN_IF_ERROR(run->greet(hello, std::move(link)));
  return run;
}

void JobQueue::watch_limits(std::stop_token stop) {
  std::unique_lock lock(mutex_);
  while (!stop.stop_requested()) {
    if (runs_.empty()) {
      runs_changed_.wait(lock, stop, [this] { return !runs_.empty(); });
      continue;
    }
    // A worker that was asked to stop has little time: look at it often.
    constexpr std::chrono::milliseconds kCancelCheck{5};
    const auto is_cancelling = [this] {
      return std::any_of(runs_.begin(), runs_.end(), [](const auto& run) { return run.second->is_cancel_requested(); });
    };
    if (is_cancelling()) {
      runs_changed_.wait_for(lock, stop, kCancelCheck, [] { return false; });
    } else {
      runs_changed_.wait_for(lock, stop, options_.check_interval, is_cancelling);
    }
    const auto runs = runs_;
    lock.unlock();
    for (const auto& [name, run] : runs) run->check(WorkerRun::Clock::now());
    lock.lock();
  }
}

void JobQueue::drain() {
  thread_.run([this] {
    {
      const std::lock_guard lock(mutex_);
      if (is_draining_) return;
      is_draining_ = true;
    }
    while (!plans_.empty()) {
      finish_plan(plans_.begin()->first, Error{ErrorCode::kUnavailable, "the server is stopping"});
    }
    for (const auto& [name, run] : runs_) run->kill("was running when the server stopped");
    ready_.reset();
  });
  std::unique_lock lock(mutex_);
  runs_changed_.wait(lock, [this] { return runs_.empty(); });
  const auto live = live_;
  lock.unlock();
  for (const auto& [name, job] : live) job->close();
}

}  // namespace radbake::jobs
