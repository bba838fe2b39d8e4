#include <gtest/gtest.h>

#include <cmath>

#include "tests/invariant/bake_support.h"
#include "tests/scenes/rooms.h"

namespace radbake::tests {
namespace {

using radiosity::BakeOptions;
using radiosity::BakeOutcome;

// E = 1 everywhere, rho = 1/2: B = E / (1 - rho) = 2 = H, whatever stands in the way.
TEST(Furnace, IsEvenlyLitInEveryValidTexel) {
  constexpr double kRoundingOfFloat = 1e-3;  // asked: 0.1 %; rows that sum to 1 leave rounding only
  const BakeOutcome outcome = baked(furnace_room(0.5), {.atlas_size = 64, .rays = 64});
  int texels = 0;
  double worst = 0;
  for_each_covered_texel(outcome.layers.at(0), [&](int, int, Vec3 h) {
    ++texels;
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::fabs(h[c] / 2 - 1));
  });
  EXPECT_GT(texels, 1000);
  EXPECT_LE(worst, kRoundingOfFloat);
  EXPECT_EQ(outcome.report.plan.survey.num_emitter_triangles, 0u);
  EXPECT_TRUE(outcome.report.energy.is_closed);
  EXPECT_EQ(outcome.report.transport.raw_closure_max, 0);
}

// A room where a wrong form factor shows: one small bright panel. All rows of a closed room sum to 1.
TEST(SmallEmitterRoom, KeepsItsEnergy) {
  const BakeOutcome outcome = baked(small_emitter_room(0.5), {.atlas_size = 128, .rays = 256});
  const auto& energy = outcome.report.energy;
  EXPECT_TRUE(energy.is_closed);
  EXPECT_GT(outcome.report.plan.survey.num_emitter_triangles, 0u);
  // Transported: exact on a reciprocal operator.
  EXPECT_LE(energy.transported_relative_gap, 10 * outcome.report.solver.tolerance);
  // Whole bake: what the panel sends arrives, within three standard errors of the direct light.
  EXPECT_GT(energy.gap_standard_error, 0);
  EXPECT_LE(std::fabs(energy.gap), 3 * energy.gap_standard_error);
  EXPECT_LT(energy.gap_standard_error, 0.01 * energy.emitted);
}

TEST(SmallEmitterRoom, HasTheMeanIrradianceOfTheAnalyticBalance) {
  constexpr double kAsked = 0.005;
  const Scene scene = small_emitter_room(0.5);
  const BakeOutcome outcome = baked(scene, {.atlas_size = 256, .rays = 256});
  // sum A E = sum A (1 - rho) H, so the mean of H is the mean of E over 1 - rho.
  const auto& survey = outcome.report.plan.survey;
  const double expected = survey.emitted_lumens / survey.area_m2 / 0.5;
  EXPECT_NEAR(outcome.report.energy.mean_irradiance / expected, 1, kAsked);
}

TEST(Bake, GivesTheSameBytesForAnyNumberOfThreads) {
  const Scene scene = small_emitter_room(0.7);
  const BakeOptions one{.atlas_size = 64, .rays = 32, .seed = 5, .threads = 1};
  const BakeOutcome first = baked(scene, one);
  for (const int threads : {1, 2, 8}) {
    BakeOptions options = one;
    options.threads = threads;
    const BakeOutcome again = baked(scene, options);
    EXPECT_EQ(first.layers.at(0).values, again.layers.at(0).values) << threads << " threads";
    EXPECT_EQ(first.report.solver.residual, again.report.solver.residual);
    EXPECT_EQ(first.report.energy.gap, again.report.energy.gap);
  }
}

}  // namespace
}  // namespace radbake::tests
