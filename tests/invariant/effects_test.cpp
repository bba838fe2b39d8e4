// Effects: a plan turns on exactly what is there. Forced on, what it turned off changes nothing; forced off, what it
// turned on changes the map.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/invariant/bake_support.h"
#include "tests/invariant/seed_maps.h"
#include "tests/scenes/effect_rooms.h"

namespace radbake::tests {
namespace {

using radiosity::Effect;
using radiosity::EffectPlan;
using radiosity::EffectState;

radiosity::BakeOptions quick_options() {
  radiosity::BakeOptions options;
  options.atlas_size = 64;
  options.rays = 64;
  return options;
}

radiosity::BakeOptions forced(const std::string& effect, bool is_on) {
  radiosity::BakeOptions options = quick_options();
  options.effects = {{radiosity::effect_by_name(effect).value(), is_on}};
  return options;
}

std::vector<EffectPlan> planned(const Scene& scene) {
  const auto plan = radiosity::plan_scene(scene, quick_options());
  EXPECT_TRUE(plan.ok()) << plan.error().message;
  return plan.ok() ? plan.value().plan.effects : std::vector<EffectPlan>{};
}

std::vector<std::string> effects_in(const std::vector<EffectPlan>& plan, EffectState state) {
  std::vector<std::string> names;
  for (const EffectPlan& effect : plan) {
    if (effect.state == state) names.emplace_back(effect_name(effect.effect));
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::string> sorted(std::vector<std::string> names) {
  std::sort(names.begin(), names.end());
  return names;
}

/// What is compared: a false alarm takes a value 6 standard errors off, 2e-9 if all is noise; a map has about 6,000
/// values, and there are about 60 comparisons: 7e-4 for the whole test.
constexpr double kNothingBut = 6;
/// What the largest of 6,000 differences of noise reaches once in 600 maps.
constexpr double kSurely = 5;

class Effects : public testing::TestWithParam<EffectRoom> {};

TEST_P(Effects, AreOnExactlyWhereTheyAreThere) {
  const std::vector<EffectPlan> plan = planned(GetParam().scene);
  ASSERT_EQ(plan.size(), static_cast<std::size_t>(radiosity::kNumEffects));
  EXPECT_EQ(effects_in(plan, EffectState::kOn), sorted(GetParam().on));
  EXPECT_EQ(effects_in(plan, EffectState::kOff), sorted(GetParam().off));
  for (const EffectPlan& effect : plan) EXPECT_FALSE(effect.reason.empty()) << effect_name(effect.effect);
}

TEST_P(Effects, ChangeNothingWhereThePlanTurnedThemOff) {
  const Scene& scene = GetParam().scene;
  const SeedMaps as_planned = maps_of_seeds(scene, quick_options());
  for (const std::string& effect : effects_in(planned(scene), EffectState::kOff)) {
    SCOPED_TRACE(effect);
    const SeedMaps with = maps_of_seeds(scene, forced(effect, true));
    EXPECT_EQ(with.values, as_planned.values);
    EXPECT_LT(largest_difference(as_planned, with), kNothingBut);
  }
}

TEST_P(Effects, ChangeTheMapWhereThePlanTurnedThemOn) {
  const Scene& scene = GetParam().scene;
  const SeedMaps as_planned = maps_of_seeds(scene, quick_options());
  const std::vector<std::string> on = effects_in(planned(scene), EffectState::kOn);
  for (const std::string& effect : on) {
    SCOPED_TRACE(effect);
    const SeedMaps without = maps_of_seeds(scene, forced(effect, false));
    const double d = largest_difference(as_planned, without);
    std::printf("on %s %s %g\n", GetParam().name.c_str(), effect.c_str(), d);
    EXPECT_GT(d, kSurely);
  }
}

std::string name_of(const testing::TestParamInfo<EffectRoom>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(Rooms, Effects, testing::ValuesIn(rooms_with_effects()), name_of);
INSTANTIATE_TEST_SUITE_P(RoomsWithout, Effects, testing::ValuesIn(rooms_without_effects()), name_of);

}  // namespace
}  // namespace radbake::tests
