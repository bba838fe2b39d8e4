// From the caller's traceparent to the lines of the server's log and of the worker's.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "tests/service/server_program.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

using nlohmann::json;

constexpr const char* kTrace = "4bf92f3577b34da6a3ce929d0e0e4736";
constexpr const char* kTraceparent = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";

/// The lines of a log that hold a text.
std::vector<json> lines_with(const std::string& output, const std::string& text) {
  std::istringstream lines(output);
  std::string line;
  std::vector<json> found;
  while (std::getline(lines, line)) {
    if (line.starts_with('{') && line.find(text) != std::string::npos) found.push_back(json::parse(line));
  }
  return found;
}

class TraceTest : public ::testing::Test {
 protected:
  /// Submits a scene that the real worker cannot decode; the output of the server, which has ended then.
  std::string output_of_a_failed_bake(const std::vector<std::string>& traceparents) {
    ServerProgram program({"--listen", "unix:" + (folder_.path() / "socket").string(), "--data",
                           (folder_.path() / "data").string(), "--worker", RADBAKE_WORKER, "--log-json", "--log-level",
                           "debug"});
    TestClient client(program.wait_for_address());
    const auto request = client.request_for(client.upload_scene(), kSucceed);
    const auto context = new_context();
    for (const std::string& header : traceparents) context->AddMetadata("traceparent", header);
    v1::Bake bake;
    EXPECT_TRUE(client.bakes->SubmitBake(context.get(), request, &bake).ok());
    EXPECT_EQ(client.watch(bake.name()).finished().state(), v1::FAILED);
    EXPECT_EQ(program.end(SIGTERM), 0);
    return program.output();
  }

  TemporaryFolder folder_;
};

TEST_F(TraceTest, IsInEveryLineAboutTheCallItsJobAndItsWorker) {
  const std::string output = output_of_a_failed_bake({kTraceparent});
  const auto calls = lines_with(output, "SubmitBake OK");
  ASSERT_EQ(calls.size(), 1u);
  EXPECT_EQ(calls[0]["trace_id"], kTrace);
  const auto jobs = lines_with(output, "bakes/");
  std::set<std::string> programs;
  for (const json& line : jobs) {
    EXPECT_EQ(line.value("trace_id", ""), kTrace) << line.dump();
    programs.insert(line["program"]);
  }
  EXPECT_EQ(programs, (std::set<std::string>{"radbaked", "radbake-worker"})) << output;
}

TEST_F(TraceTest, IsNewForACallThatBringsNone) {
  const std::string output = output_of_a_failed_bake({});
  const auto calls = lines_with(output, "SubmitBake OK");
  ASSERT_EQ(calls.size(), 1u);
  const std::string trace = calls[0]["trace_id"];
  EXPECT_THAT(trace, ::testing::MatchesRegex("[0-9a-f]+"));
  EXPECT_EQ(trace.size(), 32u);
  const auto jobs = lines_with(output, "bakes/");
  EXPECT_GE(jobs.size(), 3u);
  for (const json& line : jobs) EXPECT_EQ(line.value("trace_id", ""), trace) << line.dump();
  // Another call is another trace.
  const auto uploads = lines_with(output, "Content/Upload OK");
  ASSERT_FALSE(uploads.empty());
  EXPECT_NE(uploads[0]["trace_id"], trace);
}

TEST_F(TraceTest, IsNewForACallWhoseTraceparentIsWrongOrTwofold) {
  for (const std::vector<std::string>& wrong :
       {std::vector<std::string>{"00-00000000000000000000000000000000-00f067aa0ba902b7-01"},
        {"not one\", \"level\": \"forged"},
        {kTraceparent, "00-0af7651916cd43dd8448eb211c80319c-00f067aa0ba902b7-01"}}) {
    const auto calls = lines_with(output_of_a_failed_bake(wrong), "SubmitBake OK");
    ASSERT_EQ(calls.size(), 1u);
    const std::string trace = calls[0]["trace_id"];
    EXPECT_EQ(trace.size(), 32u);
    EXPECT_NE(trace, kTrace);
    EXPECT_EQ(trace.find_first_not_of("0123456789abcdef"), std::string::npos);
    EXPECT_NE(trace.find_first_not_of('0'), std::string::npos);
  }
}

TEST_F(TraceTest, IsInTextLinesToo) {
  ServerProgram program({"--listen", "unix:" + (folder_.path() / "socket").string(), "--data",
                         (folder_.path() / "data").string(), "--worker", RADBAKE_FAKE_WORKER});
  TestClient client(program.wait_for_address());
  v1::Bake bake;
  v1::GetBakeRequest request;
  request.set_name("bakes/none");
  const auto context = new_context();
  context->AddMetadata("traceparent", kTraceparent);
  EXPECT_EQ(client.bakes->GetBake(context.get(), request, &bake).error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_THAT(program.wait_for("GetBake NOT_FOUND"), ::testing::EndsWith(std::string("[trace ") + kTrace + "]"));
}

}  // namespace
}  // namespace radbake::testing
