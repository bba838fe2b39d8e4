#include "server/access/access_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/access/listen_address.h"

namespace radbake::access {
namespace {

using ::testing::HasSubstr;

std::string problem_of(const AccessOptions& options, bool is_local) {
  const auto checked = check_access(options, "0.0.0.0:7419", is_local);
  return checked.ok() ? "" : checked.error().message;
}

const TlsFiles kPair{"server.pem", "server.key", ""};

TEST(AccessOptions, AskNothingOfAnAddressOfThisMachine) {
  EXPECT_EQ(problem_of({}, true), "");
  EXPECT_EQ(problem_of({kPair, "", false}, true), "");
  EXPECT_EQ(problem_of({{}, "tokens", false}, true), "");
}

TEST(AccessOptions, AskForTlsAndForCallersElsewhere) {
  EXPECT_THAT(problem_of({}, false), ::testing::AllOf(HasSubstr("--listen 0.0.0.0:7419"), HasSubstr("--tls-cert")));
  // A token would travel readable for all.
  EXPECT_THAT(problem_of({{}, "tokens", false}, false), HasSubstr("--tls-cert"));
  EXPECT_THAT(problem_of({kPair, "", false}, false), HasSubstr("--tls-client-ca or --tokens"));
  EXPECT_EQ(problem_of({kPair, "tokens", false}, false), "");
  EXPECT_EQ(problem_of({{"server.pem", "server.key", "ca.pem"}, "", false}, false), "");
  EXPECT_EQ(problem_of({{}, "", true}, false), "");
}

TEST(AccessOptions, GoTogether) {
  EXPECT_THAT(problem_of({{"server.pem", "", ""}, "", true}, true), HasSubstr("--tls-cert server.pem needs --tls-key"));
  EXPECT_THAT(problem_of({{"", "server.key", ""}, "", true}, true), HasSubstr("--tls-key server.key needs --tls-cert"));
  EXPECT_THAT(problem_of({{"", "", "ca.pem"}, "", true}, true), HasSubstr("--tls-client-ca ca.pem needs"));
}

TEST(ListenAddress, KnowsWhoCanReachIt) {
  for (const char* local : {"127.0.0.1:0", "127.1.2.3:7419", "[::1]:0", "unix:/run/radbake.sock"}) {
    const auto address = resolve_listen_address(local);
    ASSERT_TRUE(address.ok()) << address.error().message;
    EXPECT_TRUE(address->is_local) << local;
  }
  for (const char* open : {"0.0.0.0:0", "[::]:0", "192.0.2.1:7419", "[::ffff:127.0.0.1]:0"}) {
    const auto address = resolve_listen_address(open);
    ASSERT_TRUE(address.ok()) << address.error().message;
    EXPECT_FALSE(address->is_local) << open;
  }
}

TEST(ListenAddress, KnowsWithoutAskingWhoCanReachANumber) {
  for (const char* local : {"unix:/run/x", "127.0.0.1:1", "127.255.0.3:1", "[::1]:1", "localhost:1"}) {
    EXPECT_EQ(is_local(*read_address(local)), true) << local;
  }
  for (const char* open : {"0.0.0.0:1", "[::]:1", "192.0.2.1:1", "128.0.0.1:1", "[::ffff:192.0.2.1]:1"}) {
    EXPECT_EQ(is_local(*read_address(open)), false) << open;
  }
  EXPECT_EQ(is_local(*read_address("localhost.example.org:1")), std::nullopt);
}

TEST(ListenAddress, RefusesWhatIsNoAddress) {
  for (const char* wrong : {"", "7419", "localhost", ":7419", "127.0.0.1:", "127.0.0.1:70000", "127.0.0.1:7419x",
                            "::1:7", "[]:7", "a b:7", "unix:", "127.0.0.1:-1"}) {
    const auto address = resolve_listen_address(wrong);
    ASSERT_FALSE(address.ok()) << wrong;
    EXPECT_THAT(address.error().message, HasSubstr("--listen")) << wrong;
  }
  EXPECT_FALSE(resolve_listen_address("unix:/" + std::string(200, 'a')).ok());
}

}  // namespace
}  // namespace radbake::access
