#include "client/cli/quantities.h"

#include <gtest/gtest.h>

#include <limits>

namespace radbake::cli {
namespace {

TEST(Quantities, GroupDigitsByThree) {
  EXPECT_EQ(grouped(0), "0");
  EXPECT_EQ(grouped(999), "999");
  EXPECT_EQ(grouped(1000), "1,000");
  EXPECT_EQ(grouped(1234567), "1,234,567");
}

TEST(Quantities, ShowDurationsInTheUnitThatFits) {
  EXPECT_EQ(duration(0), "0 s");
  EXPECT_EQ(duration(std::numeric_limits<double>::quiet_NaN()), "0 s");
  EXPECT_EQ(duration(0.0123), "0.012 s");
  EXPECT_EQ(duration(0.34), "0.34 s");
  EXPECT_EQ(duration(0.996), "1.0 s");
  EXPECT_EQ(duration(9.94), "9.9 s");
  EXPECT_EQ(duration(9.96), "10 s");
  EXPECT_EQ(duration(119), "119 s");
  EXPECT_EQ(duration(125.4), "2 min 5 s");
  EXPECT_EQ(duration(3599.4), "59 min 59 s");
  EXPECT_EQ(duration(12000), "3 h 20 min");
  EXPECT_EQ(duration(7199), "2 h 0 min");
}

TEST(Quantities, ShowBytesInStepsOf1024) {
  EXPECT_EQ(bytes(0), "0 B");
  EXPECT_EQ(bytes(999), "999 B");
  EXPECT_EQ(bytes(1000), "1.0 KB");
  EXPECT_EQ(bytes(1536), "1.5 KB");
  EXPECT_EQ(bytes(std::uint64_t{512} << 20), "512 MB");
  EXPECT_EQ(bytes(std::uint64_t{3} << 29), "1.5 GB");
  EXPECT_EQ(bytes(std::numeric_limits<std::uint64_t>::max()), "16 EB");
}

TEST(Quantities, CountThingsInTheirPlural) {
  EXPECT_EQ(counted(1, "mesh"), "1 mesh");
  EXPECT_EQ(counted(2000, "mesh"), "2,000 meshes");
  EXPECT_EQ(counted(3, "patch"), "3 patches");
  EXPECT_EQ(counted(0, "texel"), "0 texels");
}

}  // namespace
}  // namespace radbake::cli
