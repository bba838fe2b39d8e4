#pragma once

#include <grpcpp/grpcpp.h>

#include <deque>
#include <memory>
#include <mutex>
#include <optional>

#include "common/base/limits.h"
#include "radbake/v1/worker.pb.h"
#include "server/jobs/job_queue.h"
#include "server/jobs/worker_link.h"
#include "server/service/cost_file.h"
#include "server/service/metrics.h"
#include "server/store/task_pool.h"

namespace radbake::service {

/// One worker's Report call. Reports are taken one after the other on the pool, the next is read when the last is on
/// its way to the disk; commands are written one at a time. A link lets the queue send commands for as long as the call
/// lives.
class ReportReactor : public grpc::ServerBidiReactor<v1::WorkerReport, v1::WorkerCommand>,
                      public std::enable_shared_from_this<ReportReactor> {
 public:
  static ReportReactor* start(jobs::JobQueue& queue, store::TaskPool& pool, CostFile& costs, Metrics& metrics,
                              const Limits& limits);

  void OnReadDone(bool ok) override;
  void OnWriteDone(bool ok) override;
  void OnDone() override;

  /// Sends a command when its turn has come; nothing after the call has ended.
  void send(v1::WorkerCommand command);
  v1::WorkerCommand start_command(const jobs::WorkOrder& order) const;

 private:
  ReportReactor(jobs::JobQueue& queue, store::TaskPool& pool, CostFile& costs, Metrics& metrics, const Limits& limits)
      : queue_(queue), pool_(pool), costs_(costs), metrics_(metrics), limits_(limits) {}

  grpc::Status take_report();
  void end(const grpc::Status& status);
  void write_or_finish();  // under mutex_

  jobs::JobQueue& queue_;
  store::TaskPool& pool_;
  CostFile& costs_;
  Metrics& metrics_;
  const Limits limits_;
  std::shared_ptr<ReportReactor> self_;  // until OnDone

  // Touched by reads alone.
  v1::WorkerReport report_;
  std::shared_ptr<jobs::WorkerRun> run_;

  std::mutex mutex_;  // guards what follows
  std::deque<v1::WorkerCommand> commands_;
  std::optional<grpc::Status> end_status_;
  bool is_writing_ = false;
  bool is_finished_ = false;
};

}  // namespace radbake::service
