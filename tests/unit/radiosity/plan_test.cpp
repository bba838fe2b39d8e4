#include "server/radiosity/plan/plan.h"

#include <gtest/gtest.h>

namespace radbake::radiosity {
namespace {

TEST(BakeOptions, AreAllRightWhenNothingIsAsked) { EXPECT_TRUE(check_options({}).ok()); }

TEST(BakeOptions, AreRefusedByNameAndValue) {
  const auto message = [](const BakeOptions& options) {
    const auto checked = check_options(options);
    return checked.ok() ? std::string() : checked.error().message;
  };
  EXPECT_EQ(message({.atlas_size = 63}), "atlas size 63 is not within 64..4096");
  EXPECT_EQ(message({.atlas_size = 8192}), "atlas size 8192 is not within 64..4096");
  EXPECT_EQ(message({.rays = 7}), "rays 7 is not within 8..65536");
  EXPECT_EQ(message({.max_patches = 63}), "max patches 63 is not within 64..16777216");
  EXPECT_EQ(message({.threads = -1}), "threads -1 is not within 1..4096");
}

// Area 1: four texels of 0.001 would make 62,500 patches; at least 1024, at most what is asked.
TEST(PatchEdge, IsFourTexelsWithinTheBoundsOnTheNumberOfPatches) {
  EXPECT_DOUBLE_EQ(patch_edge(0.001, 1, 100000), 0.004);
  EXPECT_DOUBLE_EQ(patch_edge(0.001, 1, 10000), 0.01);
  EXPECT_DOUBLE_EQ(patch_edge(0.1, 1, 100000), 1.0 / 32);
  EXPECT_DOUBLE_EQ(patch_edge(0.1, 1, 100), 0.1);
}

}  // namespace
}  // namespace radbake::radiosity
