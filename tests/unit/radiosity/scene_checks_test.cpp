#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

struct Refusal {
  const char* name;
  std::function<void(Scene&)> spoil;
  const char* expected;  ///< part of the message
};

void PrintTo(const Refusal& refusal, std::ostream* out) { *out << refusal.name; }

class SceneRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(SceneRefusal, NamesTheThingAndTheValue) {
  Scene scene = tests::furnace_room(0.5);
  GetParam().spoil(scene);
  const auto surveyed = survey_scene(scene);
  ASSERT_FALSE(surveyed.ok());
  EXPECT_EQ(surveyed.error().code, ErrorCode::kInvalidArgument);
  EXPECT_NE(surveyed.error().message.find(GetParam().expected), std::string::npos) << surveyed.error().message;
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(
    BadValues, SceneRefusal,
    testing::Values(
        Refusal{"IndexOutOfRange", [](Scene& s) { s.meshes[1].triangles[1][2] = 9; },
                "mesh 'room.top', triangle 1, vertex 9: index out of range"},
        Refusal{"PositionNotFinite", [](Scene& s) { s.meshes[0].positions[1].y = kNan; }, "vertex 1: position (0, nan"},
        Refusal{"NoSuchMaterial", [](Scene& s) { s.meshes[0].material = 7; }, "material 7 does not exist"},
        Refusal{"ReflectanceOne", [](Scene& s) { s.materials[0].reflectance.y = 1; }, "reflectance (0.5, 1, 0.5)"},
        Refusal{"ReflectanceNegative", [](Scene& s) { s.materials[0].reflectance.y = -0.1; }, "reflectance (0.5, -0.1"},
        Refusal{"EmissionNegative", [](Scene& s) { s.materials[0].emissive.x = -1; }, "emissive luminance (-1"},
        Refusal{"EmissionNotFinite", [](Scene& s) { s.materials[0].emissive.x = INFINITY; }, "emissive luminance (inf"},
        Refusal{"TextureMissing",
                [](Scene& s) {
                  s.materials[0].reflectance_texture = TextureReference{2, 1};
                },
                "texture 2 does not exist"},
        Refusal{"TextureTooShort",
                [](Scene& s) {
                  s.textures.push_back({"bricks", 2, 2, 3, Wrap::kRepeat, Wrap::kRepeat, std::vector<float>(11)});
                },
                "texture 'bricks': 11 values for 2 x 2 x 3"},
        Refusal{"TextureTimesFactorTooBright",
                [](Scene& s) {
                  s.textures.push_back({"snow", 1, 1, 3, Wrap::kRepeat, Wrap::kRepeat, {2.0f, 1.0f, 1.0f}});
                  s.materials[0].reflectance_texture = TextureReference{0, 1};
                },
                "reflectance times texture reaches (1,"},
        Refusal{"ColorsTooFew", [](Scene& s) { s.meshes[0].colors.resize(3); }, "attributes differ in length"},
        Refusal{"ColorAboveOne",
                [](Scene& s) {
                  s.meshes[0].colors.assign(4, {1, 1, 1});
                  s.meshes[0].colors[2] = {0, 1.5, 0};
                },
                "vertex 2: colour (0, 1.5, 0)"},
        Refusal{"UvTransformNotFinite",
                [](Scene& s) {
                  s.textures.push_back({"snow", 1, 1, 3, Wrap::kRepeat, Wrap::kRepeat, {1.0f, 1.0f, 1.0f}});
                  s.materials[0].reflectance_texture = TextureReference{0, 1, {{1, 0}, {0, INFINITY}, {0, 0}}};
                },
                "(0, inf, 0), is not finite in single precision"},
        Refusal{"LightDirectionNotUnit",
                [](Scene& s) {
                  s.lights.push_back({"sun", DirectionalLight{{0, -2, 0}, {1, 1, 1}}});
                },
                "light 'sun': direction is not of unit length"},
        Refusal{"SpotConesSwapped",
                [](Scene& s) {
                  s.lights.push_back({"spot", SpotLight{{0, 1, 0}, {0, -1, 0}, {1, 1, 1}, 0.8, 0.4}});
                },
                "cone angles"},
        Refusal{"TransmittanceAboveOne",
                [](Scene& s) {
                  s.materials[0].transmittance = {0, 1.5, 0};
                },
                "transmittance (0, 1.5, 0) is not within [0, 1]"},
        Refusal{"TransmittanceNotFinite", [](Scene& s) { s.materials[0].transmittance.z = kNan; }, "(0, 0, nan)"},
        Refusal{"PassesOnMoreThanItGets",
                [](Scene& s) {
                  s.materials[0].transmittance = {0.5, 0.51, 0.5};
                },
                "reflectance + transmittance reaches (1, 1.01, 1), above 1"},
        Refusal{"SendsOnMoreThanAllOnBothSides",
                [](Scene& s) {
                  s.materials[0].is_double_sided = true;
                  s.materials[0].reflectance = {0.4, 0.4, 0.4};
                  s.materials[0].transmittance = s.materials[0].diffuse_transmittance = {0.25, 0.5, 0.25};
                },
                "reflectance, transmittance and diffuse transmittance, with their textures, reach (0.9, 1.4, 0.9)"},
        Refusal{"TextureTimesBothTooBright",
                [](Scene& s) {
                  s.textures.push_back({"snow", 1, 1, 3, Wrap::kRepeat, Wrap::kRepeat, {1.5f, 1.5f, 1.5f}});
                  s.materials[0].reflectance_texture = TextureReference{0, 1};
                  s.materials[0].transmittance = {0.25, 0.25, 0.25};
                },
                "transmittance times texture reaches (1.125, 1.125, 1.125), above 1"},
        Refusal{"SunDiameterNegative",
                [](Scene& s) {
                  s.lights.push_back({"sun", DirectionalLight{{0, -1, 0}, {1, 1, 1}, -0.1}});
                },
                "light 'sun': angular diameter -0.1"},
        Refusal{"SunDiameterHalfTheSky",
                [](Scene& s) {
                  s.lights.push_back({"sun", DirectionalLight{{0, -1, 0}, {1, 1, 1}, 3.15}});
                },
                "is not within [0, pi)"},
        Refusal{"EnvironmentNotTwiceAsWide",
                [](Scene& s) {
                  s.environment = TexturePlane{"noon", 2, 2, 3, Wrap::kRepeat, Wrap::kClamp, std::vector<float>(12)};
                },
                "environment 'noon': 2 x 2 pixels are not twice as wide as high"},
        Refusal{"EnvironmentTooShort",
                [](Scene& s) {
                  s.environment = TexturePlane{"noon", 2, 1, 3, Wrap::kRepeat, Wrap::kClamp, std::vector<float>(5)};
                },
                "environment 'noon': 5 values for 2 x 1 x 3"},
        Refusal{"EnvironmentNotANumber",
                [](Scene& s) {
                  s.environment = TexturePlane{"noon", 2, 1, 3, Wrap::kRepeat, Wrap::kClamp, {0, 0, 0, 0, NAN, 0}};
                },
                "luminance nan nit at column 1, row 0 is not within [0, inf)"},
        Refusal{"EnvironmentBesideASky",
                [](Scene& s) {
                  s.sky = {1, 1, 1};
                  s.environment = TexturePlane{"noon", 2, 1, 3, Wrap::kRepeat, Wrap::kClamp, std::vector<float>(6)};
                },
                "environment 'noon' and a constant sky of (1, 1, 1) nit exclude each other"},
        Refusal{"SkyNegative",
                [](Scene& s) {
                  s.sky = {-1, 0, 0};
                },
                "sky: luminance (-1"},
        Refusal{"NoArea",
                [](Scene& s) {
                  for (Mesh& mesh : s.meshes) {
                    for (Vec3& p : mesh.positions) p = {1, 2, 3};
                  }
                },
                "no triangle with an area"},
        Refusal{"NoLight", [](Scene& s) { s.materials[0].emissive = {}; }, "has no light"}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(Survey, CountsAndDropsTrianglesWithoutArea) {
  Scene scene = tests::furnace_room(0.5);
  scene.meshes[0].triangles.push_back({0, 0, 1});
  scene.meshes[0].triangles.push_back({1, 2, 1});
  const SurveyedScene surveyed = survey_scene(scene).value();
  EXPECT_EQ(surveyed.survey.num_triangles, 24u);
  EXPECT_EQ(surveyed.survey.num_triangles_dropped, 2u);
  ASSERT_EQ(surveyed.warnings.size(), 1u);
  EXPECT_EQ(surveyed.warnings[0].id, "triangles_dropped");
}

TEST(Survey, TellsSmallBrightEmittersFromGlowingSurfaces) {
  const Scene furnace = tests::furnace_room(0.5), panel = tests::small_emitter_room(0.5);
  EXPECT_EQ(survey_scene(furnace)->survey.num_emitter_triangles, 0u);
  EXPECT_EQ(survey_scene(furnace)->survey.num_glowing_triangles, 24u);
  EXPECT_EQ(survey_scene(panel)->survey.num_emitter_triangles, 2u);
  EXPECT_EQ(survey_scene(panel)->survey.num_glowing_triangles, 0u);
}

TEST(Survey, MultipliesReflectanceByTheVerticesColours) {
  Scene scene = tests::furnace_room(0.5);
  scene.meshes[0].colors.assign(scene.meshes[0].positions.size(), {1, 0.5, 0});
  const std::uint32_t last = scene.meshes[0].triangles[0][2];
  scene.meshes[0].colors[last] = {0, 0.5, 1};
  const SurveyedScene surveyed = survey_scene(scene).value();
  EXPECT_EQ(surveyed.surfaces.reflectance({0, 0, 0}), (Vec3{0.5, 0.25, 0}));
  EXPECT_EQ(surveyed.surfaces.reflectance({0, 0, 0.5}), (Vec3{0.25, 0.25, 0.25}));
  EXPECT_EQ(surveyed.surfaces.exitance({0, 0, 0.5}).z, survey_scene(tests::furnace_room(0.5))->surfaces.exitances[0].z);
}

TEST(Survey, LooksATextureUpThroughItsTransform) {
  // Two texels side by side, dark and bright; the coordinates of the triangle are all at the dark one.
  Scene scene = tests::furnace_room(0.5);
  scene.textures.push_back({"pair", 2, 1, 3, Wrap::kClamp, Wrap::kClamp, {0.25f, 0.25f, 0.25f, 1.0f, 1.0f, 1.0f}});
  for (Mesh& mesh : scene.meshes) mesh.texcoord0.assign(mesh.positions.size(), {0.25, 0.5});
  scene.materials[0].reflectance_texture = TextureReference{0, 0};
  EXPECT_EQ(survey_scene(scene)->surfaces.reflectance({0, 0.25, 0.25}).x, 0.125);
  // A quarter turn takes (0.25, 0.5) to (0.5, -0.25), the offset then to (0.75, 0.25): the bright one.
  scene.materials[0].reflectance_texture->transform = {{0, -1}, {1, 0}, {0.25, 0.5}};
  EXPECT_EQ(survey_scene(scene)->surfaces.reflectance({0, 0.25, 0.25}).x, 0.5);
}

// Scaling by a power of two and moving by a multiple of the scene's spacing change no coordinate of the surfaces.
TEST(Survey, GivesTheSameSurfacesInAnyUnitAndPlace) {
  const Scene scene = tests::furnace_room(0.5);
  Scene moved = scene;
  for (Mesh& mesh : moved.meshes) {
    for (Vec3& p : mesh.positions) p = p * 1024.0 + Vec3{1048576, -2097152, 524288};
  }
  const SurveyedScene here = survey_scene(scene).value(), there = survey_scene(moved).value();
  EXPECT_EQ(here.surfaces.corners, there.surfaces.corners);
  EXPECT_EQ(here.surfaces.areas, there.surfaces.areas);
  EXPECT_EQ(there.surfaces.metres_per_unit, 1024 * here.surfaces.metres_per_unit);
}

}  // namespace
}  // namespace radbake::radiosity
