#include "client/options/scene_light.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace radbake::options {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// One triangle of material 0; material 1 is in nobody's use.
Scene dark_scene() {
  Scene scene;
  scene.materials.resize(2);
  scene.meshes.resize(1);
  scene.meshes[0].positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  scene.meshes[0].triangles = {{0, 1, 2}};
  return scene;
}

TEST(SceneLight, RefusesADarkSceneAndSaysHowToLightIt) {
  const Result<void> refused = require_light(dark_scene(), "dark.glb");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(refused.error().message,
              AllOf(HasSubstr("dark.glb"), HasSubstr("no light"), HasSubstr("--sky"), HasSubstr("--sun")));
}

TEST(SceneLight, CountsOnlyMaterialsInUse) {
  Scene scene = dark_scene();
  scene.materials[1].emissive = {1, 1, 1};
  EXPECT_FALSE(has_light(scene));
  scene.materials[0].emissive = {0, 0, 1};
  EXPECT_TRUE(has_light(scene));
}

TEST(SceneLight, DoesNotTakeABlackTextureForALight) {
  Scene scene = dark_scene();
  scene.materials[0].emissive = {1, 1, 1};
  scene.materials[0].emissive_texture = TextureReference{0, 0};
  scene.textures.resize(1);
  scene.textures[0].channels = 4;
  scene.textures[0].values = {0, 0, 0, 1, 0, 0, 0, 1};
  EXPECT_FALSE(has_light(scene));
  scene.textures[0].values[5] = 0.1f;
  EXPECT_TRUE(has_light(scene));
}

TEST(SceneLight, DoesNotTakeALampThatIsOffForALight) {
  Scene scene = dark_scene();
  scene.lights.push_back({"off", PointLight{}});
  EXPECT_FALSE(has_light(scene));
  scene.lights.push_back({"on", SpotLight{{}, {0, -1, 0}, {1, 1, 1}}});
  EXPECT_TRUE(has_light(scene));
}

Result<TexturePlane> no_image(const std::filesystem::path&, double) {
  ADD_FAILURE() << "no image was asked for";
  return invalid_argument("no image");
}

TEST(SceneLight, AddsTheSkyAndTheSunOfTheCommandLine) {
  BakeChoices choices;
  choices.sky = Vec3{1, 2, 3};
  Scene scene = dark_scene();
  ASSERT_TRUE(add_sky_and_sun(choices, no_image, scene).ok());
  EXPECT_EQ(scene.sky, (Vec3{1, 2, 3}));
  EXPECT_TRUE(has_light(scene));
  choices = {};
  choices.sun = DirectionalLight{{0, -1, 0}, {5, 5, 5}, 0.01};
  scene = dark_scene();
  ASSERT_TRUE(add_sky_and_sun(choices, no_image, scene).ok());
  ASSERT_EQ(scene.lights.size(), 1u);
  EXPECT_EQ(std::get<DirectionalLight>(scene.lights[0].kind).angular_diameter_radians, 0.01);
  EXPECT_TRUE(has_light(scene));
}

TEST(SceneLight, AddsTheSkyImageOfTheCommandLine) {
  BakeChoices choices;
  choices.sky_image = SkyImage{"dawn.hdr", 40};
  const auto sky_of = [](float luminance) {
    return [luminance](const std::filesystem::path& file, double scale) -> Result<TexturePlane> {
      EXPECT_EQ(file, "dawn.hdr");
      EXPECT_EQ(scale, 40);
      return TexturePlane{.name = "dawn", .width = 2, .height = 1, .values = {0, 0, 0, 0, luminance, 0}};
    };
  };
  Scene scene = dark_scene();
  ASSERT_TRUE(add_sky_and_sun(choices, sky_of(0.5f), scene).ok());
  ASSERT_TRUE(scene.environment.has_value());
  EXPECT_TRUE(has_light(scene));
  // A black one lights nothing.
  ASSERT_TRUE(add_sky_and_sun(choices, sky_of(0), scene).ok());
  EXPECT_FALSE(has_light(scene));
  const auto refused = add_sky_and_sun(
      choices, [](const auto&, double) -> Result<TexturePlane> { return invalid_argument("dawn.hdr: gone"); }, scene);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().message, "dawn.hdr: gone");
}

}  // namespace
}  // namespace radbake::options
