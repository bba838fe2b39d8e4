#include "server/access/token_set.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/base/digest.h"

namespace radbake::access {
namespace {

using ::testing::HasSubstr;

const std::string kToken = "0123456789abcdefghijklmnopqrstuvwxyzABCD=";
const std::string kOther = "another token of forty characters ......";

std::string line_for(const std::string& token, const std::string& rest) {
  return digest_of(token).sha256 + " " + rest + "\n";
}

std::string problem_of(const std::string& text) {
  const auto set = TokenSet::parse(text, "tokens.txt");
  EXPECT_FALSE(set.ok());
  return set.ok() ? "" : set.error().message;
}

TEST(TokenSet, FindsWhoseTokenItIs) {
  const auto set = TokenSet::parse(
      "# tokens\n\n" + line_for(kOther, "acme submit") + "  " + line_for(kToken, "ops/night   admin # until May"),
      "tokens.txt");
  ASSERT_TRUE(set.ok()) << set.error().message;
  EXPECT_EQ(set->size(), 2u);
  EXPECT_EQ(set->find(kOther), (Caller{"acme", Role::kSubmit}));
  EXPECT_EQ(set->find(kToken), (Caller{"ops/night", Role::kAdmin}));
}

TEST(TokenSet, FindsNothingForWhatIsNearlyAToken) {
  const auto set = TokenSet::parse(line_for(kToken, "acme submit"), "tokens.txt");
  ASSERT_TRUE(set.ok());
  std::string nearly = kToken;
  nearly.back() ^= 1;
  for (const std::string& wrong : {std::string(), nearly, kToken + " ", kToken.substr(1), digest_of(kToken).sha256}) {
    EXPECT_EQ(set->find(wrong), std::nullopt) << wrong;
  }
}

TEST(TokenSet, FindsNothingInAnEmptyFile) {
  const auto set = TokenSet::parse("# nobody yet\n", "tokens.txt");
  ASSERT_TRUE(set.ok());
  EXPECT_EQ(set->find(kToken), std::nullopt);
}

TEST(TokenSet, NamesFileAndLineOfWhatIsWrong) {
  const std::string good = line_for(kOther, "acme submit");
  EXPECT_THAT(problem_of(good + line_for(kToken, "acme")), HasSubstr("tokens.txt:2: expected SHA256_HEX TENANT ROLE"));
  EXPECT_THAT(problem_of(good + "\n" + line_for(kToken, "acme submit more")), HasSubstr("tokens.txt:3"));
  EXPECT_THAT(problem_of(line_for(kToken, "acme root")), HasSubstr("tokens.txt:1: role 'root'"));
  EXPECT_THAT(problem_of(line_for(kToken, "ac,me submit")), HasSubstr("tenant 'ac,me'"));
  EXPECT_THAT(problem_of(line_for(kToken, std::string(129, 'a') + " submit")), HasSubstr("129 bytes"));
  EXPECT_THAT(problem_of(good + good), HasSubstr("tokens.txt:2: the token " + digest_of(kOther).sha256));
}

TEST(TokenSet, DoesNotRepeatATokenThatSomebodyForgotToHash) {
  const std::string problem = problem_of(kToken + " acme submit\n");
  EXPECT_THAT(problem, HasSubstr("tokens.txt:1: the first word is not a SHA-256"));
  EXPECT_THAT(problem, ::testing::Not(HasSubstr(kToken)));
}

TEST(TokenSet, SaysWhichFileIsNotThere) {
  const auto set = TokenSet::read("/nonexistent/tokens");
  ASSERT_FALSE(set.ok());
  EXPECT_THAT(set.error().message, ::testing::AllOf(HasSubstr("--tokens"), HasSubstr("/nonexistent/tokens")));
}

TEST(HashToken, GivesWhatTheFileHolds) {
  const auto hash = hash_token(kToken);
  ASSERT_TRUE(hash.ok());
  const auto set = TokenSet::parse(*hash + " acme submit\n", "tokens.txt");
  ASSERT_TRUE(set.ok());
  EXPECT_EQ(set->find(kToken), (Caller{"acme", Role::kSubmit}));
}

TEST(HashToken, RefusesWhatCanBeGuessedOrNotBeSent) {
  EXPECT_TRUE(hash_token(std::string(32, 'x')).ok());
  EXPECT_FALSE(hash_token(std::string(31, 'x')).ok());
  EXPECT_FALSE(hash_token("").ok());
  EXPECT_FALSE(hash_token(std::string(40, 'x') + " ").ok());
  EXPECT_FALSE(hash_token(std::string(40, 'x') + "\xc3\xa9").ok());
  EXPECT_FALSE(hash_token(std::string(5000, 'x')).ok());
}

}  // namespace
}  // namespace radbake::access
