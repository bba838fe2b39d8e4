#include "server/radiosity/survey/texture.h"

#include <gtest/gtest.h>

namespace radbake::radiosity {
namespace {

/// Two texels side by side: red 1 and red 3.
TexturePlane pair(Wrap wrap) { return {"pair", 2, 1, 3, wrap, wrap, {1, 0, 0, 3, 0, 0}}; }

TEST(SampledTexture, IsExactAtTexelCentresAndLinearBetween) {
  const TexturePlane texture = pair(Wrap::kClamp);
  EXPECT_DOUBLE_EQ(sampled_texture(texture, {0.25, 0.5}).x, 1);
  EXPECT_DOUBLE_EQ(sampled_texture(texture, {0.75, 0.5}).x, 3);
  EXPECT_DOUBLE_EQ(sampled_texture(texture, {0.5, 0.5}).x, 2);
}

TEST(SampledTexture, GoesOnBeyondItsBorderAsItsWrapSays) {
  EXPECT_DOUBLE_EQ(sampled_texture(pair(Wrap::kClamp), {1.25, 0.5}).x, 3);
  EXPECT_DOUBLE_EQ(sampled_texture(pair(Wrap::kRepeat), {1.25, 0.5}).x, 1);
  EXPECT_DOUBLE_EQ(sampled_texture(pair(Wrap::kRepeat), {-0.25, 0.5}).x, 3);
  EXPECT_DOUBLE_EQ(sampled_texture(pair(Wrap::kMirror), {1.25, 0.5}).x, 3);
  EXPECT_DOUBLE_EQ(sampled_texture(pair(Wrap::kMirror), {1.75, 0.5}).x, 1);
  EXPECT_DOUBLE_EQ(sampled_texture(pair(Wrap::kRepeat), {1e9 + 0.25, 0.5}).x, 1);
}

// There the period is lost in rounding; what is read must still be a texel.
TEST(SampledTexture, StaysInsideForCoordinatesOfAnySize) {
  for (const Wrap wrap : {Wrap::kClamp, Wrap::kRepeat, Wrap::kMirror}) {
    for (const double coordinate : {1e17, -1e17, 3e38, -3e38, 1e80, -1e80}) {
      const double red = sampled_texture(pair(wrap), {coordinate, -coordinate}).x;
      EXPECT_GE(red, 1) << coordinate;
      EXPECT_LE(red, 3) << coordinate;
    }
  }
}

}  // namespace
}  // namespace radbake::radiosity
