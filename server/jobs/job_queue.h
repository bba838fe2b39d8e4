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
#include "server/jobs/waiting_line.h"
#include "server/jobs/worker_link.h"
#include "server/jobs/worker_run.h"
#include "server/store/job_store.h"
#include "server/store/task_pool.h"
#include "server/store/tenant_content.h"

namespace radbake::jobs {

struct QueueOptions {
  WorkerOptions worker;
  std::filesystem::path spool_folder;
  bool keeps_worker_ready = false;        ///< starts a worker ahead of need while nothing runs
  std::uint32_t max_running = 1;          ///< bakes at the same time
  std::uint32_t max_queued = 1000;        ///< bakes that wait, or share another's run
  std::uint32_t max_running_plans = 4;    ///< plans do not wait
  std::uint32_t max_lost_attempts = 5;    ///< a bake that takes the server down this often, without getting on, fails
  std::uint32_t max_failed_attempts = 3;  ///< and one whose worker dies this often
  std::chrono::milliseconds plan_limit{60'000};
  std::chrono::milliseconds bake_limit{0};         ///< of an attempt; a bake that takes longer fails; 0: none
  std::chrono::milliseconds check_interval{100};   ///< how often workers are held against their limits
  std::chrono::milliseconds retry_interval{1000};  ///< how often what stands in the way is tried again
  JobObserver* observer = nullptr;                 ///< may be null; outlives the queue
};

/// Where a job that waits stands.
struct QueuePlace {
  std::uint32_t position = 0;               ///< 1: next; 0: it does not wait
  std::int64_t expected_start_unix_ms = 0;  ///< 0: not known
  std::string shares;                       ///< the job that runs for it; empty: none
};

/// How much there is to do.
struct QueueStats {
  std::uint64_t num_waiting = 0;  ///< bakes without a worker of their own: they wait, or share another's run
  std::uint64_t num_running = 0;
  std::uint64_t num_plans = 0;  ///< that are being made
};

/// Accepts jobs, runs them in workers, some at the same time, and keeps the record of what became of them.
///
///   queued -> preparing -> form factors -> solving -> gathering -> writing -> succeeded | failed | cancelled
///
/// A worker that dies or hangs ends its attempt; its job waits for the next one, which goes on from the checkpoints,
/// and fails after some. A server that dies leaves jobs running on paper: the next one queues them again, too. Every
/// change of state is on disk before a watcher sees it; while the disk refuses, or no process can be started, nothing
/// starts, and what ended is kept until it can be recorded.
///
/// Jobs of one tenant with the same bake key share one run: one job leads, the others follow it and end as it does.
/// Where such a job has ended well, its result is the answer.
///
/// Thread-safe; calls that change something wait for the disk.
class JobQueue {
 public:
  JobQueue(QueueOptions options, store::JobStore& jobs, store::TenantContent& content);
  /// Drains.
  ~JobQueue();

  /// Takes up what an earlier server left, and begins to run jobs. Until it returns, what asks for jobs or plans is
  /// answered with kUnavailable.
  Result<void> start(WorkerGate& gate);

  /// The job that a request created before; null if none did. Errors: kAlreadyExists for another body.
  Result<std::shared_ptr<Job>> find_request(const std::string& tenant, const std::string& request_id,
                                            const std::string& body_sha256);
  /// Stores and queues a job; the same request again gives the same job.
  /// Errors: kResourceExhausted for a full queue, kUnavailable while draining, kAlreadyExists.
  Result<std::shared_ptr<Job>> submit(const store::NewJob& job);
  /// Errors: kNotFound.
  Result<std::shared_ptr<Job>> find(const std::string& name);
  /// Newest first, of one tenant or of all, below an id (0: from the newest on). Records have neither results nor
  /// inputs.
  Result<std::vector<store::JobRecord>> list(const std::optional<std::string>& tenant, std::uint32_t num_jobs,
                                             std::int64_t before_id);
  /// Of the jobs that wait or follow another.
  std::map<std::string, QueuePlace> places();
  /// Asks a job to stop. No error if it has ended. Errors: kNotFound, kUnavailable while the disk refuses.
  Result<std::shared_ptr<Job>> cancel(const std::string& name);
  /// Asks a job to end with the best result that it has; one that waits is asked as soon as it runs. No error if it has
  /// ended. Errors: kNotFound.
  Result<std::shared_ptr<Job>> finish(const std::string& name);
  Job::LatestProgress progress_of(const std::string& name) const;

  /// Runs a worker that only plans. `on_done` is called once, from any thread, with the bytes of the plan.
  /// Returns a name for cancel_plan(). Errors: kResourceExhausted, kUnavailable; then on_done is never called.
  using PlanDone = std::function<void(Result<std::string>)>;
  Result<std::string> start_plan(const store::JobOwner& owner, const store::Work& work, PlanDone on_done);
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

  /// Why nothing starts at present: what the disk or the system said; empty: all is well.
  std::string standstill() const;

 private:
  /// What ended and could not be recorded yet.
  struct Unsaved {
    std::shared_ptr<Job> job;
    store::StateChange change;
  };

  // All of these run on thread_.
  Result<void> recover();
  Result<std::shared_ptr<Job>> accept_job(const store::NewJob& job);
  void add_live(const std::shared_ptr<Job>& job);
  Result<void> cancel_live(const std::string& name);
  void finish_live(const std::string& name);
  void request_cancel(WorkerRun& run);
  void line_up(const store::JobRecord& job);
  void run_waiting_jobs();
  void make_worker_ready();
  void start_job(const std::shared_ptr<Job>& job);
  /// Makes what an attempt needs and records that it begins. Errors: the disk refuses, and nothing has changed.
  Result<std::shared_ptr<WorkerRun>> begin_attempt(const std::shared_ptr<Job>& job);
  /// What every run tells at its end.
  RunEvents ends_of(const std::string& name, std::uint32_t attempt);
  RunEvents events_of(const std::shared_ptr<Job>& job, const std::shared_ptr<TileSpool>& spool);
  Result<std::string> start_plan_run(const store::JobOwner& owner, const store::Work& work, PlanDone on_done);
  void advance(const std::string& name, store::JobState state);
  void end_work(const std::string& name, std::uint32_t attempt, WorkOutcome outcome);
  void end_run(const std::string& name, const WorkerExit& exit);
  AttemptEnd attempt_end_of(const WorkerRun& run) const;
  void end_turn(const WorkerRun& run, const WorkerExit& exit);
  void end_job_run(const std::shared_ptr<Job>& job, const WorkerRun& run, const std::string& reason);
  void queue_again(const std::shared_ptr<Job>& job, const std::string& why, bool has_failed);
  void finish_plan(const std::string& name, Result<std::string> plan);
  /// Records a change of a job and of those that follow it.
  Result<void> change(const std::shared_ptr<Job>& job, store::StateChange change);
  Result<void> change_one(const std::shared_ptr<Job>& job, const store::StateChange& change);
  /// Records how a job ends, as soon as the disk lets us; its worker waits for that.
  void end_job(const std::shared_ptr<Job>& job, store::StateChange end);
  void fail(const std::shared_ptr<Job>& job, Error error);
  void keep_checkpoint(const std::string& name, std::uint32_t attempt, const store::CheckpointRecord& checkpoint);
  void drop_checkpoints(const std::string& name, std::uint32_t attempt, const std::vector<std::string>& names);
  void remove_blobs(const std::string& tenant, const std::vector<Digest>& blobs);
  /// Starts nothing until try_again() finds that all is well.
  void stand_still(const Error& problem);
  void try_again();

  bool is_unsaved(const std::shared_ptr<Job>& job) const;

  // Jobs that share a run, or a result.
  Result<std::optional<store::JobRecord>> find_result(const store::JobOwner& owner, const std::string& bake_key);
  std::shared_ptr<Job> find_leader(const store::JobOwner& owner, const std::string& bake_key) const;
  void follow(const std::shared_ptr<Job>& follower, const std::shared_ptr<Job>& leader);
  std::shared_ptr<Job> leader_of(const std::string& follower) const;
  void leave_leader(const std::shared_ptr<Job>& follower);
  /// The first of its followers runs by itself, for the others, too.
  void hand_over_followers(const std::shared_ptr<Job>& leader);

  Result<void> check_recovered() const;
  bool will_finish_before(WorkerRun::Clock::time_point limit) const;  // under mutex_: whether a bake will
  std::shared_ptr<Job> find_live(const std::string& name) const;
  std::shared_ptr<WorkerRun> find_run(const std::string& name) const;
  void add_run(const std::shared_ptr<WorkerRun>& run);
  void watch_limits(std::stop_token stop);

  const QueueOptions options_;
  store::JobStore& store_;
  store::TenantContent& content_;
  WorkerGate* gate_ = nullptr;
  std::atomic<bool> has_recovered_ = false;

  // Changed on thread_ alone, under the mutex; other threads read under it.
  mutable std::mutex mutex_;
  std::condition_variable_any runs_changed_;
  std::map<std::string, std::shared_ptr<Job>> live_;        // every job that has not ended
  std::map<std::string, std::shared_ptr<WorkerRun>> runs_;  // of jobs and plans
  bool is_draining_ = false;
  bool is_refusing_ = false;  // from refuse_new() on
  std::string standstill_;
  WorkerRun::Clock::time_point tried_at_;

  // Touched on thread_ alone.
  WaitingLine waiting_;
  std::map<std::string, std::string> leaders_;  // [followers]
  std::deque<Unsaved> unsaved_;
  std::map<std::string, std::vector<std::shared_ptr<Job>>> sharers_;  // [shared key] live jobs, oldest first
  std::map<std::string, Waiting> turns_;                              // [running] whose turn it is
  std::optional<double> usual_seconds_;                               // of a bake, lately
  std::set<std::string> to_finish_;                                   // of the jobs that have not ended
  std::map<std::string, PlanDone> plans_;
  std::unique_ptr<ReadyWorker> ready_;  // null: none, or given to a run
  std::uint32_t num_running_ = 0;
  std::uint64_t next_plan_ = 1;

  /// A bake key of one tenant's: no tenant's name has a line's end.
  static std::string scoped(const std::string& tenant, const std::string& name) { return tenant + '\n' + name; }

  std::jthread watchdog_;
  store::TaskPool thread_{1};
};

}  // namespace radbake::jobs
