#include "common/base/shortened.h"

#include <gtest/gtest.h>

namespace radbake {
namespace {

TEST(Shortened, LeavesWhatIsShort) {
  EXPECT_EQ(shortened("", 10), "");
  EXPECT_EQ(shortened("ten bytes!", 10), "ten bytes!");
}

TEST(Shortened, CutsWhatIsLong) { EXPECT_EQ(shortened("eleven byte", 10), "eleven ..."); }

TEST(Shortened, CutsNoCharacterInTwo) {
  // Each of these has three bytes.
  EXPECT_EQ(shortened("€€€€", 11), "€€...");
  EXPECT_EQ(shortened("€€€€", 10), "€€...");
  EXPECT_EQ(shortened("€€€€", 9), "€€...");
  EXPECT_EQ(shortened("€€€€", 8), "€...");
}

TEST(Shortened, IsSafeOnBytesThatAreNoText) { EXPECT_EQ(shortened(std::string(20, '\x80'), 10), "..."); }

}  // namespace
}  // namespace radbake
