#include "server/radiosity/plan/pass_plan.h"

#include <gtest/gtest.h>

#include <cmath>

namespace radbake::radiosity {
namespace {

/// A bake whose first pass has 4 % of direct and 3 % of gathered sampling error.
PassResults after_first_pass() {
  PassResults results;
  results.direct_sampling = 0.04;
  results.gathered_sampling = 0.03;
  results.discretisation = 0.001;
  results.error = std::hypot(0.04, 0.03, 0.001);
  results.direct_effort = results.gathered_effort = 1;
  results.direct_rays = 6e5;
  results.gathered_rays = 7e5;
  results.num_passes = 1;
  results.last_direct_scale = results.last_gathered_scale = 1;
  results.last_seconds = 0.2;
  results.fixed_seconds = 0.05;
  return results;
}

/// The same after so much more effort in all, with errors by then.
PassResults after_effort(double effort, double direct, double gathered, double discretisation) {
  PassResults results = after_first_pass();
  results.gathered_effort = results.direct_effort = effort;
  results.gathered_rays *= effort;
  results.direct_rays *= effort;
  results.direct_sampling = direct;
  results.gathered_sampling = gathered;
  results.discretisation = discretisation;
  results.error = std::hypot(direct, gathered, discretisation);
  return results;
}

/// What a pass of so much more makes of it, as the plan's model has it.
void advance(const NextPass& next, PassResults& results) {
  const double direct = results.direct_effort / (results.direct_effort + next.scale.direct);
  const double gathered = results.gathered_effort / (results.gathered_effort + next.scale.gathered);
  results.direct_rays /= direct;
  results.gathered_rays /= gathered;
  results.direct_effort /= direct;
  results.gathered_effort /= gathered;
  results.direct_sampling *= std::sqrt(direct);
  results.gathered_sampling *= std::sqrt(gathered);
  results.error = std::hypot(results.direct_sampling, results.gathered_sampling, results.discretisation);
  ++results.num_passes;
  results.last_direct_scale = next.scale.direct;
  results.last_gathered_scale = next.scale.gathered;
}

TEST(PassPlan, HasNoOtherPassWhereTheFirstIsGoodEnough) {
  NoPass no_pass;
  EXPECT_FALSE(plan_next_pass(after_first_pass(), 0.06, no_pass));
  EXPECT_TRUE(no_pass.limited_by.empty());
}

TEST(PassPlan, PredictsFourFifthsOfATargetThatOnePassReaches) {
  constexpr double kQuantised = 0.02;
  NoPass no_pass;
  const auto next = plan_next_pass(after_first_pass(), 0.04, no_pass);
  ASSERT_TRUE(next);
  EXPECT_NEAR(next->predicted_error, 0.8 * 0.04, kQuantised * 0.04);
  EXPECT_DOUBLE_EQ(next->share_of_rest, 1);
}

TEST(PassPlan, ReachesAFarTargetInPassesThatGrow) {
  PassResults results = after_first_pass();
  NoPass no_pass;
  double last_rays = 0;
  while (const auto next = plan_next_pass(results, 0.005, no_pass)) {
    const double before = results.direct_rays + results.gathered_rays;
    advance(*next, results);
    const double rays = results.direct_rays + results.gathered_rays - before;
    EXPECT_LE(rays, 4.5 * before);
    last_rays = rays;
    ASSERT_LT(results.num_passes, 10);
  }
  EXPECT_GT(last_rays, 0);
  EXPECT_TRUE(no_pass.limited_by.empty());
  EXPECT_LE(results.error, 0.9 * 0.005);
  EXPECT_GE(results.error, 0.5 * 0.005);
}

TEST(PassPlan, SpendsMoreWhereThereIsMoreToGain) {
  PassResults results = after_first_pass();
  results.gathered_sampling = 0.005;
  NoPass no_pass;
  const auto next = plan_next_pass(results, 0.02, no_pass);
  ASSERT_TRUE(next);
  EXPECT_GT(next->scale.direct, 4 * next->scale.gathered);
}

TEST(PassPlan, EndsAtTheDiscretisationThatNoPassRemoves) {
  PassResults results = after_first_pass();
  results.discretisation = 0.03;
  NoPass no_pass;
  int num_passes = 0;
  while (const auto next = plan_next_pass(results, 0.02, no_pass)) {
    advance(*next, results);
    ASSERT_LT(++num_passes, 10);
  }
  EXPECT_EQ(no_pass.limited_by, "discretisation");
}

TEST(PassPlan, RefinesPatchesWhereTheirSizeLeads) {
  PassResults results = after_first_pass();
  results.discretisation = 0.03;
  results.can_refine_patches = true;
  NoPass no_pass;
  const auto next = plan_next_pass(results, 0.02, no_pass);
  ASSERT_TRUE(next);
  EXPECT_TRUE(next->scale.refines_patches);
  results.discretisation = 0.005;
  const auto other = plan_next_pass(results, 0.02, no_pass);
  ASSERT_TRUE(other);
  EXPECT_FALSE(other->scale.refines_patches);
}

// Smaller patches drop what was gathered from larger ones.
TEST(PassPlan, KeepsPatchesWhereTheTimeLeftGathersLessThanIsDropped) {
  PassResults results = after_effort(100, 0.004, 0.003, 0.008);
  results.last_direct_scale = results.last_gathered_scale = 60;
  results.last_seconds = 12;
  results.num_passes = 4;
  results.can_refine_patches = true;
  NoPass no_pass;
  results.seconds_left = 3;
  const auto last = plan_next_pass(results, 0, no_pass);
  ASSERT_TRUE(last);
  EXPECT_FALSE(last->scale.refines_patches);
  results.seconds_left = 60;
  const auto next = plan_next_pass(results, 0, no_pass);
  ASSERT_TRUE(next);
  EXPECT_TRUE(next->scale.refines_patches);
}

TEST(PassPlan, StopsInterpolatingWhereThatIsAllThatIsLeft) {
  PassResults results = after_effort(16, 0.009, 0.009, 0.02);
  NoPass no_pass;
  EXPECT_FALSE(plan_next_pass(results, 0.02, no_pass));
  EXPECT_EQ(no_pass.limited_by, "discretisation");
  results.refinable_interpolation = 0.019;
  results.interpolation_limit = 0.008;
  results.num_texels = 1000;
  results.num_refinable_texels = 100;
  const auto next = plan_next_pass(results, 0.02, no_pass);
  ASSERT_TRUE(next);
  EXPECT_EQ(next->scale.interpolation_limit, 0.008);
  EXPECT_LT(next->predicted_error, 0.8 * 0.02);
  // Those texels have nothing but this pass.
  EXPECT_GT(next->scale.gathered, 1);
}

TEST(PassPlan, FillsABudgetAndNoMore) {
  PassResults results = after_first_pass();
  constexpr double kBudget = 5, kRayCost = 4;
  double spent = results.last_seconds;
  NoPass no_pass;
  for (;;) {
    results.seconds_left = kBudget - spent;
    const double cost = kRayCost * results.gathered_rays / results.gathered_effort * results.last_gathered_scale +
                        results.direct_rays / results.direct_effort * results.last_direct_scale;
    const auto next = plan_next_pass(results, 0, no_pass);
    if (!next) break;
    const double own = kRayCost * results.gathered_rays / results.gathered_effort * next->scale.gathered +
                       results.direct_rays / results.direct_effort * next->scale.direct;
    results.last_seconds = results.fixed_seconds + (results.last_seconds - results.fixed_seconds) * own / cost;
    spent += results.last_seconds;
    advance(*next, results);
    ASSERT_LT(results.num_passes, 40);
  }
  EXPECT_EQ(no_pass.limited_by, "time");
  EXPECT_LE(spent, kBudget);
  EXPECT_GE(spent, 0.85 * kBudget);
}

TEST(PassPlan, EndsAtOnceWhereNoTimeIsLeft) {
  PassResults results = after_first_pass();
  results.seconds_left = 0;
  NoPass no_pass;
  EXPECT_FALSE(plan_next_pass(results, 0.001, no_pass));
  EXPECT_EQ(no_pass.limited_by, "time");
}

// What errors say was too low before: passes that add next to nothing would follow each other for ever.
TEST(PassPlan, GoesOnInPassesThatMatterWhereItIsNotDone) {
  PassResults results = after_first_pass();
  results.num_passes = 6;
  results.direct_effort = 400;
  results.gathered_effort = 20;
  results.direct_sampling = 0.06;
  results.gathered_sampling = 0.001;
  results.error = 0.06;
  results.direct_deviation = 0.01;
  NoPass no_pass;
  const auto next = plan_next_pass(results, 0.05, no_pass);
  ASSERT_TRUE(next);
  EXPECT_GE(next->scale.direct, 40);
  EXPECT_GE(next->scale.gathered, 2);
}

TEST(PassPlan, SharesRaysOutAmongPatchesThatAreMore) {
  const PassScale scale{16, 1, false};
  EXPECT_EQ(pass_of(scale, 4).rays_per_row, pass_of(scale).rays_per_row / 4);
  EXPECT_EQ(pass_of(scale, 4).rays_per_texel, pass_of(scale).rays_per_texel);
  EXPECT_EQ(pass_of(scale, 1000).rays_per_row, pass_of({1, 1, false}).rays_per_row);
}

TEST(PassPlan, GivesEachReplicateWholeShares) {
  for (const double scale : {0.25, 1.0, 1.3, 7.7, 300.0, 5000.0}) {
    const PassSettings pass = pass_of({scale, scale});
    for (const int rays : {pass.rays_per_row, pass.rays_per_texel, pass.rays_per_node, pass.light_samples}) {
      EXPECT_EQ(rays % 4, 0) << scale;
      EXPECT_GE(rays, 4) << scale;
      EXPECT_LE(rays, 65536) << scale;
    }
    EXPECT_EQ(pass.patch_light_samples % 16, 0) << scale;
  }
}

}  // namespace
}  // namespace radbake::radiosity
