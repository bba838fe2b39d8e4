#include "server/service/plan_reactor.h"

#include "server/service/status.h"

namespace radbake::service {

void PlanReactor::begin(const grpc::Status& admission, const store::JobOwner& owner, const store::Work& work) {
  if (!admission.ok()) return Finish(admission);
  const auto name = queue_.start_plan(owner, work, [this](const Result<std::string>& plan) { end(plan); });
  if (!name.ok()) return Finish(busy(name.error(), "max_running_plans"));
  std::unique_lock lock(mutex_);
  is_begun_ = true;
  name_ = *name;
  if (is_cancelled_) queue_.cancel_plan(name_);
  // The plan may have come before we got here.
  if (!is_over_) return;
  lock.unlock();
  end(result_);
}

void PlanReactor::OnCancel() {
  const std::lock_guard lock(mutex_);
  is_cancelled_ = true;
  if (is_begun_) queue_.cancel_plan(name_);
}

void PlanReactor::end(const Result<std::string>& plan) {
  {
    const std::lock_guard lock(mutex_);
    is_over_ = true;
    if (!is_begun_) {
      result_ = plan;
      return;
    }
  }
  if (!plan.ok()) return Finish(to_status(plan.error()));
  if (!plan_->ParseFromString(*plan)) return Finish(to_status(internal_error("the worker's plan is not readable")));
  Finish(grpc::Status::OK);
}

}  // namespace radbake::service
