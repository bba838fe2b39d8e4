#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

class WorkersServiceTest : public ::testing::Test {
 protected:
  static service::BakeServerOptions options_in(const std::filesystem::path& folder, const std::string& program = "") {
    service::BakeServerOptions options = TestServer::options_in(folder, program);
#if defined(__SANITIZE_THREAD__)  // under which a worker takes seconds to start
    options.queue.worker.silence_limit = 10s;
#else
    options.queue.worker.silence_limit = 1s;
#endif
    options.queue.worker.cancel_grace = 200ms;
    options.queue.check_interval = 20ms;
    return options;
  }

  /// How a bake ends that is done by workers of one kind.
  v1::Bake bake_with(const std::string& program) {
    TemporaryFolder folder;
    TestServer server(options_in(folder.path(), program));
    TestClient client = server.client();
    return client.watch(client.submit(kSucceed).name()).finished();
  }

  v1::Bake bake(FakeWork work) { return client_.watch(client_.submit(work).name()).finished(); }

  void expect_failed(const v1::Bake& bake, int code, const std::string& message) {
    EXPECT_EQ(bake.state(), v1::FAILED);
    EXPECT_EQ(bake.error().code(), code);
    EXPECT_THAT(bake.error().message(), HasSubstr(message));
  }

  void expect_server_bakes() { EXPECT_EQ(bake(kSucceed).state(), v1::SUCCEEDED); }

  TemporaryFolder folder_;
  TestServer server_{options_in(folder_.path())};
  TestClient client_ = server_.client();
};

TEST_F(WorkersServiceTest, ReportsABadSceneAsTheWorkerDid) {
  expect_failed(bake(kFailBadScene), grpc::INVALID_ARGUMENT, "mesh 'box': vertex 3 is not finite");
  expect_server_bakes();
}

TEST_F(WorkersServiceTest, SurvivesAWorkerThatCrashesAndNamesTheSignal) {
  expect_failed(bake(kCrash), grpc::INTERNAL, "the worker was killed by SIGSEGV");
  expect_server_bakes();
}

TEST_F(WorkersServiceTest, ReportsTheExitCodeAndTheLastWords) {
  const v1::Bake failed = bake(kExitWithMessage);
  expect_failed(failed, grpc::INTERNAL, "exited with code 7");
  expect_failed(failed, grpc::INTERNAL, kLastWords);
}

TEST_F(WorkersServiceTest, StopsAWorkerThatFallsSilent) {
  expect_failed(bake(kHang), grpc::INTERNAL, "gave no sign of life for 1 s");
  expect_server_bakes();
}

TEST_F(WorkersServiceTest, KillsAWorkerThatIgnoresCancel) {
  const v1::Bake submitted = client_.submit(kIgnoreCancel);
  client_.wait_for(submitted.name(), v1::FORM_FACTORS);
  ASSERT_TRUE(client_.cancel(submitted.name()).ok());
  const auto watched = client_.watch(submitted.name());
  EXPECT_EQ(watched.finished().state(), v1::CANCELLED);
  EXPECT_THAT(watched.events().back().message(), HasSubstr("did not stop within 0.2 s"));
  expect_server_bakes();
}

TEST_F(WorkersServiceTest, RefusesAWorkerOfAnotherAttempt) {
  expect_failed(bake_with(kWrongAttemptName), grpc::INTERNAL, "the worker exited with code 8");
}

TEST_F(WorkersServiceTest, RefusesAWorkerOfAnotherVersion) {
  expect_failed(bake_with(kWrongVersionName), grpc::INTERNAL, "is version 0.0.0");
}

TEST_F(WorkersServiceTest, StopsAWorkerThatNeverConnects) {
  expect_failed(bake_with(kMuteName), grpc::INTERNAL, "gave no sign of life for 1 s");
}

TEST_F(WorkersServiceTest, WaitsWhileTheWorkerCannotBeStarted) {
  TemporaryFolder folder;
  service::BakeServerOptions options = options_in(folder.path());
  options.queue.worker.program = folder.path() / "no-such-worker";
  TestServer server(options);
  TestClient client = server.client();
  const std::string name = client.submit(kSucceed).name();
  const auto limit = std::chrono::steady_clock::now() + kCallLimit;
  while (client.get(name).attempt() < 2 && std::chrono::steady_clock::now() < limit) std::this_thread::sleep_for(5ms);
  std::filesystem::create_symlink(RADBAKE_FAKE_WORKER, options.queue.worker.program);
  const auto watched = client.watch(name);
  EXPECT_EQ(watched.finished().state(), v1::SUCCEEDED);
  const auto events = watched.events();
  const auto names_worker = [](const v1::BakeEvent& event) {
    return event.message().find("no-such-worker") != std::string::npos;
  };
  EXPECT_TRUE(std::any_of(events.begin(), events.end(), names_worker));
}

TEST_F(WorkersServiceTest, RefusesAResultBlobThatDoesNotMatchItsDigest) {
  expect_failed(bake(kSendWrongDigest), grpc::DATA_LOSS, "digest");
  expect_server_bakes();
}

TEST_F(WorkersServiceTest, RefusesAResultThatNamesABlobNeverSent) {
  expect_failed(bake(kNameUnsentBlob), grpc::INTERNAL, "never sent");
}

TEST_F(WorkersServiceTest, TakesFromWorkersMoreThanFromClients) {
  TemporaryFolder folder;
  service::BakeServerOptions options = options_in(folder.path());
  options.limits.max_message_bytes = 64 << 10;
  TestServer server(options);
  TestClient client = server.client();
  // 128 tiles are a chunk of 128 KiB.
  EXPECT_EQ(client.watch(client.submit(kSucceed, 128).name()).finished().state(), v1::SUCCEEDED);
}

TEST_F(WorkersServiceTest, HandsDownOneSocketAndTheInputsAndNothingElse) {
  const v1::Bake failed = bake(kListDescriptors);
  std::string kinds = failed.error().message();
  std::sort(kinds.begin(), kinds.end());
  EXPECT_EQ(kinds, "FFS");  // the manifest, one mesh, the socket
}

TEST_F(WorkersServiceTest, HandsDownInputsThatCanBeReadAndNotWritten) {
  expect_failed(bake(kReadInputs), grpc::INVALID_ARGUMENT, "good good ");
}

/// Workers that were started ahead of need.
class ReadyWorkersTest : public WorkersServiceTest {
 protected:
  static service::BakeServerOptions ready_options_in(const std::filesystem::path& folder,
                                                     const std::string& program = "") {
    service::BakeServerOptions options = options_in(folder, program);
    options.queue.keeps_worker_ready = true;
    return options;
  }

  TemporaryFolder ready_folder_;
};

TEST_F(ReadyWorkersTest, BakeOneJobEach) {
  ::testing::internal::CaptureStderr();
  {
    TestServer server(ready_options_in(ready_folder_.path()));
    TestClient client = server.client();
    for (int i = 0; i < 3; ++i) {
      const v1::Bake bake = client.watch(client.submit(kSucceed).name()).finished();
      EXPECT_EQ(bake.state(), v1::SUCCEEDED) << bake.error().message();
    }
  }
  // The first at least: whether the next is ready in time is up to the machine.
  EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr(kReadyWords));
}

TEST_F(ReadyWorkersTest, GetTheirInputsAndNothingElse) {
  TestServer server(ready_options_in(ready_folder_.path()));
  TestClient client = server.client();
  expect_failed(client.watch(client.submit(kReadInputs).name()).finished(), grpc::INVALID_ARGUMENT, "good good ");
  std::string kinds = client.watch(client.submit(kListDescriptors).name()).finished().error().message();
  std::sort(kinds.begin(), kinds.end());
  EXPECT_EQ(kinds, "FFS");  // the manifest, one mesh, the socket
}

TEST_F(ReadyWorkersTest, EndTheirJobAsAnyWorkerDoes) {
  TestServer server(ready_options_in(ready_folder_.path()));
  TestClient client = server.client();
  expect_failed(client.watch(client.submit(kCrash).name()).finished(), grpc::INTERNAL,
                "the worker was killed by SIGSEGV");
  const v1::Bake running = client.submit(kIgnoreCancel);
  client.wait_for(running.name(), v1::FORM_FACTORS);
  ASSERT_TRUE(client.cancel(running.name()).ok());
  EXPECT_EQ(client.watch(running.name()).finished().state(), v1::CANCELLED);
  EXPECT_EQ(client.watch(client.submit(kSucceed).name()).finished().state(), v1::SUCCEEDED);
}

TEST_F(ReadyWorkersTest, AreDoneWithoutWhereTheyDoNotWait) {
  TestServer server(ready_options_in(ready_folder_.path(), kDeadWhileReadyName));
  TestClient client = server.client();
  for (int i = 0; i < 3; ++i) {
    const v1::Bake bake = client.watch(client.submit(kSucceed).name()).finished();
    EXPECT_EQ(bake.state(), v1::SUCCEEDED) << bake.error().message();
  }
}

TEST_F(WorkersServiceTest, HoldsAWorkerToItsTime) {
  TemporaryFolder folder;
  service::BakeServerOptions options = options_in(folder.path());
  options.queue.bake_limit = 2s;
  TestServer server(options);
  TestClient client = server.client();
  EXPECT_EQ(client.watch(client.submit(kSucceed).name()).finished().state(), v1::SUCCEEDED);
  const v1::Bake endless = client.watch(client.submit(kRunUntilCancelled).name()).finished();
  EXPECT_EQ(endless.state(), v1::FAILED);
  EXPECT_EQ(endless.error().message(), "the worker took longer than its limit of 2 s and was stopped");
  EXPECT_EQ(endless.attempt(), 1u);
}

}  // namespace
}  // namespace radbake::testing
