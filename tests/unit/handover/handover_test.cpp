#include "server/handover/handover.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>

namespace radbake::handover {
namespace {

class HandoverTest : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends_), 0); }
  void TearDown() override {
    for (const int end : ends_) {
      if (end >= 0) ::close(end);
    }
    for (const int file : files_) ::close(file);
  }

  /// An open file that holds a text.
  int file_of(const std::string& text) {
    const int file = ::memfd_create("input", MFD_CLOEXEC);
    EXPECT_EQ(::write(file, text.data(), text.size()), static_cast<ssize_t>(text.size()));
    files_.push_back(file);
    return file;
  }

  static std::string text_of(int file) {
    char text[100];
    const ssize_t count = ::pread(file, text, sizeof text, 0);
    return std::string(text, count < 0 ? 0 : static_cast<std::size_t>(count));
  }

  int ends_[2] = {-1, -1};
  std::vector<int> files_;
};

TEST_F(HandoverTest, TellsAWorkerThatWaitsFromOneThatIsGone) {
  using std::chrono::milliseconds;
  constexpr milliseconds kShort{10}, kLong{3'600'000};
  EXPECT_FALSE(is_announced(ends_[0], kShort));
  ASSERT_TRUE(announce(ends_[1]).ok());
  EXPECT_TRUE(is_announced(ends_[0], kLong));
  // What it said is off the socket: the handover follows.
  ASSERT_TRUE(give(ends_[0], {"bakes/1", 1, {}}).ok());
  EXPECT_EQ(take(ends_[1]).value().job, "bakes/1");
  ::close(ends_[1]);
  ends_[1] = -1;
  EXPECT_FALSE(is_announced(ends_[0], kLong));
  EXPECT_FALSE(announce(ends_[0]).ok());
}

TEST_F(HandoverTest, PassesNameAndInputsAndLeavesWhatFollows) {
  const Assignment given{"bakes/0123456789abcdef", 3, {file_of("manifest"), file_of("mesh")}};
  ASSERT_TRUE(give(ends_[0], given).ok());
  ASSERT_EQ(::write(ends_[0], "PRI", 3), 3);  // as gRPC begins
  const auto taken = take(ends_[1]);
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  EXPECT_EQ(taken->job, given.job);
  EXPECT_EQ(taken->attempt, 3u);
  ASSERT_EQ(taken->inputs.size(), 2u);
  EXPECT_EQ(text_of(taken->inputs[0]), "manifest");
  EXPECT_EQ(text_of(taken->inputs[1]), "mesh");
  for (const int file : taken->inputs) {
    EXPECT_EQ(::fcntl(file, F_GETFD), FD_CLOEXEC);
    ::close(file);
  }
  char after[10];
  EXPECT_EQ(std::string(after, static_cast<std::size_t>(::read(ends_[1], after, sizeof after))), "PRI");
}

TEST_F(HandoverTest, PassesAsManyInputsAsItPromises) {
  Assignment given{std::string(kMaxJobBytes, 'j'), 1, {}};
  for (std::size_t i = 0; i < kMaxInputs; ++i) given.inputs.push_back(file_of(std::to_string(i)));
  EXPECT_TRUE(fits(given));
  ASSERT_TRUE(give(ends_[0], given).ok());
  const auto taken = take(ends_[1]);
  ASSERT_TRUE(taken.ok()) << taken.error().message;
  EXPECT_EQ(taken->job, given.job);
  ASSERT_EQ(taken->inputs.size(), kMaxInputs);
  for (std::size_t i = 0; i < kMaxInputs; ++i) {
    EXPECT_EQ(text_of(taken->inputs[i]), std::to_string(i));
    ::close(taken->inputs[i]);
  }
  given.inputs.push_back(0);
  EXPECT_FALSE(fits(given));
  EXPECT_FALSE(fits({std::string(kMaxJobBytes + 1, 'j'), 1, {}}));
}

TEST_F(HandoverTest, TellsThatTheOtherEndHasGone) {
  ::close(ends_[0]);
  ends_[0] = -1;
  EXPECT_EQ(take(ends_[1]).error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(give(ends_[1], {"bakes/1", 1, {}}).error().code, ErrorCode::kUnavailable);
}

TEST_F(HandoverTest, RefusesWhatIsNoJob) {
  const std::string text = "GET / HTTP/1.1";
  ASSERT_EQ(::write(ends_[0], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  EXPECT_EQ(take(ends_[1]).error().code, ErrorCode::kInternal);
}

}  // namespace
}  // namespace radbake::handover
