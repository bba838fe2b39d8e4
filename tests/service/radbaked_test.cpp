// The real server program: start, stop, signals, and what survives kill -9.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <thread>

#include "common/base/version.h"
#include "tests/service/program.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

using ::testing::HasSubstr;

class RadbakedTest : public ::testing::Test {
 protected:
  std::vector<std::string> arguments() const {
    return {"--listen", "unix:" + (folder_.path() / "socket").string(),
            "--data",   (folder_.path() / "data").string(),
            "--worker", RADBAKE_FAKE_WORKER};
  }

  TemporaryFolder folder_;
};

TEST_F(RadbakedTest, SaysWhereItListensAndStopsOnSigterm) {
  Program program(
      {"--listen", "127.0.0.1:0", "--data", (folder_.path() / "data").string(), "--worker", RADBAKE_FAKE_WORKER});
  const std::string address = program.wait_for_address();
  EXPECT_THAT(address, ::testing::MatchesRegex("127.0.0.1:[0-9]+"));
  EXPECT_THAT(address, ::testing::Not(::testing::EndsWith(":0")));
  v1::Capabilities capabilities;
  EXPECT_TRUE(TestClient(address).server->GetCapabilities(new_context().get(), {}, &capabilities).ok());
  EXPECT_EQ(program.end(SIGTERM), 0);
}

TEST_F(RadbakedTest, RefusesADataFolderInUse) {
  Program first(arguments());
  ASSERT_NE(first.wait_for_address(), "");
  Program second(arguments());
  EXPECT_EQ(second.wait_for_address(), "");
  EXPECT_EQ(WEXITSTATUS(second.wait()), 4);
  EXPECT_THAT(second.output(), HasSubstr("in use by another radbaked"));
}

TEST_F(RadbakedTest, RefusesAnAddressInUse) {
  Program first(
      {"--listen", "127.0.0.1:0", "--data", (folder_.path() / "a").string(), "--worker", RADBAKE_FAKE_WORKER});
  const std::string address = first.wait_for_address();
  Program second({"--listen", address, "--data", (folder_.path() / "b").string(), "--worker", RADBAKE_FAKE_WORKER});
  EXPECT_EQ(second.wait_for_address(), "");
  EXPECT_EQ(WEXITSTATUS(second.wait()), 4);
  EXPECT_THAT(second.output(), HasSubstr(address));
}

TEST_F(RadbakedTest, ExitsWith2OnAnOptionThatDoesNotExist) {
  Program program({"--no-such-option"});
  EXPECT_EQ(WEXITSTATUS(program.wait()), 2);
  Program level({"--log-level", "loud"});
  EXPECT_EQ(WEXITSTATUS(level.wait()), 2);
}

TEST_F(RadbakedTest, ReadsItsOptionsFromAFile) {
  std::ofstream(folder_.path() / "radbaked.ini") << "max-running=3\nlog-json=true\n";
  std::vector<std::string> all = arguments();
  all.insert(all.end(), {"--config", (folder_.path() / "radbaked.ini").string()});
  Program program(all);
  const std::string address = program.wait_for_address();
  v1::Capabilities capabilities;
  ASSERT_TRUE(TestClient(address).server->GetCapabilities(new_context().get(), {}, &capabilities).ok());
  EXPECT_EQ(capabilities.limits().max_running_bakes(), 3u);
  EXPECT_EQ(program.end(SIGTERM), 0);
  EXPECT_THAT(program.output(), HasSubstr("\"level\":\"info\",\"program\":\"radbaked\""));
}

TEST_F(RadbakedTest, RunsAJobAgainAfterKill9AndPublishesItOnce) {
  std::string name;
  {
    Program program(arguments());
    TestClient client(program.wait_for_address());
    name = client.submit(kSucceedSecondTime).name();
    EXPECT_EQ(client.wait_for(name, v1::FORM_FACTORS).state(), v1::FORM_FACTORS);
    EXPECT_EQ(WTERMSIG(program.end(SIGKILL)), SIGKILL);
  }
  Program program(arguments());
  TestClient client(program.wait_for_address());
  const auto watched = client.watch(name);
  EXPECT_EQ(watched.finished().state(), v1::SUCCEEDED);
  EXPECT_EQ(watched.finished().attempt(), 2u);
  // No gap, no repetition, one end.
  int num_ends = 0;
  const auto events = watched.events();
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_EQ(events[i].sequence(), i + 1);
    num_ends += events[i].state() >= v1::SUCCEEDED;
  }
  EXPECT_EQ(num_ends, 1);
  EXPECT_EQ(program.end(SIGTERM), 0);
}

TEST_F(RadbakedTest, GivesUpAJobThatTookTheServerDownThreeTimes) {
  std::string name;
  for (int i = 0; i < 3; ++i) {
    Program program(arguments());
    TestClient client(program.wait_for_address());
    if (name.empty()) name = client.submit(kRunUntilCancelled).name();
    EXPECT_EQ(client.wait_for(name, v1::FORM_FACTORS).state(), v1::FORM_FACTORS);
    program.end(SIGKILL);
  }
  Program program(arguments());
  const v1::Bake bake = TestClient(program.wait_for_address()).get(name);
  EXPECT_EQ(bake.state(), v1::FAILED);
  EXPECT_THAT(bake.error().message(), HasSubstr("3 times"));
}

TEST_F(RadbakedTest, QueuesRunningJobsAgainWhenItIsStopped) {
  std::string running, waiting;
  {
    Program program(arguments());
    TestClient client(program.wait_for_address());
    running = client.submit(kSucceedSecondTime).name();
    waiting = client.submit(kSucceed).name();
    client.wait_for(running, v1::FORM_FACTORS);
    EXPECT_EQ(program.end(SIGTERM), 0);
  }
  Program program(arguments());
  TestClient client(program.wait_for_address());
  EXPECT_EQ(client.watch(running).finished().state(), v1::SUCCEEDED);
  EXPECT_EQ(client.watch(waiting).finished().state(), v1::SUCCEEDED);
  EXPECT_EQ(client.get(running).attempt(), 2u);
  EXPECT_EQ(client.get(waiting).attempt(), 1u);
}

TEST_F(RadbakedTest, KeepsResultsAcrossAStart) {
  std::string name;
  {
    Program program(arguments());
    TestClient client(program.wait_for_address());
    name = client.submit(kSucceed).name();
    EXPECT_EQ(client.watch(name).finished().state(), v1::SUCCEEDED);
    program.end(SIGKILL);
  }
  Program program(arguments());
  TestClient client(program.wait_for_address());
  const v1::Bake bake = client.get(name);
  EXPECT_EQ(bake.state(), v1::SUCCEEDED);
  ASSERT_EQ(bake.result().layers_size(), 1);
  v1::FindMissingRequest request;
  *request.add_digests() = bake.result().layers(0).blob();
  v1::FindMissingResponse response;
  ASSERT_TRUE(client.content->FindMissing(new_context().get(), request, &response).ok());
  EXPECT_EQ(response.missing_size(), 0);
}

TEST_F(RadbakedTest, EndsWithTheProcessThatStartedIt) {
  // A shell starts the server and ends; the pipe closes when the server has gone.
  std::string command = std::string(RADBAKE_RADBAKED) + " --exit-with-parent";
  for (const std::string& argument : arguments()) command += " " + argument;
  command = "(" + command + " & read line; exit 0) 2>&1 <" + (folder_.path() / "gate").string();
  ASSERT_EQ(mkfifo((folder_.path() / "gate").c_str(), 0600), 0);
  FILE* output = popen(("sh -c '" + command + "'").c_str(), "r");
  // The shell waits at the gate for a line.
  std::ofstream gate(folder_.path() / "gate");
  char line[4096];
  ASSERT_NE(fgets(line, sizeof(line), output), nullptr);
  EXPECT_THAT(std::string(line), HasSubstr("listening on"));
  gate << "go\n";
  gate.close();
  while (fgets(line, sizeof(line), output)) {
  }
  pclose(output);
}

TEST_F(RadbakedTest, ReportsItsHealthAndLeavesTheSecondSignalToKill) {
  Program program(arguments());
  TestClient client(program.wait_for_address());
  const std::string name = client.submit(kRunUntilCancelled).name();
  EXPECT_EQ(client.wait_for(name, v1::FORM_FACTORS).state(), v1::FORM_FACTORS);
  EXPECT_EQ(program.end(SIGINT), 0);
  EXPECT_THAT(program.output(), HasSubstr("SIGINT"));
}

}  // namespace
}  // namespace radbake::testing
