#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/store/content_store.h"

namespace radbake::store {

/// The content of each tenant in a folder of its own: none can tell what another one has. Thread-safe.
class TenantContent {
 public:
  /// `max_bytes` of the limits is a tenant's.
  static Result<std::unique_ptr<TenantContent>> open(const std::filesystem::path& folder, const ContentLimits& limits);

  /// Opens the tenant's store where it is not. The server's own, of the empty name, always is. It stays open, and where
  /// it is. Errors: as ContentStore::open().
  Result<ContentStore*> of(const std::string& tenant);
  /// Those that are open.
  void for_each(const std::function<void(const std::string& tenant, ContentStore& content)>& visit);
  // As ContentStore's; for stores that are opened later, too. Empty: nobody listens any more.
  void set_make_room(std::function<void(const std::string& tenant, ContentStore& content, std::uint64_t bytes)> room);
  void set_on_refusal(std::function<void(const Error&)> on_refusal);

 private:
  /// One that is being opened keeps only its own tenant waiting.
  struct Entry {
    std::mutex opening;
    std::unique_ptr<ContentStore> store;          // set once, under `opening`
    std::atomic<ContentStore*> opened = nullptr;  // the same, for all to read
  };

  TenantContent(std::filesystem::path folder, const ContentLimits& limits);
  Result<ContentStore*> open_store(const std::string& tenant, Entry& entry);

  const std::filesystem::path folder_;
  const ContentLimits limits_;
  std::mutex mutex_;  // guards what follows
  std::map<std::string, std::shared_ptr<Entry>> stores_;
  std::function<void(const std::string&, ContentStore&, std::uint64_t)> make_room_;
  std::function<void(const Error&)> on_refusal_;
};

}  // namespace radbake::store
