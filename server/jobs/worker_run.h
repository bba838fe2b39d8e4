#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/jobs/job_progress.h"
#include "server/jobs/worker_link.h"
#include "server/jobs/worker_process.h"
#include "server/store/content_store.h"

namespace radbake::jobs {

/// How workers are started and how long they are waited for.
struct WorkerOptions {
  std::filesystem::path program;
  bool log_json = false;
  ProcessLimits limits;
  std::chrono::milliseconds silence_limit{10'000};    ///< without any report
  std::chrono::milliseconds cancel_grace{40};         ///< from the request to cancel to the kill: CANCELLED within 100
  std::chrono::milliseconds exit_grace{5'000};        ///< from the accepted outcome to the kill
  std::chrono::milliseconds disconnect_grace{2'000};  ///< from a lost connection to the kill
};

class ReadyWorker;

/// What a run tells its queue. Calls come from any thread and must be quick.
struct RunEvents {
  std::function<void(const JobProgress&)> on_progress;
  std::function<void(const std::string& tile)> on_tile;
  std::function<void(const store::CheckpointRecord&)> on_checkpoint;  ///< its blob is stored
  std::function<void(const std::vector<std::string>& names)> on_drop_checkpoints;
  std::function<void(WorkOutcome)> on_outcome;     ///< at most once
  std::function<void(const WorkerExit&)> on_exit;  ///< once after start() succeeded, last
};

/// One attempt at a job, or one plan: a worker's process and what it reports. Thread-safe.
class WorkerRun {
 public:
  using Clock = std::chrono::steady_clock;

  struct Assignment {
    std::string job;
    std::uint32_t attempt = 1;
    bool is_plan = false;
    store::Work work = {};
    std::optional<Clock::duration> time_limit = {};
    std::int64_t accepted_unix_ms = 0;                      ///< when the job was accepted; 0: it does not matter
    std::string trace_id = {};                              ///< of the call that asked for it
    std::vector<store::CheckpointRecord> checkpoints = {};  ///< of earlier attempts
  };
  /// Whose fault it is that an attempt ended without an outcome.
  enum class Blame {
    kWorker,  ///< died, hung, fell silent: another attempt may do better
    kBake,    ///< took more than it was allowed to, and would again
    kServer,  ///< could not keep what it was sent, or stops
  };

  WorkerRun(Assignment assignment, const WorkerOptions& options, store::ContentStore& content, RunEvents events);

  /// Opens the inputs, takes the worker that is ready or starts one, and gives the server's end of its socket to the
  /// gate. `ready`: may be null. Errors: kUnavailable where the system starts no process now; others: an input cannot
  /// be opened.
  Result<void> start(WorkerGate& gate, std::unique_ptr<ReadyWorker> ready = nullptr);

  // What the worker reports. Nothing happens after its outcome, or once it was killed: what it had sent by then may
  // build on what could not be kept.
  /// Checks that this is the worker that was started for this attempt, and gives it its work.
  Result<void> greet(const WorkerHello& hello, std::shared_ptr<WorkerLink> link);
  void report_progress(const JobProgress& progress);
  void report_tile(const std::string& tile);
  /// Errors: kInvalidArgument for parts out of order, kDataLoss for wrong ones. A disk that refuses a part of a result
  /// ends the attempt; one of a checkpoint: the checkpoint is not kept.
  Result<void> report_chunk(const ResultChunk& chunk);
  /// Blobs that a result names must be stored: an outcome that names others is a failure.
  void report_outcome(WorkOutcome outcome, const std::vector<Digest>& blobs);
  void report_dropped_checkpoints(const std::vector<std::string>& names);
  void report_disconnected();

  // What the queue decides.
  void request_cancel();
  /// Asks for the best result so far. Nothing happens after a cancel.
  void request_finish();
  bool is_cancel_requested() const;
  void accept();
  void kill(const std::string& reason, Blame blame);
  /// Kills the worker when it has overstepped one of its limits.
  void check(Clock::time_point now);

  /// Why the queue or check() killed it; empty if nobody did.
  std::string kill_reason() const;
  Blame blame() const;
  /// Since it was started.
  double seconds() const;
  const Assignment& assignment() const { return assignment_; }

 private:
  struct GrowingBlob {
    std::string name;
    std::unique_ptr<store::BlobWriter> writer;
  };

  struct Fault {
    std::string reason;
    Blame blame = Blame::kWorker;
  };
  /// Notes a sign of life. False: what it says does not count any more; it was killed, or has said how it ended.
  bool hear();
  std::optional<Fault> overstepped_limit(Clock::time_point now) const;
  /// Ends the attempt where the disk, not the worker, is to blame and the part is needed.
  Result<void> refuse_chunk(const ResultChunk& chunk, const Error& problem);
  /// While the server stores what the worker sent, the worker is not heard and not held to be silent.
  class Storing {
   public:
    explicit Storing(WorkerRun& run);
    ~Storing();

   private:
    WorkerRun& run_;
  };

  const Assignment assignment_;
  const WorkerOptions options_;
  store::ContentStore& content_;
  const RunEvents events_;

  mutable std::mutex mutex_;  // guards what follows, down to process_
  WorkOrder order_;
  std::shared_ptr<WorkerLink> link_;
  Clock::time_point started_at_ = Clock::now();
  Clock::time_point last_heard_at_ = started_at_;
  std::optional<Clock::time_point> cancel_requested_at_;
  bool is_finish_requested_ = false;
  std::optional<Clock::time_point> accepted_at_;
  std::optional<Clock::time_point> disconnected_at_;
  bool has_outcome_ = false;
  bool is_storing_ = false;
  std::string kill_reason_;
  Blame blame_ = Blame::kWorker;
  // Touched by the worker's reports only, which come one after the other.
  GrowingBlob blob_;
  std::string refused_checkpoint_;  // the rest of it is still to come

  std::unique_ptr<WorkerProcess> process_;  // set once, by start(), under mutex_
};

}  // namespace radbake::jobs
