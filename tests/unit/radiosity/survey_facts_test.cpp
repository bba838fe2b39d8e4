#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/radiosity/survey/facts.h"
#include "server/radiosity/survey/probe.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/cube_rooms.h"
#include "tests/scenes/rooms.h"
#include "tests/scenes/solids.h"

namespace radbake::radiosity {
namespace {

using ::testing::ElementsAre;

Survey survey_of(const Scene& scene) { return survey_scene(scene).value().survey; }

Scene box(bool faces_in) {
  tests::RoomBuilder builder(3);
  const int glowing = builder.add_material("glowing", {0.5, 0.5, 0.5}, {1, 1, 1});
  builder.add_box("box", {0, 0, 0}, {1, 1, 1}, glowing, faces_in);
  return builder.scene();
}

Scene lit(Mesh mesh) {
  Scene scene;
  scene.materials.resize(1);
  scene.meshes.push_back(std::move(mesh));
  scene.meshes[0].material = 0;
  scene.sky = {1, 1, 1};
  return scene;
}

TEST(SurveyFacts, TellConvexRoomsFromBlocksAndFromWhatIsNeither) {
  EXPECT_TRUE(survey_of(box(true)).is_convex);
  EXPECT_TRUE(survey_of(box(true)).is_closed);
  EXPECT_FALSE(survey_of(box(true)).is_exposed);
  EXPECT_FALSE(survey_of(box(false)).is_convex);
  EXPECT_TRUE(survey_of(box(false)).is_exposed);
  const Survey furnished = survey_of(tests::furnace_room(0.5));
  EXPECT_FALSE(furnished.is_convex || furnished.is_exposed || furnished.is_closed);

  Scene open = box(true);
  open.meshes.erase(open.meshes.begin());
  EXPECT_TRUE(survey_of(open).is_convex);
  EXPECT_FALSE(survey_of(open).is_closed);

  // In one plane nothing sees anything, from whichever side.
  Scene plane = box(true);
  plane.meshes.resize(1);
  EXPECT_TRUE(survey_of(plane).is_convex && survey_of(plane).is_exposed);
}

TEST(SurveyFacts, FindManyPlanesConvexToo) {
  Mesh sphere = tests::make_sphere(24);
  EXPECT_TRUE(survey_of(lit(sphere)).is_exposed);
  for (auto& triangle : sphere.triangles) std::swap(triangle[1], triangle[2]);
  EXPECT_TRUE(survey_of(lit(sphere)).is_convex);
  // A dent as deep as a hundredth of the radius.
  sphere.positions[sphere.triangles[sphere.triangles.size() / 2][0]] =
      sphere.positions[sphere.triangles[sphere.triangles.size() / 2][0]] * 0.99;
  EXPECT_FALSE(survey_of(lit(sphere)).is_convex);
}

// Walls of triangles whose corners were rounded to single precision, turned to no axis: still one plane each, the small
// lamp in the ceiling included. A thousandth of a step between them is not.
TEST(SurveyFacts, SeePlanesThroughRoundingToSinglePrecision) {
  Scene scene = tests::cube_with_lamp(0.5);
  const double c = std::cos(0.3), s = std::sin(0.3);
  const auto turned = [&](Vec3 p) {
    const Vec3 q{c * p.x - s * p.y, s * p.x + c * p.y, p.z};
    const Vec3 r{q.x, c * q.y - s * q.z, s * q.y + c * q.z};
    return Vec3{static_cast<float>(r.x), static_cast<float>(r.y), static_cast<float>(r.z)};
  };
  for (Mesh& mesh : scene.meshes) {
    for (Vec3& p : mesh.positions) p = turned(p);
  }
  EXPECT_TRUE(survey_of(scene).is_convex);
  for (Mesh& mesh : scene.meshes) {
    if (mesh.name != "lamp") continue;
    for (Vec3& p : mesh.positions) p += turned({0, -0.001, 0});
  }
  EXPECT_FALSE(survey_of(scene).is_convex);
}

TEST(SurveyFacts, ARoomWithACrackIsNotClosed) {
  Scene scene = box(true);
  scene.meshes[0].positions[0].x += 1e-9;
  EXPECT_TRUE(survey_of(scene).is_convex);
  EXPECT_FALSE(survey_of(scene).is_closed);
}

TEST(SurveyFacts, TakeReflectanceWithTexturesAndColours) {
  Scene scene = tests::furnace_room(0.5);
  EXPECT_EQ(survey_of(scene).max_reflectance, 0.5);
  EXPECT_EQ(survey_of(scene).min_reflectance, 0.5);
  for (Mesh& mesh : scene.meshes) mesh.texcoord0.assign(mesh.positions.size(), {0.5, 0.5});
  scene.textures.push_back({"pair", 2, 1, 3, Wrap::kClamp, Wrap::kClamp, {0.25f, 0.5f, 0.25f, 0.5f, 0.75f, 0.5f}});
  scene.materials[0].reflectance_texture = TextureReference{0, 0};
  EXPECT_EQ(survey_of(scene).max_reflectance, 0.375);
  EXPECT_EQ(survey_of(scene).min_reflectance, 0.125);
  for (Mesh& mesh : scene.meshes) mesh.colors.assign(mesh.positions.size(), {0.5, 0.5, 0.5});
  EXPECT_EQ(survey_of(scene).max_reflectance, 0.1875);
  EXPECT_EQ(survey_of(scene).min_reflectance, 0.0625);
  // What no mesh uses does not count.
  scene.materials.push_back(scene.materials[0]);
  scene.materials.back().reflectance = {0.9, 0.9, 0.9};
  EXPECT_EQ(survey_of(scene).max_reflectance, 0.1875);
}

TEST(SurveyFacts, AreGreyOnlyWhereEveryChannelIsTheSame) {
  const Scene grey = tests::furnace_room(0.5);
  EXPECT_TRUE(survey_of(grey).is_grey);
  const auto is_grey = [&grey](const auto& change) {
    Scene scene = grey;
    change(scene);
    return survey_of(scene).is_grey;
  };
  const double kNext = std::nextafter(0.5, 1.0);
  EXPECT_FALSE(is_grey([&](Scene& s) { s.materials[0].reflectance.y = kNext; }));
  EXPECT_FALSE(is_grey([&](Scene& s) { s.materials[0].emissive.y = 2; }));
  EXPECT_FALSE(is_grey([&](Scene& s) { s.materials[0].transmittance.y = 0.25; }));
  EXPECT_FALSE(is_grey([&](Scene& s) { s.sky = {0, 0, 1}; }));
  EXPECT_FALSE(is_grey([&](Scene& s) { s.meshes[0].colors.assign(s.meshes[0].positions.size(), {1, 0.5, 1}); }));
  EXPECT_FALSE(is_grey([&](Scene& s) {
    s.environment = TexturePlane{"noon", 2, 1, 3, Wrap::kRepeat, Wrap::kClamp, {0, 0, 0, 0, 0, 1}};
  }));
  EXPECT_FALSE(is_grey([&](Scene& s) { s.lights = {{"lamp", PointLight{{1, 1, 1}, {1, 1, 2}}}}; }));
  EXPECT_TRUE(is_grey([&](Scene& s) {
    s.sky = {3, 3, 3};
    s.lights = {{"lamp", PointLight{{1, 1, 1}, {2, 2, 2}}}, {"sun", DirectionalLight{{0, -1, 0}, {1, 1, 1}}}};
    // Of a material that nothing uses.
    s.materials.push_back({});
    s.materials.back().reflectance = {0.1, 0.2, 0.3};
  }));
}

TEST(SurveyFacts, SumAreasLumensAndTheBrightest) {
  Scene scene = tests::small_emitter_room(0.5);
  scene.num_instances = 3;
  scene.lights = {{"lamp", PointLight{{1, 1, 1}, {3, 6, 9}}},
                  {"spot", SpotLight{{1, 1, 1}, {0, -1, 0}, {6, 6, 6}, 0.5, 0.5 + 1e-9}}};
  scene.materials[1].transmittance = {0.25, 0.25, 0.25};
  const Survey survey = survey_of(scene);
  EXPECT_EQ(survey.num_instances, 3u);
  // 4 pi 6 cd, and 2 pi (1 - cos 0.5) 6 cd.
  const double pi = std::numbers::pi;
  constexpr double kConeSlack = 1e-6;  // of the spot's edge
  EXPECT_NEAR(survey.lamp_lumens, 24 * pi + 12 * pi * (1 - std::cos(0.5)), kConeSlack);
  EXPECT_THAT(survey.brightest_emitters,
              ElementsAre(::testing::AllOf(::testing::StartsWith("lamp.bottom"), ::testing::EndsWith(" lm)"))));
  // The panel's block: two faces of 0.5 x 0.5 m, four of 0.5 x 0.1 m.
  double tinted = 0;
  for (const Mesh& mesh : scene.meshes) {
    if (mesh.material == 1)
      tinted += length(cross(mesh.positions[1] - mesh.positions[0], mesh.positions[3] - mesh.positions[0]));
  }
  EXPECT_DOUBLE_EQ(survey.area_tinted_m2, tinted);
  EXPECT_EQ(survey.area_masked_m2, 0);
}

// What is planned off as flat is the same to the last bit as what is simulated: a triangle of one colour too.
TEST(SurveyFacts, CallFlatWhatIsTheSameToTheLastBit) {
  Scene scene = box(true);
  scene.meshes[0].colors.assign(scene.meshes[0].positions.size(), {0.3, 0.7, 0.9});
  SurveyedScene surveyed = survey_scene(scene).value();
  EXPECT_EQ(surveyed.survey.varying_reflectance.num_flat, 1u);
  std::vector<Vec3> simulated;
  const SobolPoints points(64);
  const auto seeds = SobolPoints::seeds_of(1);
  const auto at = [&](int i) {
    return SurfacePoint{0, points.coordinate(i, 0, seeds) / 2, points.coordinate(i, 1, seeds) / 2};
  };
  for (int i = 0; i < points.size(); ++i) simulated.push_back(surveyed.surfaces.reflectance(at(i)));
  EffectSet without = EffectSet::all();
  without.set(Effect::kTexturedReflectance, false);
  surveyed.surfaces.simulate(without);
  for (int i = 0; i < points.size(); ++i) {
    EXPECT_EQ(surveyed.surfaces.reflectance(at(i)), simulated[static_cast<std::size_t>(i)]);
  }
}

TEST(SurveyFacts, ProbeWhatEscapes) {
  const auto probed = [](const Scene& scene) {
    SurveyedScene surveyed = survey_scene(scene).value();
    probe_escape(surveyed.surfaces, *make_embree_visibility(surveyed.surfaces.corners), surveyed.survey);
    return surveyed.survey;
  };
  EXPECT_EQ(probed(box(true)).escape_share, 0);
  EXPECT_GT(probed(box(true)).escape_share_interval, 0);
  EXPECT_EQ(probed(box(false)).escape_share, 1);
  EXPECT_EQ(probed(box(true)).num_probe_rays, static_cast<std::uint64_t>(kNumProbeRays));

  // A cube without its top: the five faces' form factors to it, which add to 1 by reciprocity, over 5 faces.
  Scene open = box(true);
  open.meshes.erase(open.meshes.begin() + 1);
  const Survey survey = probed(open);
  constexpr double kIntervals = 4 / 1.96;  // four standard errors; the rays are stratified and have less
  EXPECT_NEAR(survey.escape_share, 0.2, kIntervals * survey.escape_share_interval);
  EXPECT_LT(survey.escape_share_interval, 0.008);
  EXPECT_EQ(probed(open).escape_share, survey.escape_share);
}

}  // namespace
}  // namespace radbake::radiosity
