#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gltf/gltf_builder.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;

// Some roundings of double.
constexpr double kRounding = 1e-15;

// The square and one node with a light.
GltfBuilder lit(json light, json node) {
  GltfBuilder file = square();
  file.document["extensions"]["KHR_lights_punctual"]["lights"] = json::array({std::move(light)});
  node["extensions"]["KHR_lights_punctual"]["light"] = 0;
  file.add_root(std::move(node));
  return file;
}

std::vector<Light> lights_of(const GltfBuilder& file) {
  Result<GltfScene> result = read_bytes(file.glb());
  EXPECT_TRUE(result.ok()) << result.error().message;
  return result.ok() ? std::move(result)->scene.lights : std::vector<Light>{};
}

TEST(GltfLights, APointLightHasIntensityTimesColour) {
  const auto lights = lights_of(lit({{"type", "point"}, {"intensity", 100}, {"color", {1, 0.5, 0.25}}},
                                    {{"name", "bulb"}, {"translation", {1, 2, 3}}, {"scale", {7, 7, 7}}}));
  ASSERT_EQ(lights.size(), 1u);
  EXPECT_EQ(lights[0].name, "bulb");
  const auto& point = std::get<PointLight>(lights[0].kind);
  EXPECT_EQ(point.position, (Vec3{1, 2, 3}));
  EXPECT_EQ(point.intensity, (Vec3{100, 50, 25}));
}

TEST(GltfLights, ASunShinesAlongMinusZOfItsNode) {
  const json sun = {{"type", "directional"}, {"intensity", 1000}};
  const auto unturned = lights_of(lit(sun, json::object()));
  EXPECT_EQ(std::get<DirectionalLight>(unturned.at(0).kind).direction, (Vec3{0, 0, -1}));
  EXPECT_EQ(std::get<DirectionalLight>(unturned.at(0).kind).illuminance, (Vec3{1000, 1000, 1000}));
  // Turned by -90 degrees about x, -Z goes to -Y: straight down. The scale does not count.
  const auto turned =
      lights_of(lit(sun, {{"rotation", {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)}}, {"scale", {2, 3, 4}}}));
  const Vec3 direction = std::get<DirectionalLight>(turned.at(0).kind).direction;
  EXPECT_NEAR(direction.x, 0, kRounding);
  EXPECT_NEAR(direction.y, -1, kRounding);
  EXPECT_NEAR(direction.z, 0, kRounding);
}

TEST(GltfLights, ASpotHasConesWithDefaults) {
  const auto standard = lights_of(lit({{"type", "spot"}, {"spot", json::object()}}, json::object()));
  EXPECT_EQ(std::get<SpotLight>(standard.at(0).kind).inner_cone_radians, 0);
  // tinygltf writes glTF's default, pi / 4, with ten digits.
  EXPECT_NEAR(std::get<SpotLight>(standard.at(0).kind).outer_cone_radians, 0.7853981633974483, 1e-10);
  const auto narrow =
      lights_of(lit({{"type", "spot"}, {"intensity", 2}, {"spot", {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.3}}}},
                    {{"translation", {0, 4, 0}}}));
  const auto& spot = std::get<SpotLight>(narrow.at(0).kind);
  EXPECT_EQ(spot.inner_cone_radians, 0.1);
  EXPECT_EQ(spot.outer_cone_radians, 0.3);
  EXPECT_EQ(spot.intensity, (Vec3{2, 2, 2}));
  EXPECT_EQ(spot.position, (Vec3{0, 4, 0}));
  EXPECT_EQ(spot.direction, (Vec3{0, 0, -1}));
}

TEST(GltfLights, LeavesOutLightsWithoutIntensity) {
  EXPECT_TRUE(lights_of(lit({{"type", "point"}, {"intensity", 0}}, json::object())).empty());
  EXPECT_TRUE(lights_of(lit({{"type", "point"}, {"color", {0, 0, 0}}}, json::object())).empty());
}

TEST(GltfLights, NamesWhatIsWrongWithALight) {
  expect_refused(read_bytes(lit({{"type", "laser"}}, json::object()).glb()), {"light 0", "type is 'laser'"});
  expect_refused(read_bytes(lit({{"type", "point"}, {"intensity", -5}}, json::object()).glb()),
                 {"light 0", "intensity is -5"});
  expect_refused(read_bytes(lit({{"type", "spot"}, {"spot", {{"outerConeAngle", 2}}}}, json::object()).glb()),
                 {"light 0", "outerConeAngle is 2"});
  expect_refused(
      read_bytes(
          lit({{"type", "spot"}, {"spot", {{"innerConeAngle", 0.75}, {"outerConeAngle", 0.5}}}}, json::object()).glb()),
      {"node 1", "innerConeAngle 0.75", "is not below outerConeAngle 0.5"});
  expect_refused(read_bytes(lit({{"type", "directional"}}, {{"name", "sun"}, {"scale", {1, 1, 0}}}).glb()),
                 {"node 1 'sun'", "direction"});
  GltfBuilder file = lit({{"type", "point"}}, json::object());
  file.document["nodes"][1]["extensions"]["KHR_lights_punctual"]["light"] = 3;
  expect_refused(read_bytes(file.glb()), {"node 1", "light is 3"});
}

}  // namespace
}  // namespace radbake::gltf
