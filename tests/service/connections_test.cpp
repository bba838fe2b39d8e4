// Limits on connections and on calls that go on at the same time.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <list>
#include <memory>
#include <string_view>
#include <thread>

#include "common/base/digest.h"
#include "google/rpc/error_details.pb.h"
#include "server/store/failpoint.h"
#include "tests/service/test_certificates.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

const std::string kTokens[] = {"first.token.which.is.long.enough.", "second.token.which.is.long.enough",
                               "third.token.which.is.long.enough."};

/// While there is one, bakes wait to be recorded, and the threads that answer calls for them.
class BusyServer {
 public:
  /// More than the server's threads.
  static constexpr int kSubmits = 6;

  explicit BusyServer(TestClient client) : client_(std::move(client)) {
    const v1::Digest scene = client_.upload_scene();
    is_held_ = true;
    store::failpoint_hook = [](const char* name) {
      while (is_held_ && name == std::string_view("database.changed")) std::this_thread::yield();
    };
    for (int i = 0; i < kSubmits; ++i) {
      submits_.emplace_back([this, scene] {
        v1::Bake bake;
        const auto request = client_.request_for(scene, kSucceed);
        EXPECT_TRUE(client_.bakes->SubmitBake(new_context().get(), request, &bake).ok());
      });
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  ~BusyServer() {
    is_held_ = false;
    for (std::thread& submit : submits_) submit.join();
    store::failpoint_hook = nullptr;
  }

 private:
  static inline std::atomic<bool> is_held_ = false;
  TestClient client_;
  std::vector<std::thread> submits_;
};

/// A call that nobody waits for yet.
struct OpenCall {
  explicit OpenCall(const TestClient& client) {
    client.server->async()->GetCapabilities(context.get(), &request, &capabilities, [this](const grpc::Status& is) {
      status = is;
      has_ended = true;
      has_ended.notify_one();
    });
  }
  std::unique_ptr<grpc::ClientContext> context = new_context();
  v1::GetCapabilitiesRequest request;
  v1::Capabilities capabilities;
  grpc::Status status;
  std::atomic<bool> has_ended = false;
};

class ConnectionsTest : public ::testing::Test {
 protected:
  /// A server with three tenants.
  void start(const Limits& limits) {
    service::BakeServerOptions options = TestServer::options_in(folder_.path());
    std::string lines;
    for (int i = 0; i < 3; ++i) lines += digest_of(kTokens[i]).sha256 + " tenant" + std::to_string(i) + " submit\n";
    options.access.tokens = folder_.path() / "tokens";
    replace_file(options.access.tokens, lines);
    options.limits = limits;
    server_ = std::make_unique<TestServer>(options);
  }

  TestClient client(int tenant = 0) const { return server_->client(kTokens[tenant]); }

  /// A call that stays: an upload that never ends.
  struct OpenUpload {
    explicit OpenUpload(const TestClient& client)
        : context(new_context()), stream(client.content->Upload(context.get())) {
      v1::UploadChunk chunk;
      *chunk.mutable_digest() = digest_message("never whole");
      chunk.set_data("nev");
      stream->Write(chunk);
      // It has begun when its first bytes are there.
      v1::QueryUploadRequest query;
      *query.mutable_digest() = chunk.digest();
      v1::QueryUploadResponse answer;
      const auto limit = std::chrono::steady_clock::now() + kCallLimit;
      while (answer.committed_bytes() == 0 && std::chrono::steady_clock::now() < limit) {
        EXPECT_TRUE(client.content->QueryUpload(new_context().get(), query, &answer).ok());
      }
      EXPECT_EQ(answer.committed_bytes(), 3u);
    }
    std::unique_ptr<grpc::ClientContext> context;
    std::unique_ptr<UploadStream> stream;
  };

  /// Tries a short upload until it has the status expected: calls end some time after their clients let go of them.
  static grpc::Status upload_until(grpc::StatusCode expected, TestClient client) {
    const auto limit = std::chrono::steady_clock::now() + kCallLimit;
    grpc::Status status = client.upload("short");
    while (status.error_code() != expected && std::chrono::steady_clock::now() < limit) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      status = client.upload("short");
    }
    return status;
  }

  static void expect_busy(const grpc::Status& status, const std::string& limit) {
    EXPECT_EQ(status.error_code(), grpc::RESOURCE_EXHAUSTED);
    EXPECT_THAT(status.error_message(), ::testing::HasSubstr(limit + " "));
    const auto quota = detail_of<google::rpc::QuotaFailure>(status);
    ASSERT_TRUE(quota.has_value());
    EXPECT_EQ(quota->violations(0).subject(), limit);
    // It frees up by itself: clients come again.
    const auto retry = detail_of<google::rpc::RetryInfo>(status);
    ASSERT_TRUE(retry.has_value());
    EXPECT_GT(retry->retry_delay().seconds(), 0);
  }

  TemporaryFolder folder_;
  std::unique_ptr<TestServer> server_;
};

TEST_F(ConnectionsTest, TurnsStrangersAwayThoughTheServerIsBusy) {
  start({});
  const BusyServer busy(client());
  v1::Capabilities capabilities;
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(5));
  EXPECT_EQ(server_->client().server->GetCapabilities(&context, {}, &capabilities).error_code(), grpc::UNAUTHENTICATED);
}

TEST_F(ConnectionsTest, BoundsTheCallsOfATenantThatWait) {
  constexpr int kConnections = 4, kCalls = 150, kMostWaiting = 512;
  start({});
  auto busy = std::make_unique<BusyServer>(client(0));
  std::list<TestClient> clients;
  std::list<OpenCall> calls;
  for (int i = 0; i < kConnections; ++i) {
    clients.push_back(client(0));
    for (int k = 0; k < kCalls; ++k) calls.emplace_back(clients.back());
  }
  OpenCall other(client(1));
  // Those above the limit are refused although nothing is answered yet.
  constexpr int kAbove = kConnections * kCalls - kMostWaiting;
  const auto has_ended = [](const OpenCall& call) { return call.has_ended.load(); };
  const auto limit = std::chrono::steady_clock::now() + kCallLimit;
  while (std::count_if(calls.begin(), calls.end(), has_ended) < kAbove && std::chrono::steady_clock::now() < limit) {
    std::this_thread::yield();
  }
  busy.reset();
  int num_refused = 0;
  for (OpenCall& call : calls) {
    call.has_ended.wait(false);
    if (call.status.ok()) continue;
    ++num_refused;
    expect_busy(call.status, "max_waiting_calls_per_tenant");
  }
  EXPECT_GT(num_refused, 0);
  EXPECT_LE(num_refused, kAbove + BusyServer::kSubmits);
  other.has_ended.wait(false);
  EXPECT_TRUE(other.status.ok()) << "one tenant's calls are no other's";
}

TEST_F(ConnectionsTest, BoundsTheUploadsOfATenantAndOfAll) {
  Limits limits;
  limits.max_uploads = 2;
  limits.max_uploads_per_tenant = 1;
  start(limits);
  TestClient first = client(0), second = client(1), third = client(2);
  OpenUpload one(first);
  expect_busy(upload_until(grpc::RESOURCE_EXHAUSTED, client(0)), "max_uploads_per_tenant");
  EXPECT_TRUE(second.upload("short").ok()) << "one tenant's uploads are no other's";
  OpenUpload two(second);
  expect_busy(upload_until(grpc::RESOURCE_EXHAUSTED, client(2)), "max_uploads");
  // A place comes back however its call ends.
  one.context->TryCancel();
  EXPECT_TRUE(upload_until(grpc::OK, client(2)).ok());
  two.stream->WritesDone();
  EXPECT_EQ(two.stream->Finish().error_code(), grpc::INVALID_ARGUMENT);
  EXPECT_TRUE(upload_until(grpc::OK, client(1)).ok());
}

TEST_F(ConnectionsTest, BoundsTheWatchesOfATenant) {
  Limits limits;
  limits.max_watches_per_tenant = 1;
  start(limits);
  TestClient watcher = client();
  const v1::Bake bake = watcher.submit(kRunUntilCancelled);
  v1::WatchBakeRequest request;
  request.set_name(bake.name());
  const auto context = new_context();
  const auto stream = watcher.bakes->WatchBake(context.get(), request);
  v1::WatchBakeResponse message;
  ASSERT_TRUE(stream->Read(&message));
  expect_busy(watcher.watch(bake.name()).status, "max_watches_per_tenant");
  ASSERT_TRUE(watcher.cancel(bake.name()).ok());
  while (stream->Read(&message)) continue;
  EXPECT_TRUE(stream->Finish().ok());
  const auto limit = std::chrono::steady_clock::now() + kCallLimit;
  grpc::Status status = watcher.watch(bake.name()).status;
  while (!status.ok() && std::chrono::steady_clock::now() < limit) status = watcher.watch(bake.name()).status;
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(ConnectionsTest, BoundsTheDownloadsOfATenant) {
  Limits limits;
  limits.max_downloads_per_tenant = 1;
  start(limits);
  TestClient reader = client();
  // More than the transport buffers: the download goes on until it is read.
  const std::string blob(64 << 20, 'b');
  ASSERT_TRUE(reader.upload(blob, nullptr, limits.chunk_bytes).ok());
  v1::DownloadRequest request;
  *request.mutable_digest() = digest_message(blob);
  const auto context = new_context();
  const auto stream = reader.content->Download(context.get(), request);
  v1::DownloadChunk chunk;
  ASSERT_TRUE(stream->Read(&chunk));
  const auto second_context = new_context();
  const auto second = reader.content->Download(second_context.get(), request);
  EXPECT_FALSE(second->Read(&chunk));
  expect_busy(second->Finish(), "max_downloads_per_tenant");
  while (stream->Read(&chunk)) continue;
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(ConnectionsTest, ClosesAConnectionAboveTheLimitUntilAnotherEnds) {
  Limits limits;
  limits.max_connections = 2;
  start(limits);
  const auto status_of = [](const TestClient& client) {
    v1::Capabilities capabilities;
    return client.server->GetCapabilities(new_context().get(), {}, &capabilities);
  };
  const TestClient first = client();
  auto second = std::make_unique<TestClient>(client());
  ASSERT_TRUE(status_of(first).ok());
  ASSERT_TRUE(status_of(*second).ok());
  EXPECT_EQ(status_of(client()).error_code(), grpc::UNAVAILABLE);
  EXPECT_TRUE(status_of(first).ok()) << "the others go on";
  second.reset();
  const auto limit = std::chrono::steady_clock::now() + kCallLimit;
  grpc::Status status = status_of(client());
  while (!status.ok() && std::chrono::steady_clock::now() < limit) status = status_of(client());
  EXPECT_TRUE(status.ok()) << status.error_message();
}

TEST_F(ConnectionsTest, TellsItsLimits) {
  Limits limits;
  limits.max_connections = 11;
  limits.max_calls_per_connection = 12;
  limits.max_uploads = 13;
  limits.max_uploads_per_tenant = 14;
  limits.max_downloads = 15;
  limits.max_downloads_per_tenant = 16;
  limits.max_watches = 17;
  limits.max_watches_per_tenant = 18;
  start(limits);
  v1::Capabilities capabilities;
  ASSERT_TRUE(client().server->GetCapabilities(new_context().get(), {}, &capabilities).ok());
  const v1::Limits& told = capabilities.limits();
  EXPECT_EQ(told.max_connections(), 11u);
  EXPECT_EQ(told.max_calls_per_connection(), 12u);
  EXPECT_EQ(told.max_uploads(), 13u);
  EXPECT_EQ(told.max_uploads_per_tenant(), 14u);
  EXPECT_EQ(told.max_downloads(), 15u);
  EXPECT_EQ(told.max_downloads_per_tenant(), 16u);
  EXPECT_EQ(told.max_watches(), 17u);
  EXPECT_EQ(told.max_watches_per_tenant(), 18u);
}

}  // namespace
}  // namespace radbake::testing
