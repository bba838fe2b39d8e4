#include "server/jobs/worker_run.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "common/base/version.h"
#include "server/jobs/ready_worker.h"
#include "server/store/failpoint.h"

namespace radbake::jobs {
namespace {

/// By the clock that was read when the job was accepted, maybe by an earlier server.
double seconds_since(std::int64_t unix_ms) {
  using std::chrono::milliseconds;
  const std::chrono::system_clock::time_point then{milliseconds(unix_ms)};
  return std::max(0.0, std::chrono::duration<double>(std::chrono::system_clock::now() - then).count());
}

std::string in_seconds(std::chrono::duration<double> duration) {
  std::string text = std::to_string(duration.count());
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text + " s";
}

}  // namespace

WorkerRun::WorkerRun(Assignment assignment, const WorkerOptions& options, store::ContentStore& content,
                     RunEvents events)
    : assignment_(std::move(assignment)), options_(options), content_(content), events_(std::move(events)) {}

Result<void> WorkerRun::start(WorkerGate& gate, std::unique_ptr<ReadyWorker> ready) {
  // Open every input now: from here on the worker needs no file system.
  std::vector<store::FileDescriptor> files;
  handover::Assignment handed{assignment_.job, assignment_.attempt, {}};
  WorkOrder order{assignment_.is_plan, assignment_.work, {}, {}, 0, assignment_.trace_id};
  for (const Digest& digest : assignment_.work.inputs) {
    RADBAKE_ASSIGN_OR_RETURN(store::FileDescriptor file, content_.open_blob(digest));
    order.inputs.push_back({digest, file.get()});
    handed.inputs.push_back(file.get());
    files.push_back(std::move(file));
  }
  for (const store::CheckpointRecord& checkpoint : assignment_.checkpoints) {
    auto file = content_.open_blob(checkpoint.digest);
    if (!file.ok()) {
      // The bake can do without it, unless the server is short of something for a moment.
      if (file.error().code == ErrorCode::kUnavailable) return file.error();
      spdlog::warn("{}: checkpoint '{}' is not used: {}", assignment_.job, checkpoint.name, file.error().message);
      continue;
    }
    order.checkpoints.push_back({checkpoint.name, {checkpoint.digest, file->get()}});
    handed.inputs.push_back(file->get());
    files.push_back(std::move(file).value());
  }
  store::FileDescriptor socket;
  {
    const std::lock_guard lock(mutex_);
    order_ = std::move(order);
    started_at_ = last_heard_at_ = Clock::now();
    auto worker = ready ? ready->hire(handed, events_.on_exit) : std::nullopt;
    if (!worker) {
      const std::vector<std::string> arguments = {"--job", assignment_.job, "--attempt",
                                                  std::to_string(assignment_.attempt)};
      RADBAKE_ASSIGN_OR_RETURN(worker, start_worker(options_, arguments, std::move(handed.inputs), events_.on_exit));
    }
    process_ = std::move(worker->process);
    socket = std::move(worker->socket);
  }
  gate.adopt(std::move(socket));
  return {};
}

Result<void> WorkerRun::greet(const WorkerHello& hello, std::shared_ptr<WorkerLink> link) {
  const std::lock_guard lock(mutex_);
  if (!process_)
    return Error{ErrorCode::kFailedPrecondition, "the worker of " + assignment_.job + " is not started yet"};
  if (hello.attempt != assignment_.attempt || link_) {
    return Error{ErrorCode::kFailedPrecondition, assignment_.job + " is at attempt " +
                                                     std::to_string(assignment_.attempt) +
                                                     (link_ ? " and has its worker" : "") + ": attempt " +
                                                     std::to_string(hello.attempt) + " is refused"};
  }
  // A worker of another build may bake other bytes under the same bake key.
  if (hello.protocol_major != kProtocolMajor || hello.engine_version != kEngineVersion) {
    blame_ = Blame::kBake;
    kill_reason_ = "is version " + hello.engine_version + " with protocol " + std::to_string(hello.protocol_major) +
                   ", the server is version " + kEngineVersion + " with protocol " + std::to_string(kProtocolMajor);
    process_->kill_group();
    return Error{ErrorCode::kFailedPrecondition, "the worker " + kill_reason_};
  }
  last_heard_at_ = Clock::now();
  link_ = std::move(link);
  if (assignment_.accepted_unix_ms > 0) order_.waited_seconds = seconds_since(assignment_.accepted_unix_ms);
  link_->start(order_);
  if (is_finish_requested_) link_->finish();
  if (cancel_requested_at_) link_->cancel();
  return {};
}

WorkerRun::Storing::Storing(WorkerRun& run) : run_(run) {
  const std::lock_guard lock(run_.mutex_);
  run_.is_storing_ = true;
}

WorkerRun::Storing::~Storing() {
  const std::lock_guard lock(run_.mutex_);
  run_.is_storing_ = false;
  run_.last_heard_at_ = Clock::now();
}

bool WorkerRun::hear() {
  const std::lock_guard lock(mutex_);
  last_heard_at_ = Clock::now();
  return kill_reason_.empty() && !has_outcome_;
}

void WorkerRun::report_progress(const JobProgress& progress) {
  if (!hear()) return;
  events_.on_progress(progress);
}

void WorkerRun::report_tile(const std::string& tile) {
  if (!hear()) return;
  events_.on_tile(tile);
}

Result<void> WorkerRun::report_chunk(const ResultChunk& chunk) {
  if (!hear()) return {};
  const Storing storing(*this);
  if (!refused_checkpoint_.empty() && refused_checkpoint_ == chunk.blob) {
    if (chunk.digest) refused_checkpoint_.clear();
    return {};
  }
  if (!blob_.writer) {
    auto writer = content_.new_blob();
    if (!writer.ok()) return refuse_chunk(chunk, writer.error());
    blob_ = {chunk.blob, std::move(writer).value()};
  }
  if (chunk.blob != blob_.name || chunk.offset != blob_.writer->size()) {
    return invalid_argument("the worker sent part " + std::to_string(chunk.offset) + " of result blob '" + chunk.blob +
                            "' after " + std::to_string(blob_.writer->size()) + " bytes of '" + blob_.name + "'");
  }
  if (auto appended = blob_.writer->append(std::as_bytes(std::span(chunk.bytes))); !appended.ok()) {
    return refuse_chunk(chunk, appended.error());
  }
  if (!chunk.digest) return {};
  store::failpoint("result.blob_complete");
  auto committed = content_.commit(*blob_.writer, *chunk.digest);
  blob_.writer.reset();
  if (!committed.ok()) return refuse_chunk(chunk, committed.error());
  if (chunk.is_checkpoint) events_.on_checkpoint({chunk.blob, *chunk.digest});
  return {};
}

Result<void> WorkerRun::refuse_chunk(const ResultChunk& chunk, const Error& problem) {
  // Bytes that are not what their digest says, and a digest that is none, are the worker's fault.
  if (problem.code == ErrorCode::kDataLoss || problem.code == ErrorCode::kInvalidArgument) return problem;
  if (chunk.is_checkpoint) {
    spdlog::warn("{}: checkpoint '{}' is not kept: {}", assignment_.job, chunk.blob, problem.message);
    blob_ = {};
    if (!chunk.digest) refused_checkpoint_ = chunk.blob;
    return {};
  }
  kill("sent what cannot be kept (" + problem.message + ")", Blame::kServer);
  return {};
}

void WorkerRun::report_dropped_checkpoints(const std::vector<std::string>& names) {
  if (!hear()) return;
  events_.on_drop_checkpoints(names);
}

void WorkerRun::report_outcome(WorkOutcome outcome, const std::vector<Digest>& blobs) {
  {
    const std::lock_guard lock(mutex_);
    if (!kill_reason_.empty() || std::exchange(has_outcome_, true)) return;
  }
  const std::vector<Digest> missing = content_.find_missing(blobs);
  if (!missing.empty()) {
    outcome = {WorkOutcome::Kind::kFailed, "",
               internal_error("the worker's result names blob " + missing.front().sha256 + ", which it never sent")};
  }
  outcome.outputs = blobs;
  events_.on_outcome(std::move(outcome));
}

void WorkerRun::report_disconnected() {
  const std::lock_guard lock(mutex_);
  if (!disconnected_at_) disconnected_at_ = Clock::now();
}

void WorkerRun::request_cancel() {
  const std::lock_guard lock(mutex_);
  if (cancel_requested_at_) return;
  cancel_requested_at_ = Clock::now();
  if (link_) link_->cancel();
}

void WorkerRun::request_finish() {
  const std::lock_guard lock(mutex_);
  if (cancel_requested_at_ || std::exchange(is_finish_requested_, true)) return;
  if (link_) link_->finish();
}

bool WorkerRun::is_cancel_requested() const {
  const std::lock_guard lock(mutex_);
  return cancel_requested_at_.has_value();
}

void WorkerRun::accept() {
  const std::lock_guard lock(mutex_);
  accepted_at_ = Clock::now();
  if (link_) link_->accept();
}

void WorkerRun::kill(const std::string& reason, Blame blame) {
  const std::lock_guard lock(mutex_);
  if (kill_reason_.empty()) {
    kill_reason_ = reason;
    blame_ = blame;
  }
  if (process_) process_->kill_group();
}

std::optional<WorkerRun::Fault> WorkerRun::overstepped_limit(Clock::time_point now) const {
  if (accepted_at_) {
    if (now - *accepted_at_ <= options_.exit_grace) return std::nullopt;
    return Fault{"did not exit within " + in_seconds(options_.exit_grace) + " of its end"};
  }
  if (cancel_requested_at_ && now - *cancel_requested_at_ > options_.cancel_grace) {
    return Fault{"did not stop within " + in_seconds(options_.cancel_grace) + " of being asked"};
  }
  if (has_outcome_) return std::nullopt;  // the queue is storing it
  if (assignment_.time_limit && now - started_at_ > *assignment_.time_limit) {
    return Fault{"took longer than its limit of " + in_seconds(*assignment_.time_limit), Blame::kBake};
  }
  if (disconnected_at_ && now - *disconnected_at_ > options_.disconnect_grace) {
    return Fault{"closed its connection without a result"};
  }
  // What it sends meanwhile waits until what it sent before is on the disk.
  if (!is_storing_ && now - last_heard_at_ > options_.silence_limit) {
    return Fault{"gave no sign of life for " + in_seconds(options_.silence_limit)};
  }
  return std::nullopt;
}

void WorkerRun::check(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (!process_ || !kill_reason_.empty()) return;
  const std::optional<Fault> fault = overstepped_limit(now);
  if (!fault) return;
  kill_reason_ = fault->reason;
  blame_ = fault->blame;
  process_->kill_group();
}

std::string WorkerRun::kill_reason() const {
  const std::lock_guard lock(mutex_);
  return kill_reason_;
}

WorkerRun::Blame WorkerRun::blame() const {
  const std::lock_guard lock(mutex_);
  return blame_;
}

double WorkerRun::seconds() const {
  const std::lock_guard lock(mutex_);
  return std::chrono::duration<double>(Clock::now() - started_at_).count();
}

}  // namespace radbake::jobs
