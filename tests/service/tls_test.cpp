// TLS: whose certificates are accepted, and files that change while the server runs.

#include <gmock/gmock.h>
#include <grpc/grpc_security_constants.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "common/base/digest.h"
#include "server/access/reloaded.h"
#include "tests/service/test_certificates.h"
#include "tests/service/test_server.h"

namespace radbake::testing {
namespace {

const std::string kToken = "a.token.of.acme.which.is.long.enough";

class TlsTest : public ::testing::Test {
 protected:
  enum Callers { kCertificates, kTokens, kBoth };

  void start(Callers callers) {
    service::BakeServerOptions options = TestServer::options_in(folder_.path());
    options.listen = "127.0.0.1:0";
    use("server.pem", "server.key");
    options.access.tls.certificate = folder_.path() / "server.pem";
    options.access.tls.key = folder_.path() / "server.key";
    if (callers != kTokens) {
      replace_file(folder_.path() / "ca.pem", made_.text("ca.pem"));
      options.access.tls.client_ca = folder_.path() / "ca.pem";
    }
    if (callers != kCertificates) {
      replace_file(folder_.path() / "tokens", digest_of(kToken).sha256 + " acme submit\n");
      options.access.tokens = folder_.path() / "tokens";
    }
    server_ = std::make_unique<TestServer>(options);
  }

  /// Puts a certificate and a key in force, one after the other, as people do.
  void use(const std::string& certificate, const std::string& key) {
    replace_file(folder_.path() / "server.pem", made_.text(certificate));
    replace_file(folder_.path() / "server.key", made_.text(key));
  }

  /// name: of a client's certificate, empty for none.
  TestClient client(const std::string& name, const std::string& token = "", const std::string& ca = "ca.pem") const {
    grpc::SslCredentialsOptions tls;
    tls.pem_root_certs = made_.text(ca);
    if (!name.empty()) {
      tls.pem_cert_chain = made_.text(name + ".pem");
      tls.pem_private_key = made_.text(name + ".key");
    }
    return TestClient(server_->server().address(), token, grpc::SslCredentials(tls));
  }

  struct Answer {
    grpc::Status status;
    std::string server_certificate;
  };
  static Answer ask(const TestClient& client) {
    const auto context = new_context();
    v1::Capabilities capabilities;
    Answer answer{client.server->GetCapabilities(context.get(), {}, &capabilities), ""};
    if (!answer.status.ok()) return answer;
    const auto shown = context->auth_context()->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
    if (!shown.empty()) answer.server_certificate = std::string(shown.front().data(), shown.front().size());
    return answer;
  }
  static grpc::StatusCode code_of(const TestClient& client) { return ask(client).status.error_code(); }

  /// Connects anew until what it asks for is so; false where it is not for as long as that.
  template <typename Condition>
  static bool becomes(Condition condition, std::chrono::milliseconds patience = kCallLimit) {
    const auto limit = std::chrono::steady_clock::now() + patience;
    while (!condition()) {
      if (std::chrono::steady_clock::now() > limit) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return true;
  }

  const TestCertificates& made_ = TestCertificates::get();
  TemporaryFolder folder_;
  std::unique_ptr<TestServer> server_;
};

TEST_F(TlsTest, TakesCertificatesOfItsAuthorityOnly) {
  start(kCertificates);
  EXPECT_EQ(code_of(client("alice")), grpc::OK);
  EXPECT_EQ(code_of(client("admin")), grpc::OK);
  EXPECT_EQ(code_of(client("")), grpc::UNAVAILABLE);
  EXPECT_EQ(code_of(client("expired")), grpc::UNAVAILABLE);
  EXPECT_EQ(code_of(client("stranger")), grpc::UNAVAILABLE);
  // Signed, and says nothing of who it is.
  EXPECT_EQ(code_of(client("nameless")), grpc::UNAUTHENTICATED);
  // A token does not help where certificates are asked for.
  EXPECT_EQ(code_of(client("", kToken)), grpc::UNAVAILABLE);
}

TEST_F(TlsTest, IsNotTrustedByClientsOfAnotherAuthorityAndSpeaksNothingElse) {
  start(kCertificates);
  EXPECT_EQ(code_of(client("alice", "", "other-ca.pem")), grpc::UNAVAILABLE);
  EXPECT_EQ(code_of(TestClient(server_->server().address())), grpc::UNAVAILABLE);
}

TEST_F(TlsTest, TakesTokensWithoutCertificates) {
  start(kTokens);
  EXPECT_EQ(code_of(client("", kToken)), grpc::OK);
  EXPECT_EQ(code_of(client("")), grpc::UNAUTHENTICATED);
  EXPECT_EQ(code_of(client("", kToken + "x")), grpc::UNAUTHENTICATED);
  // Nobody has looked at this certificate: it proves nothing.
  EXPECT_EQ(code_of(client("alice")), grpc::UNAUTHENTICATED);
}

TEST_F(TlsTest, TakesEitherWhereBothAreConfigured) {
  start(kBoth);
  EXPECT_EQ(code_of(client("alice")), grpc::OK);
  EXPECT_EQ(code_of(client("", kToken)), grpc::OK);
  EXPECT_EQ(code_of(client("")), grpc::UNAUTHENTICATED);
  EXPECT_EQ(code_of(client("stranger", kToken)), grpc::UNAVAILABLE);
}

TEST_F(TlsTest, ShowsItsNewCertificateToNewConnectionsAndServesTheOldOnes) {
  start(kCertificates);
  std::atomic<bool> is_over = false;
  std::atomic<int> num_failures = 0;
  // One connection that stays, and new ones all the time.
  std::thread old_connection([&, stays = client("alice")] {
    while (!is_over) num_failures += !ask(stays).status.ok();
  });
  std::thread new_connections([&] {
    while (!is_over) num_failures += !ask(client("alice")).status.ok();
  });
  const TestClient first = client("alice");
  EXPECT_EQ(ask(first).server_certificate, made_.text("server.pem"));
  use("second.pem", "second.key");
  EXPECT_TRUE(becomes([&] { return ask(client("alice")).server_certificate == made_.text("second.pem"); }));
  EXPECT_EQ(ask(first).server_certificate, made_.text("server.pem")) << "an open connection keeps what it began with";
  is_over = true;
  old_connection.join();
  new_connections.join();
  EXPECT_EQ(num_failures, 0);
}

TEST_F(TlsTest, KeepsItsCertificateWhileTheFilesDoNotGoTogether) {
  start(kCertificates);
  // Half of a rotation, and then a file that is no certificate, for longer than it takes to look.
  replace_file(folder_.path() / "server.key", made_.text("second.key"));
  EXPECT_FALSE(becomes([&] { return !ask(client("alice")).status.ok(); }, 2 * access::kReloadInterval));
  replace_file(folder_.path() / "server.pem", "nonsense");
  EXPECT_FALSE(becomes([&] { return !ask(client("alice")).status.ok(); }, 2 * access::kReloadInterval));
  EXPECT_EQ(ask(client("alice")).server_certificate, made_.text("server.pem"));
  use("second.pem", "second.key");
  EXPECT_TRUE(becomes([&] { return ask(client("alice")).server_certificate == made_.text("second.pem"); }));
}

TEST_F(TlsTest, TakesItsClientsAuthorityAnew) {
  start(kCertificates);
  replace_file(folder_.path() / "ca.pem", made_.text("other-ca.pem"));
  EXPECT_TRUE(becomes([&] { return ask(client("stranger")).status.ok(); }));
  EXPECT_EQ(code_of(client("alice")), grpc::UNAVAILABLE);
}

TEST_F(TlsTest, RefusesToStartWithFilesThatDoNotGoTogether) {
  service::BakeServerOptions options = TestServer::options_in(folder_.path());
  options.access.tls = {made_.path("server.pem"), made_.path("second.key"), ""};
  const auto refused = service::BakeServer::start(options);
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("is not the key of"));
}

}  // namespace
}  // namespace radbake::testing
