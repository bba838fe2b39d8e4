#include "client/cli/result_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <optional>
#include <sstream>

namespace radbake::cli {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::UnorderedElementsAre;

class ResultFolderTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string path = (fs::temp_directory_path() / "result-folder-test-XXXXXX").string();
    place_ = mkdtemp(path.data());
  }
  void TearDown() override { fs::remove_all(place_); }

  static void write(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }
  static std::string read(const fs::path& path) {
    std::stringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
  }
  std::vector<std::string> names(const fs::path& folder) const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) names.push_back(entry.path().filename());
    return names;
  }

  fs::path place_;
};

TEST_F(ResultFolderTest, ShowsNothingBeforeItIsPublished) {
  Result<ResultFolder> folder = ResultFolder::open(place_ / "a" / "out/", false);
  ASSERT_TRUE(folder.ok()) << folder.error().message;
  write(folder->building() / kReportName, "new");
  EXPECT_FALSE(fs::exists(place_ / "a" / "out"));
  ASSERT_TRUE(folder->publish().ok());
  EXPECT_EQ(read(place_ / "a" / "out" / kReportName), "new");
  EXPECT_THAT(names(place_ / "a"), UnorderedElementsAre("out"));
}

TEST_F(ResultFolderTest, LeavesNothingBehindWhenItIsNotPublished) {
  {
    Result<ResultFolder> folder = ResultFolder::open(place_ / "out", false);
    ASSERT_TRUE(folder.ok());
    write(folder->building() / kReportName, "half");
  }
  EXPECT_TRUE(fs::is_empty(place_));
}

TEST_F(ResultFolderTest, UsesAnEmptyFolderAsItIs) {
  fs::create_directory(place_ / "out");
  Result<ResultFolder> folder = ResultFolder::open(place_ / "out", false);
  ASSERT_TRUE(folder.ok());
  write(folder->building() / kReportName, "new");
  ASSERT_TRUE(folder->publish().ok());
  EXPECT_THAT(names(place_ / "out"), UnorderedElementsAre(kReportName));
}

TEST_F(ResultFolderTest, RefusesAFolderThatIsNotEmptyUnlessForced) {
  fs::create_directory(place_ / "out");
  write(place_ / "out" / "mine.txt", "mine");
  write(place_ / "out" / kReportName, "old");
  const Result<ResultFolder> refused = ResultFolder::open(place_ / "out", false);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("is not empty"));
  EXPECT_THAT(names(place_ / "out"), UnorderedElementsAre("mine.txt", kReportName));

  Result<ResultFolder> forced = ResultFolder::open(place_ / "out", true);
  ASSERT_TRUE(forced.ok());
  write(forced->building() / kReportName, "new");
  write(forced->building() / "lightmap_0.exr", "pixels");
  EXPECT_EQ(read(place_ / "out" / kReportName), "old");
  ASSERT_TRUE(forced->publish().ok());
  EXPECT_THAT(names(place_ / "out"), UnorderedElementsAre("mine.txt", kReportName, "lightmap_0.exr"));
  EXPECT_EQ(read(place_ / "out" / kReportName), "new");
  EXPECT_EQ(read(place_ / "out" / "mine.txt"), "mine");
}

TEST_F(ResultFolderTest, RefusesAFileInPlaceOfAFolder) {
  write(place_ / "file", "");
  EXPECT_THAT(ResultFolder::open(place_ / "file", true).error().message, HasSubstr("is not a folder"));
  EXPECT_FALSE(ResultFolder::open(place_ / "file" / "out", false).ok());
}

}  // namespace
}  // namespace radbake::cli
