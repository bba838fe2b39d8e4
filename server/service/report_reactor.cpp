#include "server/service/report_reactor.h"

#include <utility>
#include <vector>

#include "server/service/convert.h"
#include "server/service/status.h"

namespace radbake::service {
namespace {

/// The queue's way to a worker.
class Link : public jobs::WorkerLink {
 public:
  explicit Link(std::weak_ptr<ReportReactor> reactor) : reactor_(std::move(reactor)) {}

  void start(const jobs::WorkOrder& order) override {
    if (const auto reactor = reactor_.lock()) reactor->send(reactor->start_command(order));
  }
  void cancel() override {
    v1::WorkerCommand command;
    command.mutable_cancel();
    if (const auto reactor = reactor_.lock()) reactor->send(std::move(command));
  }
  void finish() override {
    v1::WorkerCommand command;
    command.mutable_finish();
    if (const auto reactor = reactor_.lock()) reactor->send(std::move(command));
  }
  void accept() override {
    v1::WorkerCommand command;
    command.mutable_accepted();
    if (const auto reactor = reactor_.lock()) reactor->send(std::move(command));
  }

 private:
  const std::weak_ptr<ReportReactor> reactor_;
};

}  // namespace

ReportReactor* ReportReactor::start(jobs::JobQueue& queue, store::TaskPool& pool, CostFile& costs, Metrics& metrics,
                                    const Limits& limits) {
  const std::shared_ptr<ReportReactor> reactor(new ReportReactor(queue, pool, costs, metrics, limits));
  reactor->self_ = reactor;
  reactor->StartRead(&reactor->report_);
  return reactor.get();
}

void ReportReactor::OnReadDone(bool ok) {
  if (!ok) {
    if (run_) run_->report_disconnected();
    return end(grpc::Status::OK);
  }
  pool_.post([self = shared_from_this()] {
    const grpc::Status status = self->take_report();
    if (!status.ok()) return self->end(status);
    const std::lock_guard lock(self->mutex_);
    if (!self->is_finished_) self->StartRead(&self->report_);
  });
}

grpc::Status ReportReactor::take_report() {
  if (report_.has_hello()) {
    const v1::WorkerHello& hello = report_.hello();
    auto run = queue_.greet({hello.job(), hello.attempt(), hello.engine_version(), hello.protocol_major()},
                            std::make_shared<Link>(weak_from_this()));
    if (!run.ok()) return to_status(run.error());
    run_ = std::move(run).value();
    return grpc::Status::OK;
  }
  if (!run_) return {grpc::StatusCode::FAILED_PRECONDITION, "a worker's first message is its hello"};
  using Outcome = jobs::WorkOutcome;
  switch (report_.kind_case()) {
    case v1::WorkerReport::kProgress: run_->report_progress(from_message(report_.progress())); break;
    case v1::WorkerReport::kTile: run_->report_tile(report_.tile().SerializeAsString()); break;
    case v1::WorkerReport::kChunk: {
      const v1::ResultBlobChunk& chunk = report_.chunk();
      std::optional<Digest> digest;
      if (chunk.finish()) digest = from_message(chunk.digest());
      const auto stored =
          run_->report_chunk({chunk.blob(), chunk.offset(), chunk.data(), digest, chunk.is_checkpoint()});
      if (!stored.ok()) run_->report_outcome({Outcome::Kind::kFailed, "", stored.error()}, {});
      break;
    }
    case v1::WorkerReport::kBakeFinished: {
      const v1::BakeReport& report = report_.bake_finished().report();
      costs_.add(report.run().costs());
      metrics_.bake_reported(report.num_row_rays() + report.num_gather_rays() + report.num_light_rays(),
                             report.run().rays_per_second(), report.run().peak_memory_bytes());
      std::vector<Digest> blobs;
      for (const v1::Layer& layer : report_.bake_finished().layers()) blobs.push_back(from_message(layer.blob()));
      if (report_.bake_finished().has_mesh_data()) blobs.push_back(from_message(report_.bake_finished().mesh_data()));
      run_->report_outcome({Outcome::Kind::kSucceeded, report_.bake_finished().SerializeAsString(), {}}, blobs);
      break;
    }
    case v1::WorkerReport::kPlanFinished:
      run_->report_outcome({Outcome::Kind::kSucceeded, report_.plan_finished().SerializeAsString(), {}}, {});
      break;
    case v1::WorkerReport::kFailed:
      run_->report_outcome({Outcome::Kind::kFailed, "", from_message(report_.failed())}, {});
      break;
    case v1::WorkerReport::kCancelled: run_->report_outcome({Outcome::Kind::kCancelled, "", {}}, {}); break;
    case v1::WorkerReport::kDropCheckpoints: {
      const auto& names = report_.drop_checkpoints().names();
      run_->report_dropped_checkpoints({names.begin(), names.end()});
      break;
    }
    case v1::WorkerReport::kHello:
    case v1::WorkerReport::KIND_NOT_SET: break;
  }
  return grpc::Status::OK;
}

v1::WorkerCommand ReportReactor::start_command(const jobs::WorkOrder& order) const {
  v1::WorkerCommand command;
  v1::StartWork& start = *command.mutable_start();
  start.set_plan_only(order.is_plan);
  start.set_waited_seconds(order.waited_seconds);
  start.set_trace_id(order.trace_id);
  *start.mutable_manifest() = to_message(order.work.manifest);
  start.mutable_settings()->ParseFromString(order.work.settings);
  start.mutable_run()->ParseFromString(order.work.run);
  *start.mutable_limits() = limits_message<v1::Limits>(limits_);
  *start.mutable_costs() = costs_.costs();
  for (const jobs::InputFile& file : order.inputs) {
    v1::InputBlob& input = *start.add_inputs();
    *input.mutable_digest() = to_message(file.digest);
    input.set_fd(file.fd);
  }
  for (const jobs::CheckpointFile& left : order.checkpoints) {
    v1::Checkpoint& checkpoint = *start.add_checkpoints();
    checkpoint.set_name(left.name);
    *checkpoint.mutable_digest() = to_message(left.file.digest);
    checkpoint.set_fd(left.file.fd);
  }
  return command;
}

void ReportReactor::send(v1::WorkerCommand command) {
  const std::lock_guard lock(mutex_);
  commands_.push_back(std::move(command));
  write_or_finish();
}

void ReportReactor::end(const grpc::Status& status) {
  const std::lock_guard lock(mutex_);
  if (!end_status_) end_status_ = status;
  write_or_finish();
}

void ReportReactor::write_or_finish() {
  if (is_writing_ || is_finished_) return;
  if (end_status_) {
    is_finished_ = true;
    Finish(*end_status_);
  } else if (!commands_.empty()) {
    is_writing_ = true;
    StartWrite(&commands_.front());
  }
}

void ReportReactor::OnWriteDone(bool ok) {
  const std::lock_guard lock(mutex_);
  is_writing_ = false;
  const bool was_last = commands_.front().has_accepted();
  commands_.pop_front();
  if ((was_last || !ok) && !end_status_) end_status_ = grpc::Status::OK;
  write_or_finish();
}

void ReportReactor::OnDone() {
  const auto last = std::move(self_);  // may delete this
}

}  // namespace radbake::service
