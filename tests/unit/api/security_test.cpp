#include "client/api/security.h"

#include <gtest/gtest.h>

namespace radbake::api {
namespace {

bool sends_token_to(const std::string& address) {
  ClientSecurity security;
  security.token = "a-token";
  return make_credentials(address, security).ok();
}

TEST(Token, GoesWithoutTlsToThisMachineOnly) {
  for (const char* local : {"unix:/run/radbaked", "localhost", "localhost:7419", "127.0.0.1:7419", "127.8.9.10",
                            "[::1]", "[::1]:7419", "::1"}) {
    EXPECT_TRUE(sends_token_to(local)) << local;
  }
  for (const char* elsewhere :
       {"bakery:7419", "localhost.example:7419", "127.example:7419", "127.0.0.1.example:7419", "::1234:5", "[::1234]:5",
        "10.0.0.1:7419", "128.0.0.1", "[::]:7419", "[::1", "[::1].example:7419", "[", ""}) {
    EXPECT_FALSE(sends_token_to(elsewhere)) << elsewhere;
  }
}

}  // namespace
}  // namespace radbake::api
