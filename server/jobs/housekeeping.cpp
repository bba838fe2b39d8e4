#include "server/jobs/housekeeping.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>

namespace radbake::jobs {

using std::chrono::system_clock;

Housekeeping::Housekeeping(const HousekeepingOptions& options, store::JobStore& jobs, store::TenantContent& content)
    : options_(options), jobs_(jobs), content_(content) {
  content_.set_make_room([this](const std::string& tenant, store::ContentStore& store, std::uint64_t bytes) {
    make_room(tenant, store, bytes);
  });
  thread_ = std::jthread([this](const std::stop_token& stop) { keep_house(stop); });
}

Housekeeping::~Housekeeping() { content_.set_make_room({}); }

void Housekeeping::keep_house(const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any woken;
  std::unique_lock lock(mutex);
  while (!stop.stop_requested()) {
    woken.wait_for(lock, stop, options_.interval, [] { return false; });
    const auto resting_since = std::chrono::steady_clock::now() - options_.upload_rest;
    std::uint64_t lacking = options_.lacking_bytes ? options_.lacking_bytes() : 0;
    content_.for_each([&](const std::string& tenant, store::ContentStore& store) {
      store.close_resting_uploads(resting_since);
      // One disk: what one tenant's store gave, the others need not.
      if (lacking > 0) lacking -= std::min(lacking, make_room(tenant, store, lacking));
    });
  }
}

std::uint64_t Housekeeping::make_room(const std::string& tenant, store::ContentStore& content, std::uint64_t bytes) {
  constexpr std::uint32_t kForgottenAtOnce = 20;
  const auto now = system_clock::now();
  const auto forgotten_before =
      std::chrono::duration_cast<std::chrono::milliseconds>((now - options_.keep_results).time_since_epoch()).count();
  std::uint64_t freed = 0;
  const auto give_up = [&freed](const Error& problem) {
    spdlog::error("no room is made: {}", problem.message);
    return freed;
  };
  while (true) {
    const auto needed = jobs_.needed_blobs(tenant);
    if (!needed.ok()) return give_up(needed.error());
    const auto swept = content.sweep(*needed, now - options_.blob_grace, bytes - freed);
    if (!swept.ok()) return give_up(swept.error());
    freed += *swept;
    if (freed >= bytes) break;
    const auto num_forgotten = jobs_.forget_ended(tenant, forgotten_before, kForgottenAtOnce);
    if (!num_forgotten.ok()) return give_up(num_forgotten.error());
    if (*num_forgotten == 0) break;
    spdlog::info("forgot {} bakes that ended more than {} h ago", *num_forgotten, options_.keep_results.count());
  }
  spdlog::info("swept {} bytes, {} were lacking", freed, bytes);
  return freed;
}

}  // namespace radbake::jobs
