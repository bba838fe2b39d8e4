#include "client/cli/reporter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

namespace radbake::cli {
namespace {

using Json = nlohmann::ordered_json;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr const char* kTrace = "4bf92f3577b34da6a3ce929d0e0e4736";

v1::Bake bake() {
  v1::Bake bake;
  bake.set_name("bakes/1");
  return bake;
}

/// What a reporter prints on stdout, line by line.
template <typename Calls>
std::vector<std::string> stdout_of(Reporter& reporter, Calls calls) {
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  calls(reporter);
  testing::internal::GetCapturedStderr();
  std::istringstream captured(testing::internal::GetCapturedStdout());
  std::vector<std::string> lines;
  for (std::string line; std::getline(captured, line);) lines.push_back(line);
  return lines;
}

void run_of_a_submit(Reporter& reporter) {
  reporter.stage("reading", -1);
  reporter.warning({"limited", "material 'a\nb' was limited"});
  reporter.submitted(bake());
  v1::WatchBakeResponse response;
  *response.mutable_snapshot() = bake();
  reporter.watched(response);
  response.mutable_event()->set_sequence(1);
  reporter.watched(response);
  response.mutable_progress()->set_fraction(0.5);
  reporter.watched(response);
  *response.mutable_finished() = bake();
  reporter.watched(response);
  reporter.written("bakes/1", "out", {"lightmap_0.exr", "report.json"});
}

TEST(JsonReporter, PrintsOneEventALineAndTheJobFirst) {
  const auto reporter = make_json_reporter(true, kTrace);
  std::vector<std::string> events;
  const auto lines = stdout_of(*reporter, run_of_a_submit);
  for (const std::string& line : lines) events.push_back(Json::parse(line)["event"]);
  EXPECT_EQ(Json::parse(lines[0])["trace_id"], kTrace);
  EXPECT_THAT(events, ElementsAre("submitted", "warning", "snapshot", "state", "progress", "finished", "written"));
}

TEST(JsonReporter, PrintsExactlyOneObjectForACommandThatIsNoStream) {
  const auto downloads = make_json_reporter(false, kTrace);
  const auto lines = stdout_of(*downloads, [](Reporter& reporter) {
    reporter.stage("downloading", -1);
    reporter.note("a note");
    reporter.written("bakes/1", "out", {"report.json"});
  });
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_EQ(Json::parse(lines[0])["files"][0], "report.json");

  const auto fails = make_json_reporter(false, kTrace);
  const auto failure = stdout_of(*fails, [](Reporter& reporter) {
    reporter.failed({ErrorCode::kUnavailable, "nobody there"}, kServerUnreachable);
  });
  ASSERT_EQ(failure.size(), 1u);
  const Json error = Json::parse(failure[0])["error"];
  EXPECT_EQ(error["exit_code"], 4);
  EXPECT_EQ(error["code"], "unavailable");
  EXPECT_EQ(error["message"], "nobody there");
  EXPECT_EQ(error["trace_id"], kTrace);
}

TEST(TextReporter, PrintsTheJobFirstAndTheFilesLastOnStdout) {
  const auto reporter = make_text_reporter();
  EXPECT_THAT(stdout_of(*reporter, run_of_a_submit), ElementsAre("bakes/1", "out/lightmap_0.exr", "out/report.json"));
}

TEST(TextReporter, KeepsErrorsOffStdout) {
  const auto reporter = make_text_reporter();
  EXPECT_THAT(stdout_of(*reporter,
                        [](Reporter& r) {
                          r.failed({ErrorCode::kInvalidArgument, "bad scene"}, kBadScene);
                        }),
              IsEmpty());
}

}  // namespace
}  // namespace radbake::cli
