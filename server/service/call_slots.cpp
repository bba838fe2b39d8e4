#include "server/service/call_slots.h"

#include "server/service/status.h"

namespace radbake::service {

CallSlots::Slot CallSlots::take(Admission& admission) {
  if (!admission.status.ok()) return {};
  const std::string& tenant = admission.caller.tenant;
  const std::lock_guard lock(mutex_);
  if (num_calls_ >= max_calls_) {
    admission.status = busy(limit_, max_calls_);
    return {};
  }
  const auto found = num_of_tenant_.find(tenant);
  if (max_per_tenant_ <= (found == num_of_tenant_.end() ? 0 : found->second)) {
    admission.status = busy(limit_ + "_per_tenant", max_per_tenant_);
    return {};
  }
  ++num_calls_;
  ++num_of_tenant_[tenant];
  return Slot(shared_from_this(), tenant);
}

void CallSlots::give_back(const std::string& tenant) {
  const std::lock_guard lock(mutex_);
  --num_calls_;
  if (--num_of_tenant_[tenant] == 0) num_of_tenant_.erase(tenant);
}

}  // namespace radbake::service
