#include "server/store/tenant_content.h"

#include <utility>
#include <vector>

namespace radbake::store {

Result<std::unique_ptr<TenantContent>> TenantContent::open(const std::filesystem::path& folder,
                                                           const ContentLimits& limits) {
  std::unique_ptr<TenantContent> content(new TenantContent(folder, limits));
  RADBAKE_ASSIGN_OR_RETURN([[maybe_unused]] ContentStore * own, content->of(""));
  return content;
}

TenantContent::TenantContent(std::filesystem::path folder, const ContentLimits& limits)
    : folder_(std::move(folder)), limits_(limits) {}

Result<ContentStore*> TenantContent::of(const std::string& tenant) {
  const std::lock_guard lock(mutex_);
  if (const auto found = stores_.find(tenant); found != stores_.end()) return found->second.get();
  // A digest, since a name may hold anything.
  const std::filesystem::path folder = tenant.empty() ? folder_ : folder_ / "tenants" / digest_of(tenant).sha256;
  RADBAKE_ASSIGN_OR_RETURN(std::unique_ptr<ContentStore> store, ContentStore::open(folder, limits_));
  tell_make_room(tenant, *store);
  return (stores_[tenant] = std::move(store)).get();
}

void TenantContent::tell_make_room(const std::string& tenant, ContentStore& content) {
  if (!make_room_) return;
  content.set_make_room([this, tenant, &content](std::uint64_t bytes) { make_room_(tenant, content, bytes); });
}

std::uint64_t TenantContent::upload_bytes() {
  std::uint64_t total = 0;
  for_each([&](const std::string&, ContentStore& content) { total += content.upload_bytes(); });
  return total;
}

void TenantContent::for_each(const std::function<void(const std::string&, ContentStore&)>& visit) {
  std::vector<std::pair<std::string, ContentStore*>> stores;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [tenant, store] : stores_) stores.emplace_back(tenant, store.get());
  }
  for (const auto& [tenant, store] : stores) visit(tenant, *store);
}

void TenantContent::set_make_room(std::function<void(const std::string&, ContentStore&, std::uint64_t)> room) {
  const std::lock_guard lock(mutex_);
  make_room_ = std::move(room);
  for (const auto& [tenant, store] : stores_) tell_make_room(tenant, *store);
}

}  // namespace radbake::store
