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

TEST(Log, WritesOneTextLineWhateverTheMessageHolds) {
  const std::string line = logged(false, "info", "a label\n2026-01-31T12:00:00.123Z info radbaked: forged\x1b[2K\r");
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
  EXPECT_THAT(line, ::testing::HasSubstr("a label 2026-01-31T12:00:00.123Z info radbaked: forged [2K "));
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

TEST(Log, SaysTheTraceOfTheInnermostScope) {
  const LogTrace outer("0af7651916cd43dd8448eb211c80319c");
  {
    const LogTrace inner("4bf92f3577b34da6a3ce929d0e0e4736");
    EXPECT_EQ(nlohmann::json::parse(logged(true, "info", "hello"))["trace_id"], "4bf92f3577b34da6a3ce929d0e0e4736");
    const LogTrace none("");
    EXPECT_THAT(logged(false, "info", "hello"),
                ::testing::EndsWith("hello [trace 4bf92f3577b34da6a3ce929d0e0e4736]\n"));
  }
  EXPECT_EQ(nlohmann::json::parse(logged(true, "info", "hello"))["trace_id"], "0af7651916cd43dd8448eb211c80319c");
}

TEST(Log, SaysTheProgramsTraceWhereNoScopeDoes) {
  set_program_trace("0af7651916cd43dd8448eb211c80319c");
  EXPECT_EQ(nlohmann::json::parse(logged(true, "info", "hello"))["trace_id"], "0af7651916cd43dd8448eb211c80319c");
  set_program_trace("");
  EXPECT_FALSE(nlohmann::json::parse(logged(true, "info", "hello")).contains("trace_id"));
}

}  // namespace
}  // namespace radbake
