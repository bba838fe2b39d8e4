#include "server/radiosity/lightmap/fill.h"

#include <gtest/gtest.h>

namespace radbake::radiosity {
namespace {

// .  .  .  .  .  .      one valid texel V with value 3, one buried texel B beside it, in a field outside all charts
// .  .  .  .  .  .
// .  .  V  B  .  .
// .  .  .  .  .  .
TEST(Fill, GivesBuriedTexelsAndThePaddingTheirNeighboursMean) {
  constexpr int kSize = 6;
  std::vector<TexelState> states(kSize * kSize, TexelState::kOutside);
  std::vector<float> rgba(4 * kSize * kSize, 0.0f);
  const auto at = [](int x, int y) { return y * kSize + x; };
  states[at(2, 2)] = TexelState::kValid;
  states[at(3, 2)] = TexelState::kBuried;
  for (int c = 0; c < 3; ++c) rgba[4 * at(2, 2) + c] = 3;
  rgba[4 * at(2, 2) + 3] = rgba[4 * at(3, 2) + 3] = 1;

  const FillCounts counts = fill_from_neighbours(states, kSize, 1, rgba);
  EXPECT_EQ(counts.num_filled, 1u);
  EXPECT_EQ(counts.num_dilated, 7u);  // the other neighbours of V
  EXPECT_EQ(rgba[4 * at(3, 2)], 3);
  EXPECT_EQ(rgba[4 * at(1, 1)], 3);
  EXPECT_EQ(rgba[4 * at(0, 0)], 0);      // two texels away
  EXPECT_EQ(rgba[4 * at(1, 1) + 3], 0);  // coverage stays
}

TEST(Fill, ReachesBuriedTexelsFarFromAnyValidOne) {
  constexpr int kSize = 9;
  std::vector<TexelState> states(kSize * kSize, TexelState::kBuried);
  std::vector<float> rgba(4 * kSize * kSize, 0.0f);
  states[0] = TexelState::kValid;
  rgba[0] = 5;
  EXPECT_EQ(fill_from_neighbours(states, kSize, 2, rgba).num_filled, kSize * kSize - 1u);
  EXPECT_EQ(rgba[4 * (kSize * kSize - 1)], 5);
}

TEST(Fill, EndsWhereNothingIsValid) {
  const std::vector<TexelState> states(16, TexelState::kBuried);
  std::vector<float> rgba(64, 0.0f);
  EXPECT_EQ(fill_from_neighbours(states, 4, 2, rgba).num_filled, 0u);
}

}  // namespace
}  // namespace radbake::radiosity
