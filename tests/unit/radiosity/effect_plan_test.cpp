#include "server/radiosity/plan/effect_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <memory>

#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

using ::testing::ElementsAreArray;
using ::testing::HasSubstr;

constexpr Vec3 kLow{0, 0, 0}, kHigh{4, 3, 5};

/// A closed grey room with a point light inside.
Scene lit_room() {
  tests::RoomBuilder builder(5);
  builder.add_box("room", kLow, kHigh, builder.add_material("grey", {0.5, 0.5, 0.5}), true);
  Scene scene = builder.scene();
  for (Mesh& mesh : scene.meshes) mesh.texcoord0 = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  scene.lights.push_back({"lamp", PointLight{{2, 1.5, 2.5}, {100, 100, 100}}});
  return scene;
}

/// The same without its ceiling.
Scene open_room() {
  Scene scene = lit_room();
  scene.meshes.erase(scene.meshes.begin() + 1);
  return scene;
}

/// The closed room with a block that stands free, so that surfaces hide each other.
Scene furnished_room() {
  tests::RoomBuilder builder(5);
  const int grey = builder.add_material("grey", {0.5, 0.5, 0.5});
  builder.add_box("room", kLow, kHigh, grey, true);
  builder.add_box("block", {1, 0.5, 2}, {2, 1.5, 3.5}, grey, false);
  Scene scene = lit_room();
  scene.meshes = builder.scene().meshes;
  for (Mesh& mesh : scene.meshes) mesh.texcoord0 = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  return scene;
}

/// A block alone, seen from outside.
Scene lit_block() {
  tests::RoomBuilder builder(5);
  builder.add_box("block", kLow, kHigh, builder.add_material("grey", {0.5, 0.5, 0.5}), false);
  Scene scene = builder.scene();
  scene.lights.push_back({"lamp", PointLight{{9, 9, 9}, {100, 100, 100}}});
  return scene;
}

TexturePlane pair_of_texels(std::array<float, 4> left, std::array<float, 4> right) {
  TexturePlane texture{"pair", 2, 1, 4, Wrap::kClamp, Wrap::kClamp, {left.begin(), left.end()}};
  texture.values.insert(texture.values.end(), right.begin(), right.end());
  return texture;
}
constexpr std::array<float, 4> kBlack = {0, 0, 0, 1}, kGrey = {0.5f, 0.5f, 0.5f, 1}, kHole = {0.5f, 0.5f, 0.5f, 0.25f};

DirectionalLight straight_down(double angular_diameter) { return {{0, -1, 0}, {10, 10, 10}, angular_diameter}; }
TexturePlane environment(float luminance) {
  return {"noon", 2, 1, 3, Wrap::kRepeat, Wrap::kClamp, std::vector<float>(6, luminance)};
}

Result<std::vector<EffectPlan>> planned(const Scene& scene, const AskedOutputs& asked = {},
                                        const EffectOverrides& overrides = {}) {
  const SurveyedScene surveyed = survey_scene(scene).value();
  return plan_effects(surveyed.survey, asked, overrides);
}

std::vector<std::string> names_in(const std::vector<EffectPlan>& plan, EffectState state) {
  std::vector<std::string> names;
  for (const EffectPlan& effect : plan) {
    if (effect.state == state) names.emplace_back(effect_name(effect.effect));
  }
  return names;
}

const EffectPlan& of(const std::vector<EffectPlan>& plan, Effect effect) {
  return plan.at(static_cast<std::size_t>(effect));
}

struct Calls {
  const char* name;
  std::function<Scene(AskedOutputs&)> make;
  std::vector<std::string> on;
  std::vector<std::string> off;
};
void PrintTo(const Calls& calls, std::ostream* out) { *out << calls.name; }

class WhatASceneCallsFor : public testing::TestWithParam<Calls> {};

TEST_P(WhatASceneCallsFor, IsOnAndNothingElse) {
  AskedOutputs asked;
  const Scene scene = GetParam().make(asked);
  const auto plan = planned(scene, asked);
  ASSERT_TRUE(plan.ok()) << plan.error().message;
  ASSERT_EQ(plan->size(), static_cast<std::size_t>(kNumEffects));
  for (int e = 0; e < kNumEffects; ++e) {
    EXPECT_EQ((*plan)[static_cast<std::size_t>(e)].effect, static_cast<Effect>(e));
    EXPECT_FALSE((*plan)[static_cast<std::size_t>(e)].reason.empty());
    EXPECT_FALSE((*plan)[static_cast<std::size_t>(e)].is_forced);
  }
  EXPECT_THAT(names_in(*plan, EffectState::kOn), ElementsAreArray(GetParam().on));
  EXPECT_THAT(names_in(*plan, EffectState::kOff), ElementsAreArray(GetParam().off));
}

/// A scene and one change to it.
std::function<Scene(AskedOutputs&)> with(Scene (*make)(), const std::function<void(Scene&)>& change) {
  return [=](AskedOutputs&) {
    Scene scene = make();
    change(scene);
    return scene;
  };
}
std::function<Scene(AskedOutputs&)> asking(const std::function<void(AskedOutputs&)>& ask) {
  return [=](AskedOutputs& asked) {
    ask(asked);
    return lit_room();
  };
}
void use_texture(Scene& scene, const TexturePlane& texture, std::optional<TextureReference> Material::*use) {
  scene.textures.push_back(texture);
  scene.materials[0].*use = TextureReference{static_cast<int>(scene.textures.size()) - 1, 0};
}
void nothing(Scene&) {}

INSTANTIATE_TEST_SUITE_P(
    Effects, WhatASceneCallsFor,
    testing::Values(
        Calls{"Point", with(lit_room, nothing), {"point", "interreflection"}, {"occlusion", "color"}},
        Calls{"PointOfNoIntensity",
              with(lit_room,
                   [](Scene& s) {
                     s.lights[0].kind = PointLight{{2, 1, 2}, {}};
                   }),
              {"interreflection"},
              {"point", "occlusion", "color"}},
        Calls{"PointOutsideOfAClosedRoom",
              with(lit_room,
                   [](Scene& s) {
                     s.lights[0].kind = PointLight{{2, 9, 2}, {1, 1, 1}};
                   }),
              {"interreflection"},
              {"point", "occlusion", "color"}},
        Calls{"PointOutsideOfAnOpenRoom",
              with(open_room,
                   [](Scene& s) {
                     s.lights[0].kind = PointLight{{2, 9, 2}, {1, 1, 1}};
                   }),
              {"point", "interreflection"},
              {"occlusion", "color"}},
        Calls{"PointBehindAWallOfAnOpenRoom",
              with(open_room,
                   [](Scene& s) {
                     s.lights[0].kind = PointLight{{9, 9, 2}, {1, 1, 1}};
                   }),
              {"point", "occlusion", "interreflection"},
              {"color"}},
        Calls{"PointBehindAllSurfaces",
              with(lit_block,
                   [](Scene& s) {
                     s.lights[0].kind = PointLight{{2, 1, 2}, {1, 1, 1}};
                   }),
              {},
              {"point", "occlusion", "interreflection", "color"}},
        Calls{"Spot",
              with(lit_room,
                   [](Scene& s) {
                     s.lights[0].kind = SpotLight{{2, 1.5, 2.5}, {0, -1, 0}, {9, 9, 9}, 0.1, 0.5};
                   }),
              {"spot", "interreflection"},
              {"occlusion", "color"}},
        Calls{"DirectionalAlongTheWalls",
              with(open_room, [](Scene& s) { s.lights[0].kind = straight_down(0); }),
              {"directional", "interreflection"},
              {"occlusion", "color"}},
        Calls{"DirectionalAcrossTheWalls",
              with(open_room,
                   [](Scene& s) {
                     s.lights[0].kind = DirectionalLight{{0.6, -0.8, 0}, {1, 1, 1}, 0};
                   }),
              {"directional", "occlusion", "interreflection"},
              {"color"}},
        Calls{"DirectionalOnAClosedRoom",
              with(lit_room, [](Scene& s) { s.lights[0].kind = straight_down(0); }),
              {"interreflection"},
              {"directional", "occlusion", "color"}},
        Calls{"SunOfAWidth",
              with(open_room, [](Scene& s) { s.lights[0].kind = straight_down(0.01); }),
              {"sun", "occlusion", "interreflection"},
              {"color"}},
        Calls{"Sky",
              with(open_room,
                   [](Scene& s) {
                     s.sky = {5, 5, 5};
                   }),
              {"point", "sky", "interreflection"},
              {"occlusion", "color"}},
        Calls{"SkyOverAClosedRoom",
              with(lit_room,
                   [](Scene& s) {
                     s.sky = {5, 5, 5};
                   }),
              {"point", "interreflection"},
              {"sky", "occlusion", "color"}},
        Calls{"Hdri",
              with(open_room, [](Scene& s) { s.environment = environment(1); }),
              {"point", "hdri", "occlusion", "interreflection"},
              {"color"}},
        Calls{"HdriThatIsBlack",
              with(open_room, [](Scene& s) { s.environment = environment(0); }),
              {"point", "interreflection"},
              {"hdri", "occlusion", "color"}},
        Calls{"Occlusion", with(furnished_room, nothing), {"point", "occlusion", "interreflection"}, {"color"}},
        Calls{"NothingBeforeABlock",
              with(lit_block, [](Scene& s) { s.environment = environment(1); }),
              {"point", "hdri"},
              {"occlusion", "interreflection", "color"}},
        Calls{"NoReflection",
              with(furnished_room, [](Scene& s) { s.materials[0].reflectance = {}; }),
              {"point", "occlusion"},
              {"interreflection", "color"}},
        Calls{"ColorOfAMaterial",
              with(lit_room, [](Scene& s) { s.materials[0].reflectance.x = 0.4; }),
              {"point", "interreflection", "color"},
              {"occlusion"}},
        Calls{"ColorOfALight",
              with(lit_room, [](Scene& s) { std::get<PointLight>(s.lights[0].kind).intensity.z = 99; }),
              {"point", "interreflection", "color"},
              {"occlusion"}},
        Calls{"ColorOfATexture",
              with(lit_room,
                   [](Scene& s) {
                     use_texture(s, pair_of_texels({0.5f, 0.5f, 0.25f, 1}, {0.5f, 0.5f, 0.25f, 1}),
                                 &Material::reflectance_texture);
                   }),
              {"point", "interreflection", "color"},
              {"occlusion", "textured_reflectance"}},
        Calls{"TexturedReflectance",
              with(lit_room,
                   [](Scene& s) { use_texture(s, pair_of_texels(kBlack, kGrey), &Material::reflectance_texture); }),
              {"point", "interreflection", "textured_reflectance"},
              {"occlusion", "color"}},
        Calls{"TexturedReflectanceThatIsFlat",
              with(lit_room,
                   [](Scene& s) { use_texture(s, pair_of_texels(kGrey, kGrey), &Material::reflectance_texture); }),
              {"point", "interreflection"},
              {"occlusion", "color", "textured_reflectance"}},
        Calls{"VertexColours",
              with(lit_room,
                   [](Scene& s) {
                     s.meshes[0].colors = {{1, 1, 1}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
                   }),
              {"point", "interreflection", "textured_reflectance"},
              {"occlusion", "color"}},
        Calls{"Emitters",
              with(lit_room,
                   [](Scene& s) {
                     s.materials[0].emissive = {1, 1, 1};
                   }),
              {"emitters", "point", "interreflection"},
              {"occlusion", "color"}},
        Calls{"EmittersThatAreBlack",
              with(lit_room,
                   [](Scene& s) {
                     s.materials[0].emissive = {1, 1, 1};
                     use_texture(s, pair_of_texels(kBlack, kBlack), &Material::emissive_texture);
                   }),
              {"point", "interreflection"},
              {"emitters", "occlusion", "color", "textured_emission"}},
        Calls{"TexturedEmission",
              with(lit_room,
                   [](Scene& s) {
                     s.materials[0].emissive = {1, 1, 1};
                     use_texture(s, pair_of_texels(kBlack, kGrey), &Material::emissive_texture);
                   }),
              {"emitters", "point", "interreflection", "textured_emission"},
              {"occlusion", "color"}},
        Calls{"AlphaMask",
              with(lit_room,
                   [](Scene& s) {
                     s.materials[0].alpha_mode = AlphaMode::kMask;
                     use_texture(s, pair_of_texels(kGrey, kHole), &Material::reflectance_texture);
                   }),
              {"point", "interreflection", "alpha_mask"},
              {"occlusion", "color", "textured_reflectance"}},
        Calls{"AlphaMaskThatIsOpaque",
              with(lit_room,
                   [](Scene& s) {
                     s.materials[0].alpha_mode = AlphaMode::kMask;
                     s.materials[0].alpha_cutoff = 0.25;
                     use_texture(s, pair_of_texels(kGrey, kHole), &Material::reflectance_texture);
                   }),
              {"point", "interreflection"},
              {"occlusion", "color", "textured_reflectance", "alpha_mask"}},
        Calls{"AlphaBlendThatIsOpaque",
              with(lit_room, [](Scene& s) { s.materials[0].alpha_mode = AlphaMode::kBlend; }),
              {"point", "interreflection"},
              {"occlusion", "color", "alpha_mask"}},
        Calls{"AlphaBlend",
              with(lit_room,
                   [](Scene& s) {
                     s.materials[0].alpha_mode = AlphaMode::kBlend;
                     s.materials[0].alpha = 0.75;
                   }),
              {"point", "interreflection", "alpha_mask"},
              {"occlusion", "color"}},
        Calls{"SkyThroughATintedRoom",
              with(lit_room,
                   [](Scene& s) {
                     s.sky = {1, 1, 1};
                     s.materials[0].transmittance = {0.25, 0.25, 0.25};
                   }),
              {"point", "sky", "interreflection", "tint"},
              {"occlusion", "color"}},
        Calls{"DiffuseTransmission",
              with(lit_room,
                   [](Scene& s) {
                     s.materials[0].is_double_sided = true;
                     s.materials[0].diffuse_transmittance = {0.25, 0.25, 0.25};
                   }),
              {"point", "occlusion", "interreflection", "diffuse_transmission", "two_sided"},
              {"color"}},
        Calls{"Luminaire",
              with(lit_room,
                   [](Scene& s) {
                     ProfileLight light;
                     light.position = std::get<PointLight>(s.lights[0].kind).position;
                     light.direction = {0, -1, 0};
                     light.zero_side = {1, 0, 0};
                     light.profile = std::make_shared<const LightProfile>(LightProfile{{0, 90}, {0}, {10, 10}});
                     s.lights[0].kind = light;
                   }),
              {"ies", "interreflection"},
              {"occlusion", "color"}},
        Calls{"TwoSided",
              with(furnished_room, [](Scene& s) { s.materials[0].is_double_sided = true; }),
              {"point", "occlusion", "interreflection", "two_sided"},
              {"color"}},
        Calls{"TwoSidedInAConvexRoom",
              with(lit_room, [](Scene& s) { s.materials[0].is_double_sided = true; }),
              {"point", "interreflection"},
              {"occlusion", "color", "two_sided"}},
        Calls{"Vertices",
              asking([](AskedOutputs& a) { a.vertices = true; }),
              {"point", "interreflection", "vertices"},
              {"occlusion", "color"}},
        Calls{"Layers",
              asking([](AskedOutputs& a) { a.layers = true; }),
              {"point", "interreflection", "layers"},
              {"occlusion", "color"}},
        Calls{"AmbientOcclusion",
              asking([](AskedOutputs& a) { a.ambient_occlusion = true; }),
              {"point", "interreflection", "ambient_occlusion"},
              {"occlusion", "color"}}),
    [](const auto& info) { return std::string(info.param.name); });

/// All effects in one scene.
Scene room_of_everything() {
  Scene scene = furnished_room();
  scene.meshes.erase(scene.meshes.begin() + 1);  // no ceiling
  scene.materials.resize(2, scene.materials[0]);
  scene.meshes[0].material = 1;
  scene.materials[0].reflectance = {0.5, 0.4, 0.3};
  scene.materials[0].is_double_sided = true;
  scene.materials[0].diffuse_transmittance = {0.1, 0.2, 0.3};
  scene.materials[0].alpha_mode = AlphaMode::kMask;
  use_texture(scene, pair_of_texels(kGrey, kHole), &Material::reflectance_texture);
  scene.materials[1].emissive = {1, 1, 1};
  scene.materials[1].transmittance = {0.25, 0.25, 0.25};
  scene.textures.push_back(pair_of_texels(kBlack, kGrey));
  scene.materials[1].emissive_texture = scene.materials[1].reflectance_texture = TextureReference{1, 0};
  scene.lights.push_back({"spot", SpotLight{{2, 1.5, 2.5}, {0, -1, 0}, {9, 9, 9}, 0.1, 0.5}});
  const auto profile = std::make_shared<const LightProfile>(LightProfile{{0, 90}, {0}, {9, 9}});
  const ProfileLight luminaire{
      .position = {2, 1.5, 2.5}, .direction = {0, -1, 0}, .zero_side = {1, 0, 0}, .profile = profile};
  scene.lights.push_back({"luminaire", luminaire});
  scene.lights.push_back({"parallel", straight_down(0)});
  scene.lights.push_back({"sun", straight_down(0.01)});
  scene.sky = {1, 1, 1};
  return scene;
}

TEST(EffectPlan, TurnsEverythingOnThatASceneHas) {
  Scene scene = room_of_everything();
  const auto plan = planned(scene, {true, true, true, true}).value();
  EXPECT_THAT(names_in(plan, EffectState::kAbsent),
              ElementsAreArray({"hdri", "specular", "refraction", "normal_map", "volume"}));
  EXPECT_EQ(names_in(plan, EffectState::kOn).size(), 19u);
  scene.environment = environment(1);
  scene.sky = {};
  EXPECT_THAT(names_in(planned(scene).value(), EffectState::kAbsent),
              ElementsAreArray({"sky", "vertices", "layers", "ambient_occlusion", "specular", "refraction",
                                "normal_map", "volume"}));
}

TEST(EffectPlan, SaysWhatItDoesNotSimulateWithItsShareOfTheArea) {
  Scene scene = lit_room();
  scene.materials.push_back(scene.materials[0]);
  scene.materials[1].is_specular = scene.materials[1].is_refractive = true;
  scene.materials[1].has_normal_map = scene.materials[1].has_volume = true;
  scene.meshes[0].material = 1;  // the floor: 20 of 94 m2
  const auto plan = planned(scene).value();
  EXPECT_THAT(names_in(plan, EffectState::kUnsupported),
              ElementsAreArray({"specular", "refraction", "normal_map", "volume"}));
  EXPECT_DOUBLE_EQ(of(plan, Effect::kSpecular).value, 20.0 / 94);
  EXPECT_THAT(of(plan, Effect::kSpecular).reason, HasSubstr("21.3 % of the area (20 m2)"));
}

TEST(EffectPlan, GivesTheNumberBehindAReason) {
  const auto room = planned(lit_room()).value();
  EXPECT_EQ(of(room, Effect::kOcclusion).reason, "convex: 12 triangles see all of each other and of the lights");
  EXPECT_EQ(of(room, Effect::kOcclusion).value, 12);
  EXPECT_EQ(of(room, Effect::kColor).reason, "grey: one channel is solved");
  EXPECT_EQ(of(room, Effect::kPoint).reason, "1 point light");
  EXPECT_EQ(of(room, Effect::kInterreflection).value, 0.5);
  Scene scene = open_room();
  scene.lights[0].kind = straight_down(0.01);
  EXPECT_EQ(of(planned(scene).value(), Effect::kSun).reason, "a disc of 0.573 degrees: soft shadows");
}

TEST(EffectPlan, ObeysOverridesAndSaysSo) {
  const auto plan = planned(furnished_room(), {true, true, false, false},
                            {{Effect::kOcclusion, false}, {Effect::kColor, true}, {Effect::kVertices, false}})
                        .value();
  EXPECT_EQ(of(plan, Effect::kOcclusion).state, EffectState::kOff);
  EXPECT_TRUE(of(plan, Effect::kOcclusion).is_forced);
  EXPECT_EQ(of(plan, Effect::kOcclusion).reason, "forced off, despite: 24 triangles may hide light from each other");
  EXPECT_EQ(of(plan, Effect::kColor).state, EffectState::kOn);
  EXPECT_EQ(of(plan, Effect::kColor).reason, "forced on, without need: grey: one channel is solved");
  EXPECT_EQ(of(plan, Effect::kVertices).state, EffectState::kOff);
  EXPECT_FALSE(of(plan, Effect::kPoint).is_forced);
  const EffectSet on = effects_on(plan);
  EXPECT_TRUE(on.has(Effect::kColor));
  EXPECT_FALSE(on.has(Effect::kOcclusion));
  EXPECT_FALSE(on.has(Effect::kSpecular));
}

// A sheet that is forced opaque closes the room: the sky is then off by itself.
TEST(EffectPlan, FollowsFromAnOverrideWhatItDoesToOtherEffects) {
  Scene scene = lit_room();
  scene.sky = {1, 1, 1};
  scene.materials[0].transmittance = {0.25, 0.25, 0.25};
  EXPECT_EQ(of(planned(scene).value(), Effect::kSky).state, EffectState::kOn);
  const auto plan = planned(scene, {}, {{Effect::kTint, false}}).value();
  EXPECT_EQ(of(plan, Effect::kSky).state, EffectState::kOff);
  EXPECT_FALSE(of(plan, Effect::kSky).is_forced);

  // Without interreflection nothing asks for the textures of reflectance.
  use_texture(scene, pair_of_texels(kBlack, kGrey), &Material::reflectance_texture);
  scene.materials[0].transmittance = {};
  EXPECT_EQ(of(planned(scene).value(), Effect::kTexturedReflectance).state, EffectState::kOn);
  const auto dark = planned(scene, {}, {{Effect::kInterreflection, false}}).value();
  EXPECT_EQ(of(dark, Effect::kTexturedReflectance).state, EffectState::kOff);
}

// What goes through scattered needs backs, and mixes two textured colours even where nothing is reflected.
TEST(EffectPlan, TurnsDiffuseTransmissionOffWithBacks) {
  Scene scene = lit_room();
  scene.materials[0].is_double_sided = true;
  scene.materials[0].diffuse_transmittance = {0.25, 0.25, 0.25};
  use_texture(scene, pair_of_texels(kBlack, kGrey), &Material::diffuse_transmittance_texture);
  const auto single = planned(scene, {}, {{Effect::kTwoSided, false}}).value();
  EXPECT_EQ(of(single, Effect::kDiffuseTransmission).state, EffectState::kOff);
  EXPECT_FALSE(planned(scene, {}, {{Effect::kTwoSided, false}, {Effect::kDiffuseTransmission, true}}).ok());
  const auto dark = planned(scene, {}, {{Effect::kInterreflection, false}}).value();
  EXPECT_EQ(of(dark, Effect::kTexturedReflectance).state, EffectState::kOn);
  // Black in fact.
  scene.textures = {pair_of_texels(kBlack, kBlack)};
  EXPECT_EQ(of(planned(scene).value(), Effect::kDiffuseTransmission).state, EffectState::kAbsent);
}

TEST(EffectPlan, RefusesOverridesThatContradictTheScene) {
  const auto message = [](const Scene& scene, const AskedOutputs& asked, const EffectOverrides& overrides) {
    const auto plan = planned(scene, asked, overrides);
    if (plan.ok()) return std::string("accepted");
    EXPECT_EQ(plan.error().code, ErrorCode::kInvalidArgument);
    return plan.error().message;
  };
  EXPECT_EQ(message(lit_room(), {}, {{Effect::kSun, true}}),
            "effect 'sun' cannot be forced on: the scene has no light with an angular diameter");
  EXPECT_EQ(message(lit_room(), {}, {{Effect::kTint, true}}),
            "effect 'tint' cannot be forced on: no material lets light straight through");
  EXPECT_EQ(message(lit_room(), {}, {{Effect::kSpecular, true}}),
            "effect 'specular' cannot be forced on: it is not simulated");
  EXPECT_EQ(message(lit_room(), {}, {{Effect::kPoint, false}}),
            "effect 'point' cannot be forced off: no light is left in the scene");
  EXPECT_EQ(message(lit_room(), {false, true, false, false}, {{Effect::kVertices, false}}),
            "effect 'vertices' cannot be forced off: nothing else is put out");
  EXPECT_EQ(message(lit_room(), {}, {{Effect::kVertices, true}}),
            "effect 'vertices' cannot be forced on: light by vertex is not asked for");
  // Off what is not there changes nothing.
  EXPECT_EQ(message(lit_room(), {}, {{Effect::kSun, false}, {Effect::kSpecular, false}}), "accepted");
}

TEST(EffectPlan, IsAFunctionOfItsInput) {
  const Scene scene = room_of_everything();
  const EffectOverrides overrides = {{Effect::kSun, false}, {Effect::kTint, true}};
  const auto first = planned(scene, {true, true, true, true}, overrides).value();
  const auto second = planned(scene, {true, true, true, true}, overrides).value();
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t e = 0; e < first.size(); ++e) {
    EXPECT_EQ(first[e].state, second[e].state);
    EXPECT_EQ(first[e].reason, second[e].reason);
    EXPECT_EQ(first[e].value, second[e].value);
    EXPECT_EQ(first[e].is_forced, second[e].is_forced);
  }
}

}  // namespace
}  // namespace radbake::radiosity
