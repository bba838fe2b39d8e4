#include "server/radiosity/plan/predict.h"

#include <gtest/gtest.h>

#include <cmath>

namespace radbake::radiosity {
namespace {

BakeWork some_work() {
  BakeWork work;
  work.preparing_seconds = 0.5;
  work.num_rows = 1000;
  work.rays_per_row = 256;
  work.light_rays_per_row = 64;
  work.entries_per_row = 200;
  work.sweeps = 10;
  work.num_receivers = 20'000;
  work.rays_per_receiver = 256;
  work.light_rays_per_receiver = 128;
  work.num_triangles = 5000;
  work.num_patches = 1000;
  work.num_pixels = 65536;
  work.threads = 2;
  return work;
}
constexpr HostCosts kCosts = {1e-6, 2e-6, 0.5e-6, 1e-4, 1e-5, 1e-9, 1e-7};

const StagePrediction& stage_of(const std::vector<StagePrediction>& stages, const std::string& name) {
  for (const StagePrediction& stage : stages) {
    if (stage.stage == name) return stage;
  }
  throw std::out_of_range(name);
}

TEST(Prediction, SumsCountsTimesCosts) {
  BakeWork work = some_work();
  work.num_pixels = 0;
  const auto stages = predict_stages(work, kCosts, {});
  ASSERT_EQ(stages.size(), 4u);
  EXPECT_EQ(stage_of(stages, "preparing").cpu_seconds, 0.5);
  // 1000 rows of 100 us beside rays, 256 us of rays, 32 us of shadow rays, and 200 entries of 0.1 us.
  EXPECT_NEAR(stage_of(stages, "form_factors").cpu_seconds, 1000 * (100e-6 + 256e-6 + 32e-6 + 20e-6), 1e-12);
  // 10 sweeps over twice 200 entries a row.
  EXPECT_NEAR(stage_of(stages, "solving").cpu_seconds, 10 * 1000 * 400 * 1e-9, 1e-12);
  EXPECT_NEAR(stage_of(stages, "gathering").cpu_seconds, 20'000 * (10e-6 + 512e-6 + 64e-6), 1e-12);
  const StagePrediction total = total_of(stages);
  EXPECT_NEAR(total.cpu_seconds, 0.5 + 0.408 + 0.004 + 11.72, 1e-9);
  EXPECT_EQ(total.stage, "total");
}

TEST(Prediction, SharesWorkAmongThreadsButNotThePreparation) {
  BakeWork work = some_work();
  const auto two = predict_stages(work, kCosts, {});
  work.threads = 1;
  const auto one = predict_stages(work, kCosts, {});
  EXPECT_EQ(stage_of(two, "preparing").wall_seconds, 0.5);
  EXPECT_EQ(stage_of(one, "gathering").wall_seconds, stage_of(one, "gathering").cpu_seconds);
  const StagePrediction& gathering = stage_of(two, "gathering");
  EXPECT_EQ(gathering.cpu_seconds, stage_of(one, "gathering").cpu_seconds);
  EXPECT_GT(gathering.wall_seconds, gathering.cpu_seconds / 2);
  EXPECT_LT(gathering.wall_seconds, gathering.cpu_seconds);
}

TEST(Prediction, IsWiderWhereItsCostsAreLessCertain) {
  const auto sure = stage_of(predict_stages(some_work(), kCosts, {0, 0}), "gathering");
  const auto unsure = stage_of(predict_stages(some_work(), kCosts, {0, 0.2}), "gathering");
  EXPECT_EQ(sure.cpu_seconds, unsure.cpu_seconds);
  EXPECT_LT(sure.cpu_seconds_low, sure.cpu_seconds);
  EXPECT_GT(sure.cpu_seconds_high, sure.cpu_seconds);
  EXPECT_LT(unsure.cpu_seconds_low, sure.cpu_seconds_low);
  EXPECT_GT(unsure.cpu_seconds_high, sure.cpu_seconds_high);
}

TEST(Prediction, KnowsWhatIsLeftOutAndWhatIsDoneThreeTimes) {
  BakeWork work = some_work();
  work.num_rows = 0;
  const auto direct_only = predict_stages(work, kCosts, {});
  EXPECT_EQ(stage_of(direct_only, "form_factors").cpu_seconds, 0);
  EXPECT_EQ(stage_of(direct_only, "solving").cpu_seconds, 0);

  work = some_work();
  work.num_pixels = 0;
  const auto once = predict_stages(work, kCosts, {});
  work.num_ray_channels = 3;
  const auto thrice = predict_stages(work, kCosts, {});
  EXPECT_DOUBLE_EQ(stage_of(thrice, "form_factors").cpu_seconds, 3 * stage_of(once, "form_factors").cpu_seconds);
  EXPECT_DOUBLE_EQ(stage_of(thrice, "gathering").cpu_seconds, 3 * stage_of(once, "gathering").cpu_seconds);

  work = some_work();
  work.num_solved_channels = 1;
  EXPECT_LT(stage_of(predict_stages(work, kCosts, {}), "solving").cpu_seconds, stage_of(once, "solving").cpu_seconds);
}

// A streamed operator keeps no entries and makes all rows anew in each sweep.
TEST(Prediction, KnowsWhatOperatorsCost) {
  BakeWork work = some_work();
  const auto sparse = predict_stages(work, kCosts, {});
  work.transport = Transport::kStreamed;
  const auto streamed = predict_stages(work, kCosts, {});
  EXPECT_NEAR(stage_of(streamed, "solving").cpu_seconds, 10 * 0.388, 1e-9);
  EXPECT_LT(stage_of(streamed, "form_factors").memory_bytes, stage_of(sparse, "form_factors").memory_bytes);
  work.transport = Transport::kDense;
  work.num_patches = 100'000;
  EXPECT_GT(stage_of(predict_stages(work, kCosts, {}), "solving").memory_bytes, std::uint64_t{80'000'000'000});
}

TEST(Prediction, GrowsInMemoryWithLayersAndTakesTheLargestStage) {
  BakeWork work = some_work();
  work.num_pixels = 4096.0 * 4096;
  const auto one = predict_stages(work, kCosts, {});
  EXPECT_EQ(total_of(one).memory_bytes, stage_of(one, "gathering").memory_bytes);
  work.num_layers = 4;
  EXPECT_GT(total_of(predict_stages(work, kCosts, {})).memory_bytes, 3 * total_of(one).memory_bytes);
}

TEST(Prediction, ExpectsMoreSweepsWhereMoreLightIsKept) {
  // Half of the error is left by Jacobi: 20 sweeps to a millionth, half as many by Gauss-Seidel.
  EXPECT_NEAR(expected_sweeps(0.5, 1e-6), std::log(0.5e-6) / std::log(0.25), 1e-12);
  EXPECT_GT(expected_sweeps(0.9, 1e-6), 5 * expected_sweeps(0.5, 1e-6));
  EXPECT_EQ(expected_sweeps(0, 1e-6), 2);
  EXPECT_EQ(expected_sweeps(1, 1e-6), 10'000);
}

}  // namespace
}  // namespace radbake::radiosity
