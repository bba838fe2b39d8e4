// Light from the sky against closed forms, as a texel receives it: by rays that escape and by sampled light together.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/radiosity/lights/environment.h"
#include "tests/scenes/rooms.h"
#include "tests/unit/radiosity/receiver_point.h"

namespace radbake::radiosity {
namespace {

constexpr int kRays = 256, kLightSamples = 128;  // as a bake's defaults
constexpr int kSeeds = 64;
/// Of the mean over seeds; one in 370 honest comparisons is farther off. Seeds are fixed.
constexpr double kStandardErrors = 3;
/// Where the samples give the same number each time: rays start 2^-20 of the scene above the floor.
constexpr double kSinglePrecision = 1e-5;

/// A black floor of 10 x 10 m around the origin, facing up.
tests::RoomBuilder black_floor() {
  tests::RoomBuilder builder(4);
  builder.add_quad("floor", {-5, 0, -5}, {0, 0, 10}, {10, 0, 0}, builder.add_material("black", {0, 0, 0}));
  return builder;
}

void expect_within_standard_errors(const ReceiverPoint::Estimate& estimate, double exact) {
  EXPECT_NEAR(estimate.mean.x, exact, kStandardErrors * estimate.standard_error + kSinglePrecision * exact);
  // And the estimate is sharp enough for that to say something.
  EXPECT_LT(estimate.standard_error, 0.005 * exact);
}

// H = int L cos = pi L.
TEST(Sky, OfOneLuminanceGivesPiTimesIt) {
  tests::RoomBuilder builder = black_floor();
  builder.scene().sky = {3, 5, 7};
  const Vec3 h = ReceiverPoint(builder.scene()).irradiance({1, 0, 2}, kRays, kLightSamples, 1);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(h[c] / (std::numbers::pi * builder.scene().sky[c]), 1, kSinglePrecision);
}

// A wall as long as the sky is wide, of height a at distance d, hides (1 - d / sqrt(d^2 + a^2)) / 2 of the lobe.
TEST(Sky, IsHalvedAtTheFootOfAWallAndComesBackWithDistance) {
  tests::RoomBuilder builder = black_floor();
  builder.scene().sky = {1, 1, 1};
  constexpr double kLong = 4000, kHeight = 3;
  builder.add_quad("wall", {-4, 0, -kLong / 2}, {0, 0, kLong}, {0, kHeight, 0}, 0);
  const ReceiverPoint floor(builder.scene());
  for (const double distance : {0.05, 0.5, 2.0, 4.0}) {
    const double open = 1 - (1 - distance / std::hypot(distance, kHeight)) / 2;
    expect_within_standard_errors(floor.estimate({-4 + distance, 0, 0.3}, kRays, kLightSamples, kSeeds),
                                  open * std::numbers::pi);
  }
}

/// The part of a disc of radius 1 that lies beyond a chord at s from its middle, -1..1.
double disc_beyond(double s) { return (std::acos(s) - s * std::sqrt(1 - s * s)) / std::numbers::pi; }

// Below the straight edge of a roof at height a, a sun of half-angle alpha overhead sends the part of its disc beyond
// a chord at x / (a tan alpha): H = E (1 - (acos s - s sqrt(1 - s^2)) / pi).
TEST(Sun, OfADiscThrowsThePenumbraOfAChord) {
  tests::RoomBuilder builder = black_floor();
  constexpr double kDiameter = 0.04, kHeight = 4, kIlluminance = 1000;
  builder.scene().lights.push_back({"sun", DirectionalLight{{0, -1, 0}, {kIlluminance, 0, 0}, kDiameter}});
  builder.add_quad("roof", {-5, kHeight, -5}, {5, 0, 0}, {0, 0, 10}, 0);
  const ReceiverPoint floor(builder.scene());
  const double width = kHeight * std::tan(kDiameter / 2);
  for (const double s : {-0.8, -0.4, 0.0, 0.3, 0.7}) {
    const auto estimate = floor.estimate({s * width, 0, 0.5}, kRays, kLightSamples, kSeeds);
    // The edge is a chord in tangents, the disc one in sines: they differ by alpha^2 / 2.
    constexpr double kChord = kDiameter * kDiameter / 8;
    EXPECT_NEAR(estimate.mean.x, kIlluminance * (1 - disc_beyond(s)),
                kStandardErrors * estimate.standard_error + kIlluminance * kChord)
        << s;
    EXPECT_LT(estimate.standard_error, 0.005 * kIlluminance);
  }
  EXPECT_EQ(floor.irradiance({-2 * width, 0, 0.5}, kRays, kLightSamples, 1).x, 0);
  EXPECT_NEAR(floor.irradiance({2 * width, 0, 0.5}, kRays, kLightSamples, 1).x, kIlluminance,
              kIlluminance * kSinglePrecision);
}

// A disc of any width sends its illuminance on a facing surface; on a slope, that times the cosine to its middle, as
// long as none of it has set.
TEST(Sun, OfAWideDiscGivesItsIlluminanceTimesTheCosine) {
  tests::RoomBuilder builder = black_floor();
  builder.scene().lights.push_back({"sun", DirectionalLight{normalized({3, -4, 0}), {1000, 0, 0}, 0.5}});
  expect_within_standard_errors(ReceiverPoint(builder.scene()).estimate({1, 0, 1}, kRays, kLightSamples, kSeeds), 800);
}

TexturePlane image_of(int height, const std::function<double(int row, int column)>& luminance) {
  TexturePlane image{.name = "sky", .width = 2 * height, .height = height, .channels = 3, .values = {}};
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < 2 * height; ++column) {
      for (int c = 0; c < 3; ++c) image.values.push_back(static_cast<float>(luminance(row, column)));
    }
  }
  return image;
}

// Of one texel, theta from the zenith: H = L int int cos sin = L dphi / 2 (sin^2 theta_2 - sin^2 theta_1).
double irradiance_of_texel(int height, int row) {
  const double step = std::numbers::pi / height;
  const double top = std::sin(row * step), bottom = std::sin((row + 1) * step);
  return step / 2 * (bottom * bottom - top * top);
}

TEST(Environment, WithOneBrightTexelGivesItsLuminanceTimesItsProjectedSolidAngle) {
  constexpr int kHeight = 32, kRow = 9;
  for (const int column : {0, 17, 63}) {
    tests::RoomBuilder builder = black_floor();
    builder.scene().environment =
        image_of(kHeight, [&](int row, int at) { return row == kRow && at == column ? 1e5 : 0.0; });
    expect_within_standard_errors(ReceiverPoint(builder.scene()).estimate({1, 0, 1}, kRays, kLightSamples, kSeeds),
                                  1e5 * irradiance_of_texel(kHeight, kRow));
  }
}

// The dim part comes by rays that escape, the bright one by samples: neither is lost, and neither counts twice.
TEST(Environment, DimAndBrightTogetherGiveTheSumOverItsTexels) {
  constexpr int kHeight = 16;
  const auto luminance = [](int row, int column) { return row == 3 && column < 4 ? 500.0 : 1.0 + 0.5 * row; };
  double exact = 0;
  for (int row = 0; row < kHeight / 2; ++row) {
    for (int column = 0; column < 2 * kHeight; ++column) {
      exact += luminance(row, column) * irradiance_of_texel(kHeight, row);
    }
  }
  tests::RoomBuilder builder = black_floor();
  builder.scene().environment = image_of(kHeight, luminance);
  expect_within_standard_errors(ReceiverPoint(builder.scene()).estimate({1, 0, 1}, kRays, kLightSamples, kSeeds),
                                exact);
}

// +X is in the middle of the image, +Z to the right of it, and the rows begin at the zenith.
TEST(Environment, LooksUpTheTexelThatItSamples) {
  const auto index = [](int row, int column) { return 1.0 + row * 8 + column; };
  const TexturePlane image = image_of(4, index);
  const Environment environment(image, Environment::Part::kAll);
  EXPECT_EQ(environment.luminance({0, 1, 0}).x, index(0, 4));
  EXPECT_EQ(environment.luminance(normalized({1, 0.1, 0.1})).x, index(1, 4));
  EXPECT_EQ(environment.luminance(normalized({0.1, -0.1, 1})).x, index(2, 5));
  constexpr int kPoints = 4096;
  const SobolPoints points(kPoints);
  const auto seeds = SobolPoints::seeds_of(1);
  double solid_angle = 0;
  for (int i = 0; i < kPoints; ++i) {
    const auto sample = environment.sample(points.coordinate(i, 0, seeds), points.coordinate(i, 1, seeds));
    EXPECT_EQ(environment.luminance(sample.direction).x, sample.luminance.x) << i;
    solid_angle += 1 / sample.density / kPoints;
  }
  // 1 / density is a mean of the sphere's solid angle; 4096 points of a net err by about 1/1000 in steps like these.
  constexpr double kNet = 0.005;
  EXPECT_NEAR(solid_angle / (4 * std::numbers::pi), 1, kNet);
}

// The lobe over the floor is what the roof leaves of it: a sky of every direction is blocked as one of one luminance.
TEST(Environment, OfOneLuminanceIsASky) {
  tests::RoomBuilder builder = black_floor();
  builder.add_quad("roof", {-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, 0);
  builder.scene().sky = {2, 2, 2};
  const Vec3 sky = ReceiverPoint(builder.scene()).irradiance({0.5, 0, 0.5}, kRays, kLightSamples, 1);
  builder.scene().sky = {};
  builder.scene().environment = image_of(8, [](int, int) { return 2.0; });
  const Vec3 environment = ReceiverPoint(builder.scene()).irradiance({0.5, 0, 0.5}, kRays, kLightSamples, 1);
  EXPECT_GT(sky.x, 0);
  EXPECT_NEAR(environment.x / sky.x, 1, kSinglePrecision);  // nothing is bright: the same rays
}

}  // namespace
}  // namespace radbake::radiosity
