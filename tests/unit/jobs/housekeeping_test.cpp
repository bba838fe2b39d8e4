#include "server/jobs/housekeeping.h"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "tests/unit/store/temporary_folder.h"

namespace radbake::jobs {
namespace {

using namespace std::chrono_literals;

constexpr auto kWaitLimit = 60s;

TEST(Housekeeping, SweepsWhereTheDiskLacksRoom) {
  const store::TemporaryFolder folder;
  auto content = std::move(store::TenantContent::open(folder.path() / "content", {1 << 20, 0})).value();
  auto jobs = std::move(store::JobStore::open(folder.path() / "jobs.sqlite")).value();
  store::ContentStore& store = **content->of("somebody");
  std::vector<Digest> blobs;
  for (const std::string text : {"of nobody", "of a bake"}) {
    const Digest blob = digest_of(text);
    ASSERT_TRUE(store.append_upload(blob, 0, std::as_bytes(std::span(text))).ok());
    ASSERT_TRUE(store.finish_upload(blob).ok());
    blobs.push_back(blob);
  }
  store::Work work;
  work.inputs = {blobs[1]};
  ASSERT_TRUE(jobs->create({"a", "body", "label", "key", work, {.tenant = "somebody"}}).ok());
  std::atomic<std::uint64_t> lacking = 0;
  HousekeepingOptions options;
  options.interval = 0s;
  options.blob_grace = -1h;  // whatever was asked for just now
  options.lacking_bytes = [&] { return lacking.load(); };
  const Housekeeping housekeeping(options, *jobs, *content);
  std::this_thread::sleep_for(20ms);
  EXPECT_EQ(store.used_bytes(), blobs[0].size_bytes + blobs[1].size_bytes);
  lacking = 1000;
  const auto limit = std::chrono::steady_clock::now() + kWaitLimit;
  while (store.used_bytes() > blobs[1].size_bytes && std::chrono::steady_clock::now() < limit) {
    std::this_thread::sleep_for(1ms);
  }
  lacking = 0;
  EXPECT_EQ(store.used_bytes(), blobs[1].size_bytes);
  EXPECT_TRUE(store.contains(blobs[1]));
}

}  // namespace
}  // namespace radbake::jobs
