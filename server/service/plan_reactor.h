#pragma once

#include <grpcpp/grpcpp.h>

#include <mutex>
#include <string>

#include "radbake/v1/plan.pb.h"
#include "server/jobs/job_queue.h"

namespace radbake::service {

/// One PlanBake call: ends with its worker, and the worker with it. Deletes itself.
class PlanReactor : public grpc::ServerUnaryReactor {
 public:
  PlanReactor(jobs::JobQueue& queue, v1::Plan* plan) : queue_(queue), plan_(plan) {}

  /// Starts the worker, or finishes with what spoke against it.
  void begin(const grpc::Status& admission, const store::JobOwner& owner, const store::Work& work);

  void OnCancel() override;
  void OnDone() override { delete this; }

 private:
  void end(const Result<std::string>& plan);

  jobs::JobQueue& queue_;
  v1::Plan* const plan_;
  std::mutex mutex_;  // guards what follows
  bool is_cancelled_ = false;
  bool is_over_ = false;   // the queue has called end()
  bool is_begun_ = false;  // begin() no longer touches this object
  Result<std::string> result_ = std::string();
  std::string name_;
};

}  // namespace radbake::service
