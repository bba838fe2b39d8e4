// Bakes that are asked by error or by time: whether the error that they state is the one that they have.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "tests/invariant/bake_support.h"
#include "tests/invariant/seed_statistics.h"
#include "tests/record_figure.h"
#include "tests/scenes/cube_rooms.h"
#include "tests/scenes/rooms.h"

namespace radbake::tests {
namespace {

using radiosity::BakeOptions;
using radiosity::BakeOutcome;

/// How what bakes state stands to the truth.
struct Calibration {
  double share_inside = 0;  ///< of texels, truth within 1.96 standard errors
  double true_error = 0;    ///< relative, root mean square over texels and seeds
  double stated_error = 0;  ///< root mean square of the bakes' relative_rmse
  int num_within_target = 0;
};

/// `known`: standard error of `expected` itself.
Calibration calibrate(const SeededBakes& bakes, const std::vector<double>& expected, double known, double target) {
  Calibration out;
  double mean = 0;
  for (const double value : expected) mean += value / static_cast<double>(expected.size());
  double squares = 0, stated = 0;
  std::size_t inside = 0;
  for (std::size_t seed = 0; seed < kSeeds; ++seed) {
    double own = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
      const double off = bakes.texels[i].values[seed] - expected[i];
      own += off * off;
      inside += std::fabs(off) <= 1.96 * std::hypot(bakes.texels[i].errors[seed], known);
    }
    squares += own;
    out.num_within_target += std::sqrt(own / static_cast<double>(expected.size())) / mean <= target;
    stated += bakes.reports[seed].error.relative_rmse * bakes.reports[seed].error.relative_rmse / kSeeds;
  }
  const auto num = static_cast<double>(expected.size() * kSeeds);
  out.share_inside = static_cast<double>(inside) / num;
  out.true_error = std::sqrt(squares / num) / mean;
  out.stated_error = std::sqrt(stated);
  record_figure("share_inside", out.share_inside);
  record_figure("true_error", out.true_error);
  record_figure("stated_error", out.stated_error);
  return out;
}

class ManufacturedRoomToTarget : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(At, ManufacturedRoomToTarget, testing::Values(0.01, 0.003),
                         [](const auto& info) { return "Permille" + std::to_string(std::lround(1000 * info.param)); });

// All light of this room is in the rows and gathered: neighbours share noise, and the coarsest pass is within 1 %.
TEST_P(ManufacturedRoomToTarget, HasTheErrorThatItStates) {
  const Scene scene = manufactured_room(0.6, 256);
  const SeededBakes bakes = bake_with_seeds(scene, {.atlas_size = 128, .max_error = GetParam()});
  std::vector<double> expected;
  for (const SeededTexel& texel : bakes.texels) expected.push_back(manufactured_irradiance(scene, texel));
  const Calibration found = calibrate(bakes, expected, 0, GetParam());
  // As asked: 92..98 % where sampling leads, and 90 % at least over all texels.
  EXPECT_GE(found.share_inside, 0.90);
  EXPECT_LE(found.share_inside, 0.99);
  EXPECT_LE(found.stated_error, 1.25 * found.true_error);
  EXPECT_GE(found.stated_error, found.true_error / 1.25);
  EXPECT_EQ(found.num_within_target, kSeeds);
  for (const radiosity::BakeReport& report : bakes.reports) EXPECT_TRUE(report.error.is_reached);
}

// Nearly all light of this room is direct or found by chance: a dense bake with many rays is the reference.
TEST(RoomWithALampToTarget, HasTheErrorThatItStates) {
  constexpr double kTarget = 0.03;
  const Scene scene = cube_with_lamp(0.5);
  const SeededBakes bakes = bake_with_seeds(scene, {.atlas_size = 128, .max_error = kTarget});
  BakeOptions many{.atlas_size = 128, .rays = 4096};
  many.seed = 99;
  many.light_samples = 4096;
  const BakeOutcome reference = baked(scene, many);
  // Most of it is what its patches may be off by, which are those of a first pass.
  EXPECT_LE(reference.report.error.relative_rmse, 0.4 * kTarget);
  // The same texels in the same order.
  std::vector<double> expected;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    const Vec2 low = scene.meshes[m].texcoord1[0], size = scene.meshes[m].texcoord1[2] - low;
    for_each_covered_texel(reference.layers[0], [&](int x, int y, Vec3 rgb) {
      const double width = reference.layers[0].width;
      const double s = (x / width - low.x) / size.x, t = (y / width - low.y) / size.y, d = 1 / (width * size.x);
      constexpr double kPart = 0.25;
      if (s < -(1 - kPart) * d || s > 1 - kPart * d || t < -(1 - kPart) * d || t > 1 - kPart * d) return;
      expected.push_back(mean_component(rgb));
    });
  }
  ASSERT_EQ(expected.size(), bakes.texels.size());
  const double known = reference.report.error.relative_rmse * reference.report.energy.mean_irradiance;
  const Calibration found = calibrate(bakes, expected, known, kTarget);
  EXPECT_GE(found.share_inside, 0.90);
  EXPECT_LE(found.share_inside, 0.99);
  EXPECT_LE(found.stated_error, 1.25 * found.true_error);
  EXPECT_GE(found.stated_error, found.true_error / 1.25);
  EXPECT_EQ(found.num_within_target, kSeeds);
}

TEST(Furnace, NeedsOnePassForAnyTarget) {
  constexpr double kRoundingOfFloat = 1e-3;
  const BakeOutcome outcome = baked(furnace_room(0.5), {.atlas_size = 128, .max_error = 1e-4});
  EXPECT_EQ(outcome.report.passes.size(), 1u);
  EXPECT_TRUE(outcome.report.error.is_reached);
  EXPECT_LE(outcome.report.error.sampling, 1e-4);
  for_each_covered_texel(outcome.layers.at(0), [&](int, int, Vec3 h) { EXPECT_NEAR(h.x / 2, 1, kRoundingOfFloat); });
}

TEST(Targets, AreReachedWithTheSameBytesByAnyNumberOfThreads) {
  BakeOptions options{.atlas_size = 96, .max_error = 0.02};
  options.threads = 1;
  const BakeOutcome one = baked(small_emitter_room(0.7), options);
  EXPECT_GT(one.report.passes.size(), 1u);
  // Small passes are no measure of what a bake of so many rays costs.
  EXPECT_EQ(one.report.costs.texel_ray, 0);
  EXPECT_EQ(one.report.costs.row_ray, 0);
  for (const int threads : {2, 8}) {
    options.threads = threads;
    const BakeOutcome other = baked(small_emitter_room(0.7), options);
    ASSERT_EQ(other.layers.size(), one.layers.size());
    for (std::size_t k = 0; k < one.layers.size(); ++k) EXPECT_EQ(other.layers[k].values, one.layers[k].values) << k;
  }
}

TEST(Targets, ThatCannotBeReachedEndAtTheBudgetAndSaySo) {
  const BakeOutcome outcome =
      baked(small_emitter_room(0.7), {.atlas_size = 96, .max_error = 1e-5, .time_budget_seconds = 0.4});
  EXPECT_FALSE(outcome.report.error.is_reached);
  EXPECT_EQ(outcome.report.error.limited_by, "time");
  EXPECT_EQ(outcome.report.error.asked, 1e-5);
  EXPECT_GT(outcome.report.error.relative_rmse, 1e-5);
}

// A bake that time has ended is one of its passes: they give the same bytes again.
TEST(TimeBudget, IsRepeatedByThePassesThatItMade) {
  const Scene scene = small_emitter_room(0.7);
  const BakeOutcome timed = baked(scene, {.atlas_size = 96, .time_budget_seconds = 0.4});
  BakeOptions again{.atlas_size = 96};
  for (const radiosity::PassSummary& pass : timed.report.passes) {
    if (!pass.is_whole) GTEST_SKIP() << "the last pass was cut short by a busy machine: it cannot be repeated";
    again.replay.push_back(pass.scale);
  }
  const BakeOutcome repeated = baked(scene, again);
  EXPECT_EQ(repeated.report.passes.size(), timed.report.passes.size());
  EXPECT_EQ(repeated.layers.at(0).values, timed.layers.at(0).values);
}

TEST(Finish, EndsABakeWithItsFirstPass) {
  std::stop_source finish;
  finish.request_stop();
  SilentObserver observer;
  const auto outcome = radiosity::bake_scene(small_emitter_room(0.7), {.atlas_size = 96, .max_error = 1e-4}, observer,
                                             {}, finish.get_token());
  ASSERT_TRUE(outcome.ok());
  EXPECT_EQ(outcome->report.passes.size(), 1u);
  EXPECT_EQ(outcome->report.error.limited_by, "stopped");
  EXPECT_GT(outcome->report.error.relative_rmse, 1e-4);
}

TEST(Targets, HoldForLightByVertex) {
  BakeOptions options{.output = radiosity::Output::kVertices, .max_error = 0.03};
  const BakeOutcome outcome = baked(small_emitter_room(0.7), options);
  EXPECT_TRUE(outcome.report.error.is_reached);
  EXPECT_LE(outcome.report.error.relative_rmse, 0.03);
  EXPECT_LT(outcome.report.error.interval_low, outcome.report.error.relative_rmse);
  EXPECT_GT(outcome.report.error.interval_high, 1.01 * outcome.report.error.relative_rmse);
}

TEST(Targets, RefinePatchesWhereTheirSizeLeads) {
  // Few, large patches; the bound leaves room for more.
  BakeOptions options{.atlas_size = 96, .max_patches = 4096, .max_error = 0.01};
  const Scene scene = small_emitter_room(0.7);
  const BakeOutcome outcome = baked(scene, options);
  const bool has_refined = std::any_of(outcome.report.passes.begin(), outcome.report.passes.end(),
                                       [](const auto& pass) { return pass.scale.refines_patches; });
  record_figure("has_refined", has_refined);
  record_figure("num_patches", static_cast<double>(outcome.report.num_patches));
  EXPECT_TRUE(outcome.report.error.is_reached || outcome.report.error.limited_by == "discretisation");
}

}  // namespace
}  // namespace radbake::tests
