// How a server comes to its end: who may finish, who is refused, and what is left for the next one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>

#include <future>

#include "google/rpc/error_details.pb.h"
#include "tests/service/admin_page.h"
#include "tests/service/health.h"
#include "tests/service/server_program.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

using ::testing::HasSubstr;

/// No test waits that long: bakes end, or are sent back, for another reason.
constexpr std::chrono::seconds kLongGrace{3600};

service::BakeServerOptions options_with_grace(const TemporaryFolder& folder, std::chrono::milliseconds grace) {
  auto options = TestServer::options_in(folder.path());
  options.drain_grace = grace;
  options.admin_listen = "127.0.0.1:0";
  return options;
}

/// Waits until a bake's worker has said how far it is.
void wait_for_progress(TestClient& client, const std::string& name) {
  while (!client.wait_for(name, v1::FORM_FACTORS).has_progress()) continue;
}

TEST(Drain, LetsABakeFinishThatIsNearlyDoneAndRefusesNewOnesMeanwhile) {
  const TemporaryFolder folder;
  TestServer server(options_with_grace(folder, kLongGrace));
  TestClient client = server.client();
  const std::string name = client.submit(kNearlyDone).name();
  wait_for_progress(client, name);
  const v1::SubmitBakeRequest late = client.request_for(client.upload_scene(), kSucceed);
  v1::PlanBakeRequest late_plan;
  *late_plan.mutable_manifest() = late.manifest();

  auto stopped = std::async(std::launch::async, [&] { server.server().stop(); });
  EXPECT_TRUE(becomes(client, Health::kNotServing));
  EXPECT_THAT(get_page(server.server().admin_address(), "/readyz").text, HasSubstr("draining: "));
  v1::Bake bake;
  v1::Plan plan;
  const grpc::Status refused_plan = client.bakes->PlanBake(new_context().get(), late_plan, &plan);
  const grpc::Status refused = client.bakes->SubmitBake(new_context().get(), late, &bake);
  for (const grpc::Status& status : {refused_plan, refused}) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE) << status.error_message();
    EXPECT_THAT(status.error_message(), HasSubstr("stopping"));
    EXPECT_TRUE(detail_of<google::rpc::RetryInfo>(status));
  }
  // It is finished, and the server ends.
  EXPECT_TRUE(client.finish(name).ok());
  EXPECT_EQ(client.watch(name).finished().state(), v1::SUCCEEDED);
  stopped.get();
}

TEST(Drain, DoesNotWaitForABakeThatCannotTellOrNeedsLonger) {
  for (const FakeWork work : {kRunUntilCancelled, kNearlyDone}) {
    const TemporaryFolder folder;
    // kNearlyDone needs longer than this.
    const auto grace = work == kNearlyDone ? std::chrono::milliseconds(1) : kLongGrace;
    std::string name;
    {
      TestServer server(options_with_grace(folder, grace));
      TestClient client = server.client();
      name = client.submit(work).name();
      wait_for_progress(client, name);
      server.server().stop();
    }
    TestServer next(TestServer::options_in(folder.path()));
    TestClient client = next.client();
    const v1::Bake bake = client.get(name);
    EXPECT_EQ(bake.attempt(), 2u);
    EXPECT_LT(bake.state(), v1::SUCCEEDED);
  }
}

TEST(Drain, LeavesWaitingBakesToTheNextServer) {
  const TemporaryFolder folder;
  std::string running, waiting;
  {
    TestServer server(options_with_grace(folder, kLongGrace));
    TestClient client = server.client();
    running = client.submit(kNearlyDone).name();
    waiting = client.submit(kSucceed).name();
    wait_for_progress(client, running);
    auto stopped = std::async(std::launch::async, [&] { server.server().stop(); });
    EXPECT_TRUE(becomes(client, Health::kNotServing));
    EXPECT_TRUE(client.finish(running).ok());
    stopped.get();
  }
  TestServer next(TestServer::options_in(folder.path()));
  TestClient client = next.client();
  EXPECT_EQ(client.get(running).state(), v1::SUCCEEDED);
  EXPECT_EQ(client.watch(waiting).finished().state(), v1::SUCCEEDED);
  EXPECT_EQ(client.get(waiting).attempt(), 1u);
}

class DrainProgramTest : public ::testing::Test {
 protected:
  std::vector<std::string> arguments(const std::string& grace) const {
    return {"--listen",      "unix:" + (folder_.path() / "socket").string(),
            "--data",        (folder_.path() / "data").string(),
            "--worker",      RADBAKE_FAKE_WORKER,
            "--drain-grace", grace};
  }
  TemporaryFolder folder_;
};

TEST_F(DrainProgramTest, EndsWith0OnSigtermWithABakeThatIsNearlyDone) {
  ServerProgram program(arguments("3600"));
  TestClient client(program.wait_for_address());
  const std::string name = client.submit(kNearlyDone).name();
  wait_for_progress(client, name);
  program.send(SIGTERM);
  EXPECT_TRUE(becomes(client, Health::kNotServing));
  EXPECT_TRUE(client.finish(name).ok());
  EXPECT_EQ(program.wait(), 0);
  ServerProgram next(arguments("0"));
  const v1::Bake bake = TestClient(next.wait_for_address()).get(name);
  EXPECT_EQ(bake.state(), v1::SUCCEEDED);
  EXPECT_EQ(bake.attempt(), 1u);
}

TEST_F(DrainProgramTest, DoesNotWaitAfterASecondSignal) {
  std::string name;
  {
    ServerProgram program(arguments("3600"));
    TestClient client(program.wait_for_address());
    name = client.submit(kNearlyDone).name();
    wait_for_progress(client, name);
    program.send(SIGTERM);
    EXPECT_TRUE(becomes(client, Health::kNotServing));
    EXPECT_EQ(WEXITSTATUS(program.end(SIGTERM)), 130);
  }
  // What was accepted is there all the same.
  ServerProgram next(arguments("0"));
  EXPECT_EQ(TestClient(next.wait_for_address()).get(name).attempt(), 2u);
}

}  // namespace
}  // namespace radbake::testing
