// Plans: they run beside the bakes, at once, and leave no record.

#include <utility>

#include "server/jobs/job_queue.h"

namespace radbake::jobs {

Result<std::string> JobQueue::start_plan(const store::JobOwner& owner, const store::Work& work, PlanDone on_done) {
  RADBAKE_RETURN_IF_ERROR(check_recovered());
  return thread_.run([&] { return start_plan_run(owner, work, std::move(on_done)); });
}

Result<std::string> JobQueue::start_plan_run(const store::JobOwner& owner, const store::Work& work, PlanDone on_done) {
  if (is_refusing_ || is_draining_) return Error{ErrorCode::kUnavailable, "the server is stopping: plan again later"};
  if (plans_.size() >= options_.max_running_plans) {
    return Error{ErrorCode::kResourceExhausted, std::to_string(plans_.size()) +
                                                    " plans are being made, max_running_plans is " +
                                                    std::to_string(options_.max_running_plans)};
  }
  RADBAKE_ASSIGN_OR_RETURN(store::ContentStore * content, content_.of(owner.tenant));
  const std::string name = "plans/" + std::to_string(next_plan_++);
  constexpr std::uint32_t kOnlyAttempt = 1;
  RunEvents events = ends_of(name, kOnlyAttempt);
  events.on_progress = [](const JobProgress&) {};
  events.on_tile = [](const std::string&) {};
  const auto run = std::make_shared<WorkerRun>(WorkerRun::Assignment{.job = name,
                                                                     .attempt = kOnlyAttempt,
                                                                     .is_plan = true,
                                                                     .work = work,
                                                                     .time_limit = options_.plan_limit,
                                                                     .trace_id = owner.trace_id},
                                               options_.worker, *content, std::move(events));
  add_run(run);
  if (auto started = run->start(*gate_, std::move(ready_)); !started.ok()) {
    const std::lock_guard lock(mutex_);
    runs_.erase(name);
    return started.error();
  }
  plans_[name] = std::move(on_done);
  return name;
}

void JobQueue::cancel_plan(const std::string& name) {
  thread_.post([this, name] {
    if (const auto run = find_run(name)) request_cancel(*run);
  });
}

void JobQueue::finish_plan(const std::string& name, Result<std::string> plan) {
  const auto found = plans_.find(name);
  if (found == plans_.end()) return;
  const PlanDone on_done = std::move(found->second);
  plans_.erase(found);
  on_done(std::move(plan));
}

}  // namespace radbake::jobs
