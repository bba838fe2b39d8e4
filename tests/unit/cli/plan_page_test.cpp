#include "client/cli/plan_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

namespace radbake::cli {
namespace {

using Json = nlohmann::ordered_json;
using ::testing::HasSubstr;
using ::testing::Not;

void add_effect(v1::Plan& plan, const char* name, const char* state, const char* reason, double value,
                double seconds = 0) {
  v1::EffectPlan& effect = *plan.add_effects();
  effect.set_effect(name);
  effect.set_state(state);
  effect.set_reason(reason);
  effect.set_value(value);
  if (seconds <= 0) return;
  v1::EffectSeconds& cost = *plan.mutable_prediction()->add_effects();
  cost.set_effect(name);
  cost.set_cpu_seconds(seconds);
}

v1::Plan room_plan() {
  v1::Plan plan;
  v1::Survey& survey = *plan.mutable_survey();
  survey.set_num_triangles(204800);
  survey.set_num_meshes(1);
  survey.set_num_materials(3);
  survey.set_num_textures(2);
  survey.set_num_textures_flat(1);
  survey.set_num_instances(12);
  survey.set_area_m2(123.456);
  survey.set_num_probe_rays(16384);
  survey.set_escape_share(0.125);
  survey.set_escape_share_interval(0.005);
  survey.set_min_reflectance(0.05);
  survey.set_max_reflectance(0.8);
  survey.set_emitted_lumens(1500);
  survey.add_brightest_emitters("lamp/bulb#0");
  add_effect(plan, "emitters", "on", "2 triangles emit 1500 lm", 2);
  add_effect(plan, "sun", "absent", "no sun", 0);
  add_effect(plan, "color", "off", "grey: one channel is solved", 1, 2.5);
  add_effect(plan, "interreflection", "on", "reflectance up to 0.8", 0.8, 12);
  add_effect(plan, "hdri", "absent", "no sky image", 0);
  add_effect(plan, "specular", "unsupported", "10 % of the area shines", 0.1);
  plan.set_estimator("hemisphere");
  plan.set_estimator_reason("many patches");
  plan.set_num_channels(1);
  plan.set_rays_per_texel(256);
  plan.set_num_patches(4321);
  plan.set_atlas_size(512);
  plan.set_atlas_height(256);
  plan.set_num_lightmaps(2);
  plan.set_num_texels(100000);
  v1::StagePrediction& stage = *plan.mutable_prediction()->add_stages();
  stage.set_stage("form_factors");
  stage.set_cpu_seconds(3.44);
  stage.set_cpu_seconds_low(2);
  stage.set_cpu_seconds_high(5);
  stage.set_wall_seconds(1.7);
  stage.set_memory_bytes(200 << 20);
  plan.mutable_prediction()->mutable_total()->set_cpu_seconds(20);
  plan.mutable_prediction()->set_source("pilot");
  plan.mutable_prediction()->set_pilot_seconds(0.25);
  v1::MeshPrediction& mesh = *plan.mutable_prediction()->add_costliest();
  mesh.set_mesh("floor/tiles#0");
  mesh.set_cpu_seconds(6);
  mesh.set_num_texels(60000);
  mesh.set_num_patches(1);
  v1::Warning& warning = *plan.add_warnings();
  warning.set_id("coarse");
  warning.set_text("texels are coarse");
  return plan;
}

std::vector<std::string> lines_with(const std::string& page, const std::string& word) {
  std::vector<std::string> lines;
  std::istringstream text(page);
  for (std::string line; std::getline(text, line);) {
    if (line.find(word) != std::string::npos) lines.push_back(line);
  }
  return lines;
}

TEST(PlanPage, SaysWhatTheSceneIs) {
  const std::string page = plan_page(room_plan(), "room.glb", {});
  EXPECT_THAT(page,
              testing::StartsWith("room.glb: 204,800 triangles in 1 mesh, 3 materials, 2 textures (1 of one value "
                                  "in fact), 12 instances\n"));
  EXPECT_THAT(page, HasSubstr("123 m2 of surface"));
  EXPECT_THAT(page, HasSubstr("12.5 % +- 0.5 % of rays escape"));
  EXPECT_THAT(page, HasSubstr("reflectance 0.05 to 0.8, coloured"));
  EXPECT_THAT(page, HasSubstr("surfaces emit 1.5e+03 lm, lamps 0 lm; most from lamp/bulb#0"));
  v1::Plan closed = room_plan();
  closed.mutable_survey()->set_is_convex(true);
  closed.mutable_survey()->set_is_closed(true);
  EXPECT_THAT(plan_page(closed, "room.glb", {}), HasSubstr("closed and convex"));
}

TEST(PlanPage, ShowsEveryEffectOnceThoseThatAreOnFirst) {
  const std::string page = plan_page(room_plan(), "room.glb", {});
  EXPECT_THAT(lines_with(page, "emitters  "),
              testing::ElementsAre("  on          emitters              2 triangles emit 1500 lm"));
  EXPECT_THAT(lines_with(page, "reflectance up to"),
              testing::ElementsAre("  on          interreflection       reflectance up to 0.8 [12 s]"));
  EXPECT_THAT(lines_with(page, "grey:"),
              testing::ElementsAre("  off         color                 grey: one channel is solved [saves 2.5 s]"));
  EXPECT_THAT(lines_with(page, "unsupported"),
              testing::ElementsAre("  unsupported specular              10 % of the area shines"));
  EXPECT_THAT(lines_with(page, "absent"), testing::ElementsAre("  absent      sun, hdri"));
  const std::size_t on = page.find("interreflection"), off = page.find("color  "), absent = page.find("absent");
  EXPECT_TRUE(on < off && off < absent);
}

TEST(PlanPage, ShowsMethodsPredictionsAndWarnings) {
  const std::string page = plan_page(room_plan(), "room.glb", {{"limited", "white was limited"}});
  EXPECT_THAT(page, HasSubstr("form factors      hemisphere: many patches\n"));
  EXPECT_THAT(page, HasSubstr("2 of 512 x 256: 100,000 texels"));
  EXPECT_THAT(
      lines_with(page, "200 MB"),
      testing::ElementsAre("  form factors      3.4 s         2.0 s to 5.0 s                1.7 s         200 MB"));
  EXPECT_THAT(page, HasSubstr("from a pilot of 0.25 s"));
  EXPECT_THAT(page, HasSubstr("6.0 s       floor/tiles#0 (60,000 texels, 1 patch)"));
  EXPECT_THAT(page, HasSubstr("\nWarnings\n  white was limited\n  texels are coarse\n"));
  v1::Plan bare = room_plan();
  bare.clear_prediction();
  bare.clear_warnings();
  EXPECT_THAT(plan_page(bare, "room.glb", {}), Not(HasSubstr("Predicted")));
  EXPECT_THAT(plan_page(bare, "room.glb", {}), Not(HasSubstr("Warnings")));
}

TEST(PlanJson, BeginsWithTheEffectsAndTheirSeconds) {
  const Json json = plan_json(room_plan(), {{"limited", "white was limited"}});
  EXPECT_EQ(json.begin().key(), "effects");
  ASSERT_EQ(json["effects"].size(), 6u);
  EXPECT_EQ(json["effects"][2].dump(), R"({"effect":"color","state":"off","reason":"grey: one channel is solved",)"
                                       R"("value":1.0,"seconds":2.5,"is_forced":false})");
  EXPECT_EQ(json["effects"][1]["seconds"], 0);
  EXPECT_EQ(json["num_patches"], 4321);
  EXPECT_EQ(json["survey"]["num_triangles"], 204800);
  EXPECT_EQ(json["prediction"]["stages"][0]["stage"], "form_factors");
  ASSERT_EQ(json["warnings"].size(), 2u);
  EXPECT_EQ(json["warnings"][0]["id"], "limited");
  EXPECT_EQ(json["warnings"][1]["id"], "coarse");
}

}  // namespace
}  // namespace radbake::cli
