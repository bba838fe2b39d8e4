#include "common/base/digest.h"

#include <gtest/gtest.h>

namespace radbake {
namespace {

// FIPS 180-4, examples.
TEST(Digest, MatchesThePublishedExamples) {
  EXPECT_EQ(digest_of(std::string("abc")).sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(digest_of(std::string()).sha256, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(digest_of(std::string("abc")).size_bytes, 3u);
}

TEST(Digest, OfPiecesIsTheDigestOfTheWhole) {
  Sha256 hash;
  for (const char* piece : {"a", "", "bc"}) hash.update(std::as_bytes(std::span(std::string_view(piece))));
  EXPECT_EQ(hash.finish(), digest_of(std::string("abc")).sha256);
}

TEST(Digest, RefusesTextThatIsNotOne) {
  EXPECT_TRUE(validate_sha256(std::string(64, 'a')).ok());
  EXPECT_FALSE(validate_sha256(std::string(63, 'a')).ok());
  EXPECT_FALSE(validate_sha256(std::string(64, 'A')).ok());
  EXPECT_FALSE(validate_sha256("../" + std::string(61, 'a')).ok());
}

}  // namespace
}  // namespace radbake
