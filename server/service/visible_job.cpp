#include "server/service/visible_job.h"

namespace radbake::service {
namespace {

constexpr std::size_t kMaxQuotedBytes = 200;

bool may_see(const access::Caller& caller, const store::JobRecord& record) {
  return caller.role == access::Role::kAdmin || record.owner.tenant == caller.tenant;
}

}  // namespace

Result<std::shared_ptr<jobs::Job>> find_visible(jobs::JobQueue& queue, const access::Caller& caller,
                                                const std::string& name) {
  auto job = queue.find(name);
  if (!job.ok() && job.error().code != ErrorCode::kNotFound) return job.error();
  if (job.ok() && may_see(caller, (*job)->record())) return job;
  return Error{ErrorCode::kNotFound, "there is no bake '" + name.substr(0, kMaxQuotedBytes) + "'"};
}

}  // namespace radbake::service
