#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/access/client_certificate.h"
#include "server/access/tls_files.h"
#include "tests/service/test_certificates.h"

namespace radbake::access {
namespace {

using radbake::testing::TestCertificates;
using ::testing::AllOf;
using ::testing::HasSubstr;

TlsFiles files(const std::string& certificate, const std::string& key, const std::string& client_ca = "") {
  const TestCertificates& made = TestCertificates::get();
  return {made.path(certificate), made.path(key), client_ca.empty() ? "" : made.path(client_ca)};
}

std::string problem_of(const TlsFiles& tls) {
  const auto material = read_tls_files(tls);
  return material.ok() ? "" : material.error().message;
}

TEST(TlsFiles, AreReadAsTheyAre) {
  const auto material = read_tls_files(files("server.pem", "server.key", "ca.pem"));
  ASSERT_TRUE(material.ok()) << material.error().message;
  EXPECT_EQ(material->certificate, TestCertificates::get().text("server.pem"));
  EXPECT_EQ(material->key, TestCertificates::get().text("server.key"));
  EXPECT_EQ(material->client_ca, TestCertificates::get().text("ca.pem"));
}

TEST(TlsFiles, NameTheOptionAndTheFileThatIsWrong) {
  EXPECT_THAT(problem_of(files("no.pem", "server.key")), AllOf(HasSubstr("--tls-cert"), HasSubstr("no.pem")));
  EXPECT_THAT(problem_of(files("server.pem", "no.key")), AllOf(HasSubstr("--tls-key"), HasSubstr("no.key")));
  EXPECT_THAT(problem_of(files("server.pem", "server.key", "no.pem")), HasSubstr("--tls-client-ca"));
  EXPECT_THAT(problem_of(files("server.key", "server.key")), HasSubstr("holds no PEM certificate"));
  EXPECT_THAT(problem_of(files("server.pem", "server.pem")), HasSubstr("no PEM private key"));
  EXPECT_THAT(problem_of(files("server.pem", "server.key", "server.key")), HasSubstr("--tls-client-ca"));
  EXPECT_THAT(problem_of(files("server.pem", "second.key")), HasSubstr("is not the key of"));
  EXPECT_THAT(problem_of(files("server.pem", "locked.key")), HasSubstr("asks for a password"));
}

TEST(TlsFiles, NameTheDayOnWhichTheCertificateExpired) {
  EXPECT_THAT(problem_of(files("late.pem", "late.key")), HasSubstr("has expired at 2021-01-01T00:00:00Z"));
}

TEST(TlsFiles, RefuseACertificateThatIsCutOff) {
  const radbake::testing::TemporaryFolder folder;
  TlsFiles tls = files("server.pem", "server.key");
  const std::string whole = TestCertificates::get().text("server.pem");
  tls.certificate = folder.path() / "cut.pem";
  radbake::testing::replace_file(tls.certificate, whole + whole.substr(0, whole.size() / 2));
  EXPECT_THAT(problem_of(tls), AllOf(HasSubstr("cut.pem"), HasSubstr("certificate 2")));
}

TEST(ClientCertificate, NamesTenantAndRole) {
  const auto caller_of = [](const char* file) {
    const auto caller = caller_of_certificate(TestCertificates::get().text(file));
    EXPECT_TRUE(caller.ok()) << caller.error().message;
    return caller.ok() ? *caller : Caller();
  };
  EXPECT_EQ(caller_of("alice.pem"), (Caller{"alice", Role::kSubmit}));
  EXPECT_EQ(caller_of("admin.pem"), (Caller{"operator", Role::kAdmin}));
  // Without a CN the first DNS name counts; an e-mail address does not.
  EXPECT_EQ(caller_of("plain.pem"), (Caller{"bob.example", Role::kSubmit}));
}

TEST(ClientCertificate, IsRefusedWithoutAName) {
  const auto caller = caller_of_certificate(TestCertificates::get().text("nameless.pem"));
  ASSERT_FALSE(caller.ok());
  EXPECT_THAT(caller.error().message, HasSubstr("names no tenant"));
  EXPECT_FALSE(caller_of_certificate(TestCertificates::get().text("spaced.pem")).ok());
  EXPECT_FALSE(caller_of_certificate("nonsense").ok());
}

}  // namespace
}  // namespace radbake::access
