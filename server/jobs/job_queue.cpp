#include "server/jobs/job_queue.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <set>
#include <utility>

#include "common/base/unix_time.h"
#include "common/log/log.h"

namespace radbake::jobs {

using store::JobRecord;
using store::JobState;
using store::StateChange;

JobQueue::JobQueue(QueueOptions options, store::JobStore& jobs, store::TenantContent& content)
    : options_(std::move(options)), store_(jobs), content_(content) {
  content_.set_on_refusal([this](const Error& problem) { thread_.post([this, problem] { stand_still(problem); }); });
}

JobQueue::~JobQueue() {
  content_.set_on_refusal({});
  drain();
  watchdog_ = {};
}

Result<void> JobQueue::start(WorkerGate& gate) {
  gate_ = &gate;
  raise_open_file_limit();
  watchdog_ = std::jthread([this](std::stop_token stop) { watch_limits(stop); });
  return thread_.run([this] {
    const Result<void> recovered = recover();
    has_recovered_ = recovered.ok();
    return recovered;
  });
}

Result<void> JobQueue::check_recovered() const {
  if (has_recovered_) return {};
  return Error{ErrorCode::kUnavailable, "the server is starting and takes up its bakes: try again"};
}

Result<void> JobQueue::recover() {
  // Turns go on where they were: what clients were served of late counts.
  constexpr std::int64_t kLatelyMs = 3600 * 1000;
  RADBAKE_ASSIGN_OR_RETURN(const auto counts, store_.ended_by_client(unix_ms_now() - kLatelyMs));
  for (const auto& count : counts) {
    waiting_.remember(count.tenant, count.client, static_cast<double>(count.num_ended));
  }
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<JobRecord> records, store_.unfinished());
  for (const JobRecord& record : records) {
    RADBAKE_ASSIGN_OR_RETURN(std::vector<store::JobEvent> events, store_.events_after(record.name, 0));
    const auto job = std::make_shared<Job>(record, std::move(events));
    const auto leader = record.owner.is_shared ? find_leader(record.owner, record.bake_key) : nullptr;
    add_live(job);
    if (is_running(record.state)) {
      const std::uint32_t lost = record.lost_attempts + (leader ? 0 : 1);
      if (lost >= options_.max_lost_attempts) {
        fail(job, internal_error("the server ended unexpectedly " + std::to_string(lost) +
                                 " times while this bake ran, and it did not get on; the limit is " +
                                 std::to_string(options_.max_lost_attempts)));
        continue;
      }
      RADBAKE_RETURN_IF_ERROR(change(job, {.state = JobState::kQueued,
                                           .message = "the server ended unexpectedly; queued again",
                                           .attempt = record.attempt + 1,
                                           .lost_attempts = lost}));
    }
    if (leader) {
      follow(job, leader);
    } else {
      line_up(record);
    }
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

Result<std::shared_ptr<Job>> JobQueue::find_request(const std::string& tenant, const std::string& request_id,
                                                    const std::string& body_sha256) {
  RADBAKE_RETURN_IF_ERROR(check_recovered());
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<JobRecord> record, store_.find_request(tenant, request_id, body_sha256));
  if (!record) return std::shared_ptr<Job>();
  return find(record->name);
}

Result<std::shared_ptr<Job>> JobQueue::submit(const store::NewJob& job) {
  return thread_.run([&] { return accept_job(job); });
}

Result<std::shared_ptr<Job>> JobQueue::accept_job(const store::NewJob& new_job) {
  const store::JobOwner& owner = new_job.owner;
  const LogTrace trace(owner.trace_id);
  RADBAKE_ASSIGN_OR_RETURN(const std::shared_ptr<Job> known,
                           find_request(owner.tenant, new_job.request_id, new_job.body_sha256));
  if (known) return known;
  if (is_refusing_ || is_draining_) {
    return Error{ErrorCode::kUnavailable, "the server is stopping: submit again later"};
  }

  // Baked before, or being baked?
  std::shared_ptr<Job> leader;
  if (owner.is_shared) {
    RADBAKE_ASSIGN_OR_RETURN(const std::optional<JobRecord> stored, find_result(owner, new_job.bake_key));
    if (stored) {
      RADBAKE_ASSIGN_OR_RETURN(const JobRecord record, store_.create(new_job, &*stored));
      if (options_.observer != nullptr) options_.observer->cache_looked_up(true);
      spdlog::info("{} answered from the store: '{}', the result of {}", record.name, record.label, stored->name);
      return find(record.name);
    }
    leader = find_leader(owner, new_job.bake_key);
    if (options_.observer != nullptr) options_.observer->cache_looked_up(leader != nullptr);
  }
  if (const std::size_t num_waiting = waiting_.size() + leaders_.size(); num_waiting >= options_.max_queued) {
    return Error{
        ErrorCode::kResourceExhausted,
        std::to_string(num_waiting) + " bakes are waiting, max_queued_bakes is " + std::to_string(options_.max_queued)};
  }
  const Result<JobRecord> created = store_.create(new_job);
  if (!created.ok()) {
    if (created.error().code != ErrorCode::kAlreadyExists) stand_still(created.error());
    return created.error();
  }
  const JobRecord& record = *created;
  RADBAKE_ASSIGN_OR_RETURN(std::vector<store::JobEvent> events, store_.events_after(record.name, 0));
  const auto job = std::make_shared<Job>(record, std::move(events));
  add_live(job);
  spdlog::info("{} queued: '{}', bake key {}", record.name, record.label, record.bake_key);
  if (leader) {
    follow(job, leader);
  } else {
    line_up(record);
    // The answer to the submit does not wait for the worker's start.
    thread_.post([this] { run_waiting_jobs(); });
  }
  return job;
}

void JobQueue::add_live(const std::shared_ptr<Job>& job) {
  const JobRecord record = job->record();
  if (record.owner.is_shared) sharers_[scoped(record.owner.tenant, record.bake_key)].push_back(job);
  const std::lock_guard lock(mutex_);
  live_[record.name] = job;
}

Result<std::optional<JobRecord>> JobQueue::find_result(const store::JobOwner& owner, const std::string& bake_key) {
  RADBAKE_ASSIGN_OR_RETURN(std::optional<JobRecord> stored, store_.find_result(owner.tenant, bake_key));
  if (!stored) return stored;
  RADBAKE_ASSIGN_OR_RETURN(store::ContentStore * content, content_.of(owner.tenant));
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Digest> outputs, store_.outputs(stored->name));
  if (!content->find_missing(outputs).empty()) stored.reset();
  return stored;
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

Result<std::vector<JobRecord>> JobQueue::list(const std::optional<std::string>& tenant, std::uint32_t num_jobs,
                                              std::int64_t before_id) {
  return store_.list(tenant, num_jobs, before_id);
}

std::map<std::string, QueuePlace> JobQueue::places() {
  return thread_.run([this] {
    std::map<std::string, QueuePlace> places;
    // Each slot is free when its bake may end.
    constexpr double kFirstGuessSeconds = 10;
    const double usual_seconds = usual_seconds_.value_or(kFirstGuessSeconds);
    const std::int64_t now = unix_ms_now();
    std::multiset<double> free_in;
    for (const auto& [name, job] : live_) {
      if (!runs_.contains(name)) continue;
      const double left = job->progress().progress.seconds_left;
      free_in.insert(left >= 0 ? left : usual_seconds);
    }
    while (free_in.size() < options_.max_running) free_in.insert(0);
    std::uint32_t position = 0;
    for (const std::string& name : waiting_.order()) {
      const double starts_in = *free_in.begin();
      free_in.erase(free_in.begin());
      free_in.insert(starts_in + usual_seconds);
      places[name] = {++position, now + static_cast<std::int64_t>(1000 * starts_in), ""};
    }
    for (const auto& [follower, leader] : leaders_) {
      places[follower] = {0, places.contains(leader) ? places[leader].expected_start_unix_ms : 0, leader};
    }
    return places;
  });
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
  if (is_unsaved(job)) {
    return Error{ErrorCode::kUnavailable, "what became of " + name + " cannot be recorded yet: " + standstill_};
  }
  if (const auto run = find_run(name)) {
    request_cancel(*run);
    return {};
  }
  RADBAKE_RETURN_IF_ERROR(change(job, {.state = JobState::kCancelled, .message = "cancelled before it ran"}));
  waiting_.erase(name);
  leave_leader(job);
  return {};
}

Result<std::shared_ptr<Job>> JobQueue::finish(const std::string& name) {
  RADBAKE_ASSIGN_OR_RETURN(std::shared_ptr<Job> job, find(name));
  thread_.run([&] { finish_live(name); });
  return job;
}

void JobQueue::finish_live(const std::string& name) {
  const std::shared_ptr<Job> job = find_live(name);
  if (!job) return;
  to_finish_.insert(name);
  // Those who share the run want all of it.
  if (leader_of(name)) {
    leave_leader(job);
    queue_again(job, "runs by itself, to be finished", false);
  }
  hand_over_followers(job);
  if (const auto run = find_run(name)) run->request_finish();
  run_waiting_jobs();
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
    if (runs_.empty() && standstill_.empty()) {
      runs_changed_.wait(lock, stop, [this] { return !runs_.empty() || !standstill_.empty(); });
      continue;
    }
    if (!standstill_.empty() && WorkerRun::Clock::now() - tried_at_ >= options_.retry_interval) {
      tried_at_ = WorkerRun::Clock::now();
      thread_.post([this] { try_again(); });
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
    for (const auto& [name, run] : runs_) run->kill("was running when the server stopped", WorkerRun::Blame::kServer);
    ready_.reset();
  });
  std::unique_lock lock(mutex_);
  runs_changed_.wait(lock, [this] { return runs_.empty(); });
  const auto live = live_;
  lock.unlock();
  for (const auto& [name, job] : live) job->close();
}

std::string JobQueue::standstill() const {
  const std::lock_guard lock(mutex_);
  return standstill_;
}

}  // namespace radbake::jobs
