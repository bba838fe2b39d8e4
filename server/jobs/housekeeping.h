#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

#include "server/store/job_store.h"
#include "server/store/tenant_content.h"

namespace radbake::jobs {

struct HousekeepingOptions {
  std::chrono::seconds interval{30};
  std::chrono::seconds blob_grace{3600};     ///< what somebody asked for is kept this long, needed or not
  std::chrono::seconds upload_rest{60};      ///< an upload that rests this long gives its open file back
  std::chrono::hours keep_results{30 * 24};  ///< bakes that ended are forgotten after this, where room is needed
  std::function<std::uint64_t()> lacking_bytes = {};  ///< what the disk lacks at present; null: nothing
};

/// Makes room: a mark and sweep over what jobs need and what is stored.
///
/// Needed are the inputs of jobs that have not ended, results, and checkpoints. Other blobs are kept until an upload
/// lacks room, or the disk does, then the ones unused the longest go first, but none within its grace: who has just
/// asked for a blob may be about to submit a bake of it. Where that is not enough, bakes that ended long ago are
/// forgotten with their results, oldest first.
class Housekeeping {
 public:
  Housekeeping(const HousekeepingOptions& options, store::JobStore& jobs, store::TenantContent& content);
  ~Housekeeping();

  /// Frees at least so many bytes of a tenant's, if it can; how many it freed.
  std::uint64_t make_room(const std::string& tenant, store::ContentStore& content, std::uint64_t bytes);

 private:
  void keep_house(const std::stop_token& stop);

  const HousekeepingOptions options_;
  store::JobStore& jobs_;
  store::TenantContent& content_;
  std::jthread thread_;
};

}  // namespace radbake::jobs
