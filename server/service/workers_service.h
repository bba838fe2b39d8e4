#pragma once

#include <grpcpp/grpcpp.h>

#include <memory>

#include "common/base/limits.h"
#include "radbake/v1/worker.grpc.pb.h"
#include "server/jobs/job_queue.h"
#include "server/jobs/worker_link.h"
#include "server/service/cost_file.h"
#include "server/service/metrics.h"
#include "server/store/task_pool.h"

namespace radbake::service {

/// radbake.v1.Workers on a gRPC server without a port: it talks over the sockets that workers inherit, and nobody else
/// can reach it.
class WorkersService : public v1::Workers::CallbackService, public jobs::WorkerGate {
 public:
  WorkersService(jobs::JobQueue& queue, CostFile& costs, Metrics& metrics, const Limits& limits)
      : queue_(queue), costs_(costs), metrics_(metrics), limits_(limits) {}

  Result<void> start();
  void stop();

  void adopt(store::FileDescriptor socket) override;
  grpc::ServerBidiReactor<v1::WorkerReport, v1::WorkerCommand>* Report(grpc::CallbackServerContext* context) override;

 private:
  static constexpr int kPoolThreads = 2;

  jobs::JobQueue& queue_;
  CostFile& costs_;
  Metrics& metrics_;
  const Limits limits_;
  // Of its own: a worker whose reports wait behind uploads looks silent, and is killed for it.
  store::TaskPool pool_{kPoolThreads};
  std::unique_ptr<grpc::Server> server_;
};

}  // namespace radbake::service
