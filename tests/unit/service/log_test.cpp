#include "common/log/log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>

namespace radbake {
namespace {

std::string logged(bool is_json, const std::string& level, const std::string& message) {
  ::testing::internal::CaptureStderr();
  EXPECT_TRUE(set_up_log({"tester", level, is_json}).ok());
  spdlog::debug("hidden");
  spdlog::warn("{}", message);
  return ::testing::internal::GetCapturedStderr();
}

TEST(Log, WritesTextLines) {
  EXPECT_THAT(logged(false, "info", "hello"),
              ::testing::MatchesRegex("[0-9]+-[0-9]+-[0-9]+T[0-9]+:[0-9]+:[0-9]+.[0-9]+Z warning tester: hello\n"));
}

TEST(Log, WritesOneJsonObjectALineWhateverTheMessageHolds) {
  const std::string message = "quote \" backslash \\ line\nbreak \x01 \xff end";
  const std::string line = logged(true, "info", message);
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
  const auto object = nlohmann::json::parse(line);
  EXPECT_EQ(object["level"], "warning");
  EXPECT_EQ(object["program"], "tester");
  EXPECT_THAT(object["message"].get<std::string>(), ::testing::StartsWith("quote \" backslash \\ line\nbreak \x01 "));
}

TEST(Log, KeepsToItsLevel) {
  EXPECT_EQ(logged(false, "error", "hello"), "");
  EXPECT_THAT(logged(false, "debug", "hello"), ::testing::HasSubstr("hidden"));
}

TEST(Log, RefusesALevelThatDoesNotExist) {
  const auto refused = set_up_log({"tester", "loud", false});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("'loud'"));
}

}  // namespace
}  // namespace radbake
