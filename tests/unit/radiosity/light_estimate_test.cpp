#include "server/radiosity/gather/light_estimate.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace radbake::radiosity {
namespace {

TEST(MeanAndVarianceOfReplicates, AreThoseOfTheirMean) {
  const std::vector<Vec3> replicates = {{1, 0, 5}, {2, 0, 5}, {3, 0, 5}, {6, 4, 5}};
  const MeanAndVariance out = mean_and_variance(replicates);
  EXPECT_EQ(out.mean, (Vec3{3, 1, 5}));
  EXPECT_DOUBLE_EQ(out.variance.x, (4.0 + 1 + 0 + 9) / 12);
  EXPECT_DOUBLE_EQ(out.variance.y, 1.0);
  EXPECT_DOUBLE_EQ(out.variance.z, 0.0);
}

TEST(MeanSquareWithoutNoise, IsTheSquareOfTheMeanAndNotOfTheNoise) {
  // 2 in noise of standard deviation 3: the mean of many estimates is 4, not 4 + 9 / 4.
  constexpr int kTrials = 200000;
  constexpr double kFourSigma = 4 * 0.025;  // an estimate's standard deviation is about 11
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(2, 3);
  double sum = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    std::vector<Vec3> replicates(4);
    for (Vec3& x : replicates) x = {noise(random), noise(random), noise(random)};
    sum += mean_square_without_noise(replicates);
  }
  EXPECT_NEAR(sum / kTrials, 4, kFourSigma);
}

TEST(LightEstimate, WeighsPassesAndAddsUpTheirVariances) {
  constexpr double kRoundingOfFloat = 1e-6;
  LightEstimate light(2, 1, true, true);
  light.begin_pass(1);
  light.add(0, {{8, 0, 0}, {4, 4, 4}, {16, 0, 0}, {1, 1, 1}, {2, 2, 2}, 0.5}, 4);
  light.end_pass();
  light.begin_pass(3);
  light.add(0, {{4, 0, 0}, {8, 8, 8}, {8, 0, 0}, {2, 2, 2}, {4, 4, 4}, 1}, 12);
  light.end_pass();
  // Direct: weights 4 and 12; gathered: 1 and 3.
  EXPECT_NEAR(light.direct(0).x, 5, kRoundingOfFloat);
  EXPECT_NEAR(light.direct_variance(0).x, 16.0 / 16 + 8 * 9.0 / 16, kRoundingOfFloat);
  EXPECT_NEAR(light.gathered(0).y, 7, kRoundingOfFloat);
  EXPECT_NEAR(light.gathered_variance(0).y, 1.0 / 16 + 2 * 9.0 / 16, kRoundingOfFloat);
  EXPECT_NEAR(light.irradiance(0).x, 12, kRoundingOfFloat);
  EXPECT_NEAR(light.reflected(0).z, 3.5, kRoundingOfFloat);
  EXPECT_NEAR(light.openness(0), 0.875, kRoundingOfFloat);
  EXPECT_EQ(light.irradiance(1), Vec3{});
}

// Buried as the first pass saw it, not as the others did: what it did not measure is not a darkness of 0.
TEST(LightEstimate, KeepsPassesApartThatLeftAReceiverOut) {
  LightEstimate light(1, 1, false, false);
  light.begin_pass(1);
  light.end_pass();
  light.begin_pass(1);
  light.add(0, {{8, 8, 8}, {4, 4, 4}, {16, 16, 16}, {1, 1, 1}, {}, 0}, 4);
  light.end_pass();
  EXPECT_EQ(light.gathered(0), (Vec3{4, 4, 4}));
  EXPECT_EQ(light.gathered_variance(0), (Vec3{1, 1, 1}));
  light.begin_pass(2);
  light.end_pass();
  EXPECT_EQ(light.irradiance(0), (Vec3{12, 12, 12}));
}

// A texel that was interpolated and gathers alone now, and one of which another part counts now.
TEST(LightEstimate, ForgetsWhatDoesNotCountAnyMore) {
  LightEstimate light(2, 1, false, false);
  light.begin_pass(1);
  for (const std::size_t i : {0, 1}) light.add(i, {{8, 8, 8}, {4, 4, 4}, {16, 16, 16}, {1, 1, 1}, {}, 0}, 4);
  light.end_pass();
  light.forget_gathered(0);
  light.forget(1);
  EXPECT_EQ(light.irradiance(0), (Vec3{12, 12, 12}));  // until it is known better
  light.begin_pass(1);
  for (const std::size_t i : {0, 1}) light.add(i, {{2, 2, 2}, {6, 6, 6}, {8, 8, 8}, {3, 3, 3}, {}, 0}, 4);
  light.end_pass();
  EXPECT_EQ(light.gathered(0), (Vec3{6, 6, 6}));
  EXPECT_EQ(light.gathered_variance(0), (Vec3{3, 3, 3}));
  EXPECT_EQ(light.direct(0), (Vec3{5, 5, 5}));
  EXPECT_EQ(light.gathered(1), (Vec3{6, 6, 6}));
  EXPECT_EQ(light.direct(1), (Vec3{2, 2, 2}));
}

}  // namespace
}  // namespace radbake::radiosity
