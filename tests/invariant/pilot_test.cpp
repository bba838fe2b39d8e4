// The pilot predicts, and changes nothing.

#include "server/radiosity/bake/pilot.h"

#include <gtest/gtest.h>

#include "tests/invariant/bake_support.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

using tests::baked;

/// Costs by which every bake takes no time, so that none has a pilot.
constexpr HostCosts kFree = {1e-15, 1e-15, 1e-15, 0, 0, 1e-15, 1e-15};

BakeOptions small() { return {.atlas_size = 128, .rays = 64, .max_patches = 1024, .threads = 2}; }

TEST(Pilot, LeavesNoTraceInTheResult) {
  const Scene scene = tests::small_emitter_room(0.5);
  BakeOptions options = small();
  const BakeOutcome with = baked(scene, options);
  options.costs = kFree;
  const BakeOutcome without = baked(scene, options);
  EXPECT_EQ(with.report.prediction.source, "pilot");
  EXPECT_GT(with.report.prediction.pilot_seconds, 0);
  EXPECT_EQ(without.report.prediction.source, "stored");
  EXPECT_EQ(without.report.prediction.pilot_seconds, 0);
  ASSERT_EQ(with.layers.size(), without.layers.size());
  EXPECT_EQ(with.layers[0].values, without.layers[0].values);
  EXPECT_EQ(with.report.num_gather_rays, without.report.num_gather_rays);
  EXPECT_EQ(with.report.num_row_rays, without.report.num_row_rays);
}

TEST(Pilot, PredictsStagesMeshesAndEffects) {
  const Scene scene = tests::small_emitter_room(0.5);
  const PlannedBake planned = plan_scene(scene, small()).value();
  const Prediction& prediction = planned.prediction;
  ASSERT_EQ(prediction.stages.size(), 4u);
  for (const StagePrediction& stage : prediction.stages) {
    EXPECT_GT(stage.cpu_seconds, 0) << stage.stage;
    EXPECT_GT(stage.memory_bytes, 0u) << stage.stage;
  }
  EXPECT_GT(prediction.total.cpu_seconds, prediction.stages.back().cpu_seconds);
  // The room's walls are larger than the block and the lamp.
  ASSERT_EQ(prediction.costliest.size(), 3u);
  for (const MeshPrediction& mesh : prediction.costliest) {
    EXPECT_EQ(mesh.mesh.substr(0, 5), "room.");
    EXPECT_GT(mesh.num_texels, 0u);
    EXPECT_GT(mesh.num_patches, 0u);
  }
  const auto seconds_of = [&](Effect effect) {
    for (const EffectSeconds& own : prediction.effects) {
      if (own.effect == effect) return own.cpu_seconds;
    }
    return -1.0;
  };
  EXPECT_GT(seconds_of(Effect::kEmitters), 0);
  EXPECT_GT(seconds_of(Effect::kOcclusion), 0);
  EXPECT_GT(seconds_of(Effect::kInterreflection), 0);
  EXPECT_GT(seconds_of(Effect::kColor), 0);  // what it would cost
  EXPECT_EQ(seconds_of(Effect::kSun), -1);   // there is none
}

TEST(Pilot, WorksForVerticesAloneAndWithoutInterreflection) {
  const Scene scene = tests::small_emitter_room(0.5);
  BakeOptions options = small();
  options.output = Output::kVertices;
  options.effects = {{Effect::kInterreflection, false}};
  const Prediction prediction = plan_scene(scene, options).value().prediction;
  EXPECT_EQ(prediction.source, "pilot");
  EXPECT_EQ(prediction.stages[1].cpu_seconds, 0);
  EXPECT_GT(prediction.stages[3].cpu_seconds, 0);
}

TEST(Bake, MeasuresWhatThingsCostAndHowLongStagesTook) {
  const BakeReport report = baked(tests::small_emitter_room(0.5), small()).report;
  EXPECT_GT(report.costs.row_ray, 0);
  EXPECT_GT(report.costs.texel_ray, 0);
  EXPECT_GT(report.costs.light_ray, 0);
  EXPECT_GT(report.costs.entry_step, 0);
  ASSERT_EQ(report.stages.size(), 4u);
  for (const StageTime& stage : report.stages) EXPECT_GT(stage.cpu_seconds, 0) << stage.stage;
}

TEST(Plan, SaysEveryEffectOnceAndWhyEachMethod) {
  const BakePlan plan = plan_scene(tests::small_emitter_room(0.5), small()).value().plan;
  ASSERT_EQ(plan.effects.size(), static_cast<std::size_t>(kNumEffects));
  EXPECT_EQ(plan.num_channels, 1);
  EXPECT_FALSE(plan.form_factors_reason.empty());
  EXPECT_FALSE(plan.transport_reason.empty());
  EXPECT_FALSE(plan.solver_reason.empty());
  EXPECT_EQ(plan.survey.escape_share, 0);
  EXPECT_GT(plan.survey.num_probe_rays, 0u);
}

TEST(Plan, RefusesOverridesThatContradictTheScene) {
  BakeOptions options = small();
  options.effects = {{Effect::kSun, true}};
  const auto planned = plan_scene(tests::small_emitter_room(0.5), options);
  ASSERT_FALSE(planned.ok());
  EXPECT_EQ(planned.error().code, ErrorCode::kInvalidArgument);
  EXPECT_NE(planned.error().message.find("effect 'sun' cannot be forced on"), std::string::npos);
}

TEST(Plan, WarnsWhereNoLightArrives) {
  Scene scene = tests::furnace_room(0.5);
  scene.meshes.resize(6);  // the closed room alone
  scene.materials[0].emissive = {};
  scene.sky = {1, 1, 1};
  const BakePlan plan = plan_scene(scene, small()).value().plan;
  ASSERT_FALSE(plan.warnings.empty());
  EXPECT_EQ(plan.warnings[0].id, "no_light_arrives");
}

TEST(Plan, LeavesOutOutputsThatAreForcedOff) {
  BakeOptions options = small();
  options.output = Output::kBoth;
  options.wants_direct = options.wants_ao = true;
  options.effects = {{Effect::kVertices, false}, {Effect::kLayers, false}};
  const BakeOutcome outcome = baked(tests::small_emitter_room(0.5), options);
  EXPECT_EQ(outcome.report.plan.num_vertex_groups, 0u);
  ASSERT_EQ(outcome.layers.size(), 3u);
  EXPECT_EQ(outcome.layers[1].name, "lightmap_0_ao");
  EXPECT_EQ(outcome.layers[2].name, "error_0");
}

}  // namespace
}  // namespace radbake::radiosity
