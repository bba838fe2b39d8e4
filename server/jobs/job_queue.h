#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "common/base/result.h"
#include "server/jobs/job.h"
#include "server/jobs/job_observer.h"
#include "server/jobs/ready_worker.h"
#include "server/jobs/worker_link.h"
#include "server/jobs/worker_run.h"
#include "server/store/content_store.h"
#include "server/store/job_store.h"
#include "server/store/task_pool.h"

namespace radbake::jobs {

struct QueueOptions {
  WorkerOptions worker;
  std::filesystem::path spool_folder;
  bool keeps_worker_ready = false;      ///< starts a worker ahead of need while nothing runs
  std::uint32_t max_running = 1;        ///< bakes at the same time
  std::uint32_t max_queued = 1000;      ///< bakes that wait
  std::uint32_t max_running_plans = 4;  ///< plans do not wait
  std::uint32_t max_lost_attempts = 3;  ///< a bake that takes the server down this often fails
  std::chrono::milliseconds plan_limit{60'000};
  std::chrono::milliseconds check_interval{100};  ///< how often workers are held against their limits
  JobObserver* observer = nullptr;                ///< may be null; outlives the queue
};

/// How much there is to do.
struct QueueStats {
  std::uint64_t num_waiting = 0;
  std::uint64_t num_running = 0;
  std::uint64_t num_plans = 0;  ///< that are being made
};

/// Accepts jobs, runs them one after the other in workers, and keeps the record of what became of them.
///
///   queued -> preparing -> form factors -> solving -> gathering -> writing -> succeeded | failed | cancelled
///
/// A worker that dies ends its job as failed. A server that dies leaves jobs running on paper: the next one queues
/// them again under the next attempt number. Every change of state is on disk before a watcher sees it.
///
/// Thread-safe; calls that change something wait for the disk.
class JobQueue {
 public:
  JobQueue(QueueOptions options, store::JobStore& jobs, store::ContentStore& content);
  /// Drains.
  ~JobQueue();

  /// Takes up what an earlier server left, and begins to run jobs. Until it returns, what asks for jobs or plans is
  /// answered with kUnavailable.
  Result<void> start(WorkerGate& gate);

  /// The job that a request created before; null if none did. Errors: kAlreadyExists for another body.
  Result<std::shared_ptr<Job>> find_request(const std::string& request_id, const std::string& body_sha256);
  /// Stores and queues a job; the same request again gives the same job.
  /// Errors: kResourceExhausted for a full queue, kUnavailable while draining, kAlreadyExists.
  Result<std::shared_ptr<Job>> submit(const store::NewJob& job);
  /// Errors: kNotFound.
  Result<std::shared_ptr<Job>> find(const std::string& name);
  /// Newest first, below an id (0: from the newest on). Records have neither results nor inputs.
  Result<std::vector<store::JobRecord>> list(std::uint32_t num_jobs, std::int64_t before_id);
  /// Asks a job to stop. No error if it has ended.
  Result<std::shared_ptr<Job>> cancel(const std::string& name);
  /// Asks a job to end with the best result that it has; one that waits is asked as soon as it runs. No error if it has
  /// ended. Errors: kNotFound.
  Result<std::shared_ptr<Job>> finish(const std::string& name);
  Job::LatestProgress progress_of(const std::string& name) const;

  /// Runs a worker that only plans. `on_done` is called once, from any thread, with the bytes of the plan.
  /// Returns a name for cancel_plan(). Errors: kResourceExhausted, kUnavailable; then on_done is never called.
  using PlanDone = std::function<void(Result<std::string>)>;
  Result<std::string> start_plan(const store::Work& work, const std::string& trace_id, PlanDone on_done);
  void cancel_plan(const std::string& name);

  /// Finds the run that a worker belongs to. Errors: kFailedPrecondition if there is none.
  Result<std::shared_ptr<WorkerRun>> greet(const WorkerHello& hello, std::shared_ptr<WorkerLink> link);

  QueueStats stats() const;

  /// From now on refuses jobs and plans and starts none that wait; what runs goes on.
  void refuse_new();
  /// After refuse_new(): waits for the bakes whose workers say that they will be done before the grace is over. Returns
  /// when no such bake is left; drain() ends the others.
  void let_finish(std::chrono::milliseconds grace);

  /// Stops for good: refuses new jobs, kills workers and queues their jobs again, lets watchers go. Returns when no
  /// worker is left.
  void drain();

 private:
  // All of these run on thread_.
  Result<void> recover();
  Result<std::shared_ptr<Job>> accept_job(const store::NewJob& job);
  Result<void> cancel_live(const std::string& name);
  void finish_live(const std::string& name);
  void request_cancel(WorkerRun& run);
  void run_waiting_jobs();
  void make_worker_ready();
  void start_job(const std::shared_ptr<Job>& job);
  Result<std::string> start_plan_run(const store::Work& work, const std::string& trace_id, PlanDone on_done);
  void advance(const std::string& name, store::JobState state);
  void end_work(const std::string& name, WorkOutcome outcome);
  void end_run(const std::string& name, const WorkerExit& exit);
  AttemptEnd attempt_end_of(const WorkerRun& run) const;
  void finish_plan(const std::string& name, Result<std::string> plan);
  Result<void> change(const std::shared_ptr<Job>& job, store::StateChange change);
  void fail(const std::shared_ptr<Job>& job, Error error);

  Result<void> check_recovered() const;
  bool will_finish_before(WorkerRun::Clock::time_point limit) const;  // under mutex_: whether a bake will
  std::shared_ptr<Job> find_live(const std::string& name) const;
  std::shared_ptr<WorkerRun> find_run(const std::string& name) const;
  void add_run(const std::shared_ptr<WorkerRun>& run);
  void watch_limits(std::stop_token stop);

  const QueueOptions options_;
  store::JobStore& store_;
  store::ContentStore& content_;
  WorkerGate* gate_ = nullptr;
  std::atomic<bool> has_recovered_ = false;

  // Changed on thread_ alone, under the mutex; other threads read under it.
  mutable std::mutex mutex_;
  std::condition_variable_any runs_changed_;
  std::map<std::string, std::shared_ptr<Job>> live_;        // every job that has not ended
  std::map<std::string, std::shared_ptr<WorkerRun>> runs_;  // of jobs and plans
  bool is_draining_ = false;
  bool is_refusing_ = false;  // from refuse_new() on

  // Touched on thread_ alone.
  std::deque<std::shared_ptr<Job>> waiting_;
  std::set<std::string> to_finish_;  // of the jobs that have not ended
  std::map<std::string, PlanDone> plans_;
  std::unique_ptr<ReadyWorker> ready_;  // null: none, or given to a run
  std::uint32_t num_running_ = 0;
  std::uint64_t next_plan_ = 1;

  std::jthread watchdog_;
  store::TaskPool thread_{1};
};

}  // namespace radbake::jobs
