// Who may call: tokens, every method, the token file's changes.

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "common/base/digest.h"
#include "tests/service/test_certificates.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

using ::testing::HasSubstr;

const std::string kNew = "a.newer.token.of.acme.which.is.long.enough";

std::string token_line(const std::string& token, const std::string& rest) {
  return digest_of(token).sha256 + " " + rest + "\n";
}

/// Names of all methods that clients can call, from the messages' own description.
std::vector<std::string> all_methods() {
  std::vector<std::string> methods;
  for (const char* name : {"radbake.v1.Content", "radbake.v1.Bakes", "radbake.v1.Server"}) {
    const auto* service = google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name);
    for (int i = 0; i < service->method_count(); ++i) {
      methods.push_back("/" + std::string(name) + "/" + service->method(i)->name());
    }
  }
  return methods;
}

/// Calls any method with one empty message.
grpc::Status call(const TestClient& client, const std::string& method,
                  const std::vector<std::string>& authorizations = {}) {
  const auto context = new_context();
  for (const std::string& authorization : authorizations) context->AddMetadata("authorization", authorization);
  grpc::CompletionQueue queue;
  const auto stream = grpc::GenericStub(client.channel).PrepareCall(context.get(), method, &queue);
  void* tag = nullptr;
  bool ok = false;
  stream->StartCall(nullptr);
  queue.Next(&tag, &ok);
  const grpc::Slice nothing("");
  stream->WriteLast(grpc::ByteBuffer(&nothing, 1), grpc::WriteOptions(), nullptr);
  queue.Next(&tag, &ok);
  grpc::Status status;
  stream->Finish(&status, nullptr);
  queue.Next(&tag, &ok);
  return status;
}

class AccessTest : public ::testing::Test {
 protected:
  AccessTest() {
    replace_file(tokens_, token_line(kToken, "acme submit"));
    service::BakeServerOptions options = TestServer::options_in(folder_.path());
    options.access.tokens = tokens_;
    server_ = std::make_unique<TestServer>(options);
  }

  grpc::StatusCode code_of(const std::string& token) const {
    v1::Capabilities capabilities;
    return server_->client(token).server->GetCapabilities(new_context().get(), {}, &capabilities).error_code();
  }

  /// Calls until the answer is the one expected, or for as long as a call may take.
  grpc::StatusCode wait_for(grpc::StatusCode expected, const std::string& token) const {
    const auto limit = std::chrono::steady_clock::now() + kCallLimit;
    grpc::StatusCode code = code_of(token);
    while (code != expected && std::chrono::steady_clock::now() < limit) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      code = code_of(token);
    }
    return code;
  }

  const std::string kToken = "a.token.of.acme.which.is.long.enough";
  TemporaryFolder folder_;
  const std::filesystem::path tokens_ = folder_.path() / "tokens";
  std::unique_ptr<TestServer> server_;
};

TEST_F(AccessTest, AsksWhoCallsInEveryMethod) {
  const TestClient stranger = server_->client();
  for (const std::string& method : all_methods()) {
    EXPECT_EQ(call(stranger, method).error_code(), grpc::UNAUTHENTICATED) << method;
    EXPECT_EQ(call(stranger, method, {"Bearer " + kNew}).error_code(), grpc::UNAUTHENTICATED) << method;
    // Who is known gets further: to what is wrong with an empty message.
    EXPECT_NE(call(stranger, method, {"Bearer " + kToken}).error_code(), grpc::UNAUTHENTICATED) << method;
  }
}

TEST_F(AccessTest, TakesNoTokenInAnotherForm) {
  const TestClient client = server_->client();
  const std::string method = "/radbake.v1.Server/GetCapabilities";
  EXPECT_TRUE(call(client, method, {"Bearer " + kToken}).ok());
  EXPECT_THAT(call(client, method).error_message(), HasSubstr("there is none"));
  EXPECT_THAT(call(client, method, {kToken}).error_message(), HasSubstr("Bearer TOKEN"));
  for (const std::string& wrong :
       {"bearer " + kToken, "Basic " + kToken, "Bearer  " + kToken, "Bearer " + kToken + "x",
        "Bearer " + digest_of(kToken).sha256, std::string("Bearer "), std::string("Bearer")}) {
    EXPECT_EQ(call(client, method, {wrong}).error_code(), grpc::UNAUTHENTICATED) << wrong;
  }
  // Of two nobody can tell which one counts.
  EXPECT_EQ(call(client, method, {"Bearer " + kToken, "Bearer " + kToken}).error_code(), grpc::UNAUTHENTICATED);
}

TEST_F(AccessTest, OffersWorkersNothing) {
  const TestClient client = server_->client(kToken);
  EXPECT_EQ(call(client, "/radbake.v1.Workers/Report").error_code(), grpc::UNIMPLEMENTED);
}

TEST_F(AccessTest, TellsItsHealthToAnybody) {
  EXPECT_TRUE(call(server_->client(), "/grpc.health.v1.Health/Check").ok());
}

TEST_F(AccessTest, TakesTokensInAndOutOfForceWhileItRuns) {
  EXPECT_EQ(code_of(kNew), grpc::UNAUTHENTICATED);
  replace_file(tokens_, token_line(kToken, "acme submit") + token_line(kNew, "acme submit"));
  EXPECT_EQ(wait_for(grpc::OK, kNew), grpc::OK);
  EXPECT_EQ(code_of(kToken), grpc::OK);
  replace_file(tokens_, token_line(kNew, "acme submit"));
  EXPECT_EQ(wait_for(grpc::UNAUTHENTICATED, kToken), grpc::UNAUTHENTICATED);
  EXPECT_EQ(code_of(kNew), grpc::OK);
}

TEST_F(AccessTest, ServesOnWhileTheTokenFileChangesAndBreaks) {
  std::atomic<bool> is_over = false;
  std::atomic<int> num_calls = 0, num_failures = 0;
  std::vector<std::thread> callers;
  for (int i = 0; i < 2; ++i) {
    callers.emplace_back([&] {
      const TestClient client = server_->client(kToken);
      v1::Capabilities capabilities;
      while (!is_over) {
        ++num_calls;
        num_failures += !client.server->GetCapabilities(new_context().get(), {}, &capabilities).ok();
      }
    });
  }
  replace_file(tokens_, "broken\n" + token_line(kToken, "acme submit"));
  // The broken file shows once the next whole one is in force.
  replace_file(tokens_, token_line(kNew, "acme submit") + token_line(kToken, "acme submit"));
  EXPECT_EQ(wait_for(grpc::OK, kNew), grpc::OK);
  is_over = true;
  for (std::thread& caller : callers) caller.join();
  EXPECT_GT(num_calls, 0);
  EXPECT_EQ(num_failures, 0);
}

TEST(AccessWithoutTokens, AsksNobody) {
  const TemporaryFolder folder;
  const TestServer server(TestServer::options_in(folder.path()));
  EXPECT_TRUE(call(server.client(), "/radbake.v1.Server/GetCapabilities").ok());
}

TEST(AccessWithoutTokens, RefusesToStartWhereOthersCanConnect) {
  const TemporaryFolder folder;
  service::BakeServerOptions options = TestServer::options_in(folder.path());
  options.listen = "0.0.0.0:0";
  const auto refused = service::BakeServer::start(options);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("--tls-cert"));
  EXPECT_FALSE(std::filesystem::exists(options.data)) << "touched before it was refused";
  options.access.allows_insecure_listen = true;
  EXPECT_TRUE(service::BakeServer::start(options).ok());
}

}  // namespace
}  // namespace radbake::testing
