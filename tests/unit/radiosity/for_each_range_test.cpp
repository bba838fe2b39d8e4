#include "server/radiosity/threads/for_each_range.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <stdexcept>
#include <vector>

namespace radbake::radiosity {
namespace {

// More threads than cores, so that ranges do run beside each other.
class ForEachRange : public ::testing::Test {
 protected:
  static constexpr int kThreads = 4;
  const tbb::global_control limit_{tbb::global_control::max_allowed_parallelism, kThreads};
  tbb::task_arena arena_{kThreads};
};

TEST_F(ForEachRange, VisitsEveryIndexOnce) {
  for (const std::size_t n : {0, 1, 7, 1000}) {
    std::vector<int> visits(n, 0);
    arena_.execute([&] {
      for_each_range(n, 3, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) ++visits[i];
      });
    });
    EXPECT_EQ(visits, std::vector<int>(n, 1));
  }
}

// Under the thread sanitizer: each loop reads what other threads have written in the loop before it.
TEST_F(ForEachRange, SeesWhatTheLoopBeforeHasWritten) {
  constexpr std::size_t kSize = 512, kLoops = 50;
  std::vector<std::size_t> from(kSize, 0), to(kSize, 0);
  arena_.execute([&] {
    for (std::size_t loop = 0; loop < kLoops; ++loop) {
      for_each_range(kSize, 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) to[i] = from[(i + kSize / 2) % kSize] + 1;
      });
      from.swap(to);
    }
  });
  EXPECT_EQ(from, std::vector<std::size_t>(kSize, kLoops));
}

TEST_F(ForEachRange, PassesOnWhatABodyThrows) {
  EXPECT_THROW(arena_.execute([] {
    for_each_range(100, 1, [](std::size_t begin, std::size_t) {
      if (begin > 50) throw std::runtime_error("body");
    });
  }),
               std::runtime_error);
}

}  // namespace
}  // namespace radbake::radiosity
