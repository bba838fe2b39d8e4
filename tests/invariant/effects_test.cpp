// What a plan turned off changes nothing where it is forced on; what it turned on changes the map where it is forced
// off. That plans turn on what is there: effects_planned_test.cpp.
#include <gtest/gtest.h>

#include "tests/invariant/bake_support.h"
#include "tests/invariant/seed_maps.h"
#include "tests/invariant/seed_statistics.h"
#include "tests/scenes/effect_rooms.h"

namespace radbake::tests {
namespace {

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

/// In standard errors of a texel from 8 seeds. Of a map's 3,000 values the largest reaches 5 by noise alone once in 500
/// comparisons; the least that an effect of these rooms changes is 7 (`two_sided`), most change more than 30.
constexpr double kMoreThanNoise = 5;

class Effects : public testing::TestWithParam<EffectRoom> {};

TEST_P(Effects, ChangeNoBitWhereThePlanTurnedThemOff) {
  // No light that may be found by chance is at stake, so that nothing is left to the sampling error.
  const Scene& scene = GetParam().scene;
  const SeedMaps as_planned = maps_of_seeds(scene, quick_options(), 2);
  for (const std::string& effect : GetParam().off) {
    const SeedMaps with = maps_of_seeds(scene, forced(effect, true), 2);
    EXPECT_TRUE(with.values == as_planned.values)
        << effect << ": differs by up to " << largest_change(with, as_planned);
  }
}

TEST_P(Effects, ChangeTheMapWhereThePlanTurnedThemOn) {
  const Scene& scene = GetParam().scene;
  const SeedMaps as_planned = maps_of_seeds(scene, quick_options(), kSeeds);
  for (const std::string& effect : GetParam().on) {
    const auto without = radiosity::plan_scene(scene, forced(effect, false));
    if (!without.ok()) {
      // It is the only light.
      EXPECT_NE(without.error().message.find("no light is left"), std::string::npos) << without.error().message;
      continue;
    }
    const double change = largest_difference(as_planned, maps_of_seeds(scene, forced(effect, false), kSeeds));
    EXPECT_GT(change, kMoreThanNoise) << effect;
    RecordProperty(effect, std::to_string(change));
  }
}

std::string name_of(const testing::TestParamInfo<EffectRoom>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(Rooms, Effects, testing::ValuesIn(rooms_with_effects()), name_of);
INSTANTIATE_TEST_SUITE_P(RoomsWithout, Effects, testing::ValuesIn(rooms_without_effects()), name_of);

}  // namespace
}  // namespace radbake::tests
