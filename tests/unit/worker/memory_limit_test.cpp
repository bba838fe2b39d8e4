#include "server/worker/memory_limit.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <new>
#include <stdexcept>
#include <system_error>
#include <thread>

namespace radbake::worker {
namespace {

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // whose shadow takes terabytes of addresses

void limit_memory() {
  const rlimit limit{rlim_t{1} << 30, rlim_t{1} << 30};
  setrlimit(RLIMIT_AS, &limit);
}

TEST(MemoryLimitDeathTest, IsNamedWithItsValue) {
  EXPECT_EQ(out_of_memory().message, "the bake needs more memory than there is");
  const auto name_limit = [] {
    limit_memory();
    std::fprintf(stderr, "%s", out_of_memory().message.c_str());
    _exit(out_of_memory().code == ErrorCode::kResourceExhausted ? 0 : 1);
  };
  EXPECT_EXIT(name_limit(), ::testing::ExitedWithCode(0), "the bake needs more memory than its limit of 1024 MiB");
}

TEST(MemoryLimitDeathTest, IsTheLastWordOfAThreadThatNobodyListensTo) {
  const auto run_out = [] {
    limit_memory();
    name_lack_of_memory_at_the_end();
    std::thread([] { throw std::bad_alloc(); }).join();
  };
  EXPECT_EXIT(run_out(), ::testing::KilledBySignal(SIGABRT), "the bake needs more memory than its limit of 1024 MiB");
}

#endif

TEST(MemoryLimitDeathTest, IsNotBlamedForOtherEnds) {
  const auto fail = [] {
    name_lack_of_memory_at_the_end();
    std::thread([] { throw std::runtime_error("something else"); }).join();
  };
  EXPECT_EXIT(fail(), ::testing::KilledBySignal(SIGABRT), "something else");
}

TEST(MemoryLimit, KnowsWhatSaysThatThereIsNoMemory) {
  EXPECT_TRUE(is_lack_of_memory(std::bad_alloc()));
  EXPECT_TRUE(is_lack_of_memory(std::bad_array_new_length()));
  EXPECT_TRUE(is_lack_of_memory(std::system_error(EAGAIN, std::generic_category())));
  EXPECT_FALSE(is_lack_of_memory(std::system_error(ENOENT, std::generic_category())));
  EXPECT_FALSE(is_lack_of_memory(std::length_error("a")));
}

}  // namespace
}  // namespace radbake::worker
