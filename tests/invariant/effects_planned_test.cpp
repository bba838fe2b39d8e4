// A plan turns on exactly the effects that are there.
#include <gtest/gtest.h>

#include <algorithm>

#include "server/radiosity/bake/bake.h"
#include "tests/scenes/effect_rooms.h"

namespace radbake::tests {
namespace {

using radiosity::EffectPlan;
using radiosity::EffectState;

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

class PlannedEffects : public testing::TestWithParam<EffectRoom> {};

TEST_P(PlannedEffects, AreOnExactlyWhereTheyAreThere) {
  const auto planned = radiosity::plan_scene(GetParam().scene, {});
  ASSERT_TRUE(planned.ok()) << planned.error().message;
  const radiosity::BakePlan& plan = planned.value().plan;
  ASSERT_EQ(plan.effects.size(), static_cast<std::size_t>(radiosity::kNumEffects));
  EXPECT_EQ(effects_in(plan.effects, EffectState::kOn), sorted(GetParam().on));
  EXPECT_EQ(effects_in(plan.effects, EffectState::kOff), sorted(GetParam().off));
  EXPECT_TRUE(effects_in(plan.effects, EffectState::kUnsupported).empty());
  for (const EffectPlan& effect : plan.effects) EXPECT_FALSE(effect.reason.empty()) << effect_name(effect.effect);
  const bool is_grey = std::count(GetParam().off.begin(), GetParam().off.end(), "color") > 0;
  EXPECT_EQ(plan.num_channels, is_grey ? 1 : 3);
}

TEST(PlannedEffects, HaveARoomEach) {
  std::vector<std::string> names;
  for (const EffectRoom& room : rooms_with_effects()) {
    if (room.name.starts_with("all")) continue;
    names.push_back(room.name);
    EXPECT_EQ(std::count(room.on.begin(), room.on.end(), room.name), 1) << room.name;
  }
  // In the order of Effect, where outputs and what is not simulated come last.
  std::vector<std::string> expected(radiosity::kEffectNames.begin(),
                                    radiosity::kEffectNames.begin() + static_cast<int>(radiosity::Effect::kVertices));
  EXPECT_EQ(names, expected);
}

std::string name_of(const testing::TestParamInfo<EffectRoom>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(Rooms, PlannedEffects, testing::ValuesIn(rooms_with_effects()), name_of);
INSTANTIATE_TEST_SUITE_P(RoomsWithout, PlannedEffects, testing::ValuesIn(rooms_without_effects()), name_of);
INSTANTIATE_TEST_SUITE_P(Empty, PlannedEffects, testing::Values(empty_room()), name_of);

}  // namespace
}  // namespace radbake::tests
