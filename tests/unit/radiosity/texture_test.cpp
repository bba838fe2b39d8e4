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

}  // namespace
}  // namespace radbake::radiosity
