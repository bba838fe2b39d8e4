// Jobs that share one run.

#include <spdlog/spdlog.h>

#include "server/jobs/job_queue.h"

namespace radbake::jobs {

using store::JobRecord;
using store::JobState;

std::shared_ptr<Job> JobQueue::find_leader(const store::JobOwner& owner, const std::string& bake_key) const {
  const auto sharers = sharers_.find(scoped(owner.tenant, bake_key));
  if (sharers == sharers_.end()) return nullptr;
  for (const auto& job : sharers->second) {
    const std::string& name = job->name();
    if (leaders_.contains(name) || to_finish_.contains(name) || is_unsaved(job)) continue;
    const auto run = find_run(name);
    if (!run || !run->is_cancel_requested()) return job;
  }
  return nullptr;
}

std::shared_ptr<Job> JobQueue::leader_of(const std::string& follower) const {
  const auto found = leaders_.find(follower);
  return found == leaders_.end() ? nullptr : find_live(found->second);
}

void JobQueue::follow(const std::shared_ptr<Job>& follower, const std::shared_ptr<Job>& leader) {
  const JobRecord own = follower->record(), leads = leader->record();
  leaders_[own.name] = leads.name;
  leader->add_follower(follower);
  spdlog::info("{} shares the run of {}", own.name, leads.name);
  if (!is_running(leads.state)) return;
  const auto changed = change_one(follower, {.state = leads.state, .message = "shares the run of " + leads.name});
  if (!changed.ok()) spdlog::error("{}: {}", own.name, changed.error().message);
}

void JobQueue::leave_leader(const std::shared_ptr<Job>& follower) {
  const std::string& name = follower->name();
  if (const auto leader = leader_of(name)) leader->remove_follower(follower);
  leaders_.erase(name);
}

void JobQueue::hand_over_followers(const std::shared_ptr<Job>& leader) {
  std::shared_ptr<Job> next;
  for (const auto& follower : leader->followers()) {
    leader->remove_follower(follower);
    leaders_.erase(follower->name());
    if (next) {
      follow(follower, next);
      continue;
    }
    next = follower;
    queue_again(next, "runs by itself: " + leader->name() + " ended early", false);
  }
}

}  // namespace radbake::jobs
