#include "client/image/box_reduction.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

namespace radbake::image {
namespace {

using ::testing::ElementsAre;
using ::testing::FloatEq;

std::vector<float> reduce(int w, int h, int tw, int th, int channels, const std::vector<double>& values) {
  BoxReduction reduction(w, h, tw, th, channels);
  const std::size_t row = std::size_t(w) * std::size_t(channels);
  for (int y = 0; y < h; ++y) reduction.add_row(std::span(values).subspan(std::size_t(y) * row, row));
  return reduction.finish();
}

TEST(BoxReduction, TakesTheMeanOfEachBlock) {
  EXPECT_THAT(reduce(4, 2, 2, 1, 1, {1, 3, 10, 20, 5, 7, 30, 40}), ElementsAre(4, 25));
}

TEST(BoxReduction, KeepsAnImageOfTheRightSize) {
  EXPECT_THAT(reduce(2, 2, 2, 2, 1, {0.25, 0.5, 0.75, 1}), ElementsAre(0.25f, 0.5f, 0.75f, 1.0f));
}

TEST(BoxReduction, SharesAPixelOnABorder) {
  // Three pixels on two: the middle one counts half to each side.
  EXPECT_THAT(reduce(3, 1, 2, 1, 1, {3, 6, 9}), ElementsAre(FloatEq(4), FloatEq(8)));
}

TEST(BoxReduction, KeepsTheMeanAndTheChannelsApart) {
  constexpr int kWidth = 31, kHeight = 17;
  std::vector<double> values;
  for (int i = 0; i < kWidth * kHeight; ++i) {
    values.push_back(i % 7);
    values.push_back(5);
  }
  const std::vector<float> out = reduce(kWidth, kHeight, 10, 4, 2, values);
  double sum = 0, expected = 0;
  for (std::size_t i = 0; i < out.size(); i += 2) {
    sum += out[i];
    EXPECT_FLOAT_EQ(out[i + 1], 5);
  }
  for (std::size_t i = 0; i < values.size(); i += 2) expected += values[i];
  constexpr double kFloat = 1e-6;  // results are float
  EXPECT_NEAR(sum / 40, expected / (kWidth * kHeight), kFloat * 7);
}

}  // namespace
}  // namespace radbake::image
