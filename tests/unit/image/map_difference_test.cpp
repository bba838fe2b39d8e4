#include "client/image/map_difference.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "client/image/difference_picture.h"

namespace radbake::image {
namespace {

using testing::HasSubstr;

/// Sums of a few products of float32 in double.
constexpr double kRounding = 1e-12;

/// An image of one colour, covered everywhere.
Pixels plain(int width, int height, float value, int channels = 4) {
  Pixels pixels{width, height, channels, {}};
  for (int t = 0; t < width * height; ++t) {
    for (int c = 0; c < channels; ++c) pixels.values.push_back(c == 3 ? 1 : value);
  }
  return pixels;
}

void set(Pixels& pixels, int x, int y, std::array<float, 3> rgb) {
  for (int c = 0; c < 3; ++c) pixels.values[std::size_t((y * pixels.width + x) * pixels.channels + c)] = rgb[c];
}

std::vector<std::uint8_t> everything(const Pixels& pixels) {
  return std::vector<std::uint8_t>(std::size_t(pixels.width) * std::size_t(pixels.height), 1);
}

TEST(ComparableTexels, LeaveOutEmittersWhatIsNotCoveredAndBorders) {
  Pixels reference = plain(8, 5, 2);
  set(reference, 2, 2, {0, 0, 0});                         // an emitter
  reference.values[std::size_t((2 * 8 + 7) * 4 + 3)] = 0;  // outside of charts, on the right border
  const auto with_edges = comparable_texels(reference, true);
  EXPECT_EQ(std::accumulate(with_edges.begin(), with_edges.end(), 0), 8 * 5 - 2);
  EXPECT_EQ(with_edges[2 * 8 + 2], 0);
  EXPECT_EQ(with_edges[2 * 8 + 7], 0);
  // Of the 6 x 3 texels inside: those that touch neither.
  const auto inside = comparable_texels(reference, false);
  EXPECT_EQ(std::accumulate(inside.begin(), inside.end(), 0), 6);
  for (const int x : {4, 5}) {
    for (const int y : {1, 2, 3}) EXPECT_EQ(inside[std::size_t(y * 8 + x)], 1) << x << "," << y;
  }
}

TEST(MapDifference, IsZeroForEqualMaps) {
  const Pixels map = plain(3, 2, 5);
  const MapDifference found = compare_maps({map, map}, everything(map)).value();
  EXPECT_EQ(found.num_texels, 6U);
  EXPECT_EQ(found.relative_rmse, 0);
  EXPECT_EQ(found.bias, 0);
  EXPECT_EQ(found.worst.relative, 0);
  EXPECT_THAT(found.mean, testing::Each(5.0));
}

TEST(MapDifference, MatchesAPairWorkedOutByHand) {
  const Pixels reference = plain(2, 2, 2);
  Pixels map = plain(2, 2, 2);
  set(map, 1, 1, {2, 1, 2});  // green off by 1
  const MapDifference found = compare_maps({reference, map}, everything(map)).value();
  EXPECT_NEAR(found.relative_rmse, std::sqrt(1.0 / 12) / 2, kRounding);
  EXPECT_NEAR(found.bias, -1.0 / 12 / 2, kRounding);
  EXPECT_NEAR(found.worst.relative, -0.7152 / 2, kRounding);
  EXPECT_EQ(found.worst.x, 1);
  EXPECT_EQ(found.worst.y, 1);
  EXPECT_NEAR(found.per_texel, 0.7152 / 4, kRounding);
  // Ranks 0, 1, 2 are 0 and rank 3 is the worst: 95 % of the way lies at rank 2.85.
  EXPECT_NEAR(found.p95, 0.85 * 0.7152 / 2, kRounding);
  EXPECT_EQ(found.p50, 0);
}

TEST(MapDifference, ScalesTheMapAndNotTheReference) {
  const Pixels reference = plain(2, 2, 1), map = plain(2, 2, 4);
  EXPECT_EQ(compare_maps({reference, map, 0.25}, everything(map)).value().relative_rmse, 0);
  EXPECT_NEAR(compare_maps({reference, map}, everything(map)).value().bias, 3, kRounding);
}

TEST(MapDifference, CountsATexelThatIsNearlyBlackAtTwoPerCentOfTheMean) {
  Pixels reference = plain(2, 1, 1), map = plain(2, 1, 1);
  set(reference, 0, 0, {0, 0, 0});
  set(map, 0, 0, {0.01F, 0.01F, 0.01F});
  // Mean luminance 0.5: 0.01 / (0.02 x 0.5).
  constexpr double kOfFloat = 1e-6;
  EXPECT_NEAR(compare_maps({reference, map}, everything(map)).value().worst.relative, 1, kOfFloat);
}

TEST(MapDifference, CountsTexelsThatTheMapDoesNotCover) {
  const Pixels reference = plain(2, 2, 1);
  Pixels map = plain(2, 2, 1);
  map.values[3] = 0;
  EXPECT_EQ(compare_maps({reference, map}, everything(map)).value().num_not_covered, 1U);
  EXPECT_EQ(compare_maps({reference, plain(2, 2, 1, 3)}, everything(map)).value().num_not_covered, 0U);
}

TEST(MapDifference, RefusesWhatCannotBeCompared) {
  const Pixels reference = plain(3, 2, 1);
  const auto refusal = [&](const Pixels& map) {
    return compare_maps({reference, map}, everything(reference)).error().message;
  };
  EXPECT_THAT(refusal(plain(2, 3, 1)), HasSubstr("2 x 3 texels and the reference 3 x 2"));
  EXPECT_THAT(refusal(plain(3, 2, 1, 1)), HasSubstr("1 channels"));
  Pixels broken = plain(3, 2, 1);
  set(broken, 2, 1, {1, std::numeric_limits<float>::quiet_NaN(), 1});
  EXPECT_THAT(refusal(broken), HasSubstr("nan at (2, 1)"));
  EXPECT_THAT(compare_maps({reference, reference}, std::vector<std::uint8_t>(6)).error().message,
              HasSubstr("no texel is left"));
  const Pixels dark = plain(3, 2, 0);
  EXPECT_THAT(compare_maps({dark, dark}, everything(dark)).error().message, HasSubstr("no light"));
}

TEST(Calibration, CountsWhatLiesWithinStatedErrorsAndStandardises) {
  const Pixels reference = plain(4, 1, 10);
  Pixels map = plain(4, 1, 10);
  set(map, 0, 0, {11, 11, 11});  // 1 standard error
  set(map, 1, 0, {8, 8, 8});     // 2
  const Pixels error = plain(4, 1, 1, 1);
  const Calibration found = calibrate({reference, map}, error, nullptr, everything(map)).value();
  EXPECT_NEAR(found.within_95, 0.75, kRounding);
  EXPECT_NEAR(found.standardised_rms, std::sqrt((1.0 + 4.0) / 4), kRounding);
  EXPECT_NEAR(found.stated, 0.1, kRounding);
  EXPECT_EQ(found.num_without, 0U);
}

TEST(Calibration, AddsTheErrorsOfTheReferenceAndScalesThoseOfTheMap) {
  const Pixels reference = plain(2, 2, 0.5F), map = plain(2, 2, 3);  // scaled: 1.5
  const Pixels error = plain(2, 2, 1.2F), of_reference = plain(2, 2, 0.8F);
  const Calibration found = calibrate({reference, map, 0.5}, error, &of_reference, everything(map)).value();
  constexpr double kOfFloat = 1e-6;
  EXPECT_NEAR(found.standardised_rms, 1, kOfFloat);  // 0.6^2 + 0.8^2 = 1
  EXPECT_NEAR(found.stated, 0.6 / 0.5, kOfFloat);
}

TEST(Calibration, SaysWhichTexelsStateNoError) {
  const Pixels reference = plain(2, 1, 1);
  Pixels map = plain(2, 1, 1), error = plain(2, 1, 0);
  set(map, 0, 0, {2, 2, 2});
  const Calibration found = calibrate({reference, map}, error, nullptr, everything(map)).value();
  EXPECT_EQ(found.num_without, 2U);
  EXPECT_EQ(found.within_95, 0.5);  // what is exact is within
  set(error, 1, 0, {0, -1, 0});
  EXPECT_THAT(calibrate({reference, map}, error, nullptr, everything(map)).error().message, HasSubstr("at (1, 0)"));
}

TEST(DifferencePicture, IsRedWhereBrighterBlueWhereDarkerWhiteWhereEqualAndGreyWhereNotCompared) {
  const Pixels reference = plain(4, 1, 1);
  Pixels map = plain(4, 1, 1);
  set(map, 0, 0, {1.3F, 1.3F, 1.3F});
  set(map, 1, 0, {0.7F, 0.7F, 0.7F});
  auto mask = everything(map);
  mask[3] = 0;
  const DifferencePicture drawn = draw_difference({reference, map}, mask);
  // The 99th percentile of 0.3, 0.3, 0 counts whole ranks: 0.3, up to 0.5.
  EXPECT_NEAR(drawn.limit, 0.5, kRounding);
  ASSERT_GE(drawn.picture.width, 512);
  const auto at = [&](int texel) {
    const std::size_t x = std::size_t(drawn.picture.width / 4 * texel + 5), y = 5;
    const std::uint8_t* rgb = &drawn.picture.rgb[(y * std::size_t(drawn.picture.width) + x) * 3];
    return std::array<int, 3>{rgb[0], rgb[1], rgb[2]};
  };
  EXPECT_GT(at(0)[0], at(0)[2] + 50);
  EXPECT_GT(at(1)[2], at(1)[0] + 50);
  EXPECT_EQ(at(2), (std::array<int, 3>{247, 247, 247}));
  EXPECT_EQ(at(3)[0], at(3)[1]);
  EXPECT_LT(at(3)[0], 100);
  // The scale below: its ends have the full colours.
  EXPECT_GT(drawn.picture.height, drawn.picture.width / 4);
}

TEST(DifferencePicture, HasAScaleForEqualMapsToo) {
  const Pixels map = plain(2, 2, 1);
  EXPECT_GT(draw_difference({map, map}, everything(map)).limit, 0);
}

}  // namespace
}  // namespace radbake::image
