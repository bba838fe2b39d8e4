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
  std::shared_ptr<Entry> entry;
  {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<Entry>& known = stores_[tenant];
    if (!known) known = std::make_shared<Entry>();
    entry = known;
  }
  if (ContentStore* const opened = entry->opened) return opened;
  return open_store(tenant, *entry);
}

Result<ContentStore*> TenantContent::open_store(const std::string& tenant, Entry& entry) {
  const std::lock_guard opening(entry.opening);
  if (!entry.store) {
    // A digest, since a name may hold anything.
    const std::filesystem::path folder = tenant.empty() ? folder_ : folder_ / "tenants" / digest_of(tenant).sha256;
    RADBAKE_ASSIGN_OR_RETURN(entry.store, ContentStore::open(folder, limits_));
    if (!tenant.empty()) RADBAKE_RETURN_IF_ERROR(sync_folder(folder_, folder_.string()));
    entry.store->set_make_room([this, tenant, content = entry.store.get()](std::uint64_t bytes) {
      std::unique_lock lock(mutex_);
      const auto make_room = make_room_;
      lock.unlock();
      if (make_room) make_room(tenant, *content, bytes);
    });
    entry.store->set_on_refusal([this](const Error& problem) {
      const std::lock_guard lock(mutex_);
      if (on_refusal_) on_refusal_(problem);
    });
    entry.opened = entry.store.get();
  }
  return entry.store.get();
}

void TenantContent::for_each(const std::function<void(const std::string&, ContentStore&)>& visit) {
  std::vector<std::pair<std::string, ContentStore*>> stores;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [tenant, entry] : stores_) {
      if (ContentStore* const opened = entry->opened) stores.emplace_back(tenant, opened);
    }
  }
  for (const auto& [tenant, store] : stores) visit(tenant, *store);
}

void TenantContent::set_make_room(std::function<void(const std::string&, ContentStore&, std::uint64_t)> room) {
  const std::lock_guard lock(mutex_);
  make_room_ = std::move(room);
}

void TenantContent::set_on_refusal(std::function<void(const Error&)> on_refusal) {
  const std::lock_guard lock(mutex_);
  on_refusal_ = std::move(on_refusal);
}

}  // namespace radbake::store
