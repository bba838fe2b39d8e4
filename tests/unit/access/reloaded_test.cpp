#include "server/access/reloaded.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/service/test_certificates.h"

namespace radbake::access {
namespace {

using radbake::testing::replace_file;

class ReloadedTest : public ::testing::Test {
 protected:
  /// Looks at each call: no test waits for the clock.
  std::unique_ptr<Reloaded<std::string>> open(std::chrono::milliseconds interval = {}) {
    auto opened = Reloaded<std::string>::open(
        {file_}, [this] { return read(); }, interval);
    EXPECT_TRUE(opened.ok());
    return std::move(opened).value();
  }

  Result<std::string> read() {
    ++num_reads_;
    std::ifstream stream(file_);
    std::string text(std::istreambuf_iterator<char>(stream), {});
    if (text.empty() || text == "broken") return invalid_argument(file_.string() + " is broken");
    return text;
  }

  radbake::testing::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "file";
  int num_reads_ = 0;
};

TEST_F(ReloadedTest, FailsToOpenWhatCannotBeRead) {
  EXPECT_FALSE(Reloaded<std::string>::open({file_}, [this] { return read(); }).ok());
}

TEST_F(ReloadedTest, ReadsAgainOnlyWhatHasChanged) {
  replace_file(file_, "first");
  const auto reloaded = open();
  const auto first = reloaded->current();
  EXPECT_EQ(reloaded->current(), first);
  EXPECT_EQ(num_reads_, 1);
  replace_file(file_, "second");
  EXPECT_EQ(*reloaded->current(), "second");
  EXPECT_EQ(*first, "first");
  EXPECT_EQ(num_reads_, 2);
}

TEST_F(ReloadedTest, KeepsTheLastGoodValueAndReadsABrokenFileOnce) {
  replace_file(file_, "good");
  const auto reloaded = open();
  replace_file(file_, "broken");
  EXPECT_EQ(*reloaded->current(), "good");
  EXPECT_EQ(*reloaded->current(), "good");
  EXPECT_EQ(num_reads_, 2);
  std::filesystem::remove(file_);
  EXPECT_EQ(*reloaded->current(), "good");
  replace_file(file_, "better");
  EXPECT_EQ(*reloaded->current(), "better");
}

TEST_F(ReloadedTest, LooksNoMoreThanOnceAnInterval) {
  replace_file(file_, "first");
  const auto reloaded = open(std::chrono::hours(1));
  replace_file(file_, "second");
  EXPECT_EQ(*reloaded->current(), "first");
}

}  // namespace
}  // namespace radbake::access
