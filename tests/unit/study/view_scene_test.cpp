#include "server/study/view_scene.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <numbers>

namespace radbake::study {
namespace {

constexpr double kSinglePrecision = 1e-5;

/// A wall of 2 x 2 m that faces +z, its chart the whole map: red at the top left, green at the top right, blue below.
BakedScene painted_wall() {
  BakedScene baked;
  Material white;
  white.reflectance = {0.5, 0.5, 0.5};
  baked.scene.materials.push_back(white);
  Mesh wall;
  wall.name = "wall";
  wall.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  wall.texcoord1 = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  wall.triangles = {{0, 1, 2}, {0, 2, 3}};
  baked.scene.meshes.push_back(wall);
  image::Pixels map{4, 4, 4, {}};
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) {
      const bool is_top = y < 2, is_left = x < 2;
      map.values.insert(map.values.end(), {is_top && is_left ? 100.0F : 0.0F, is_top && !is_left ? 100.0F : 0.0F,
                                           is_top ? 0.0F : 100.0F, 1.0F});
    }
  }
  baked.lightmaps.push_back(map);
  baked.lightmap_of_mesh = {0};
  return baked;
}

Vec3 pixel(const image::Pixels& picture, int x, int y) {
  const float* p = &picture.values[3 * static_cast<std::size_t>(y * picture.width + x)];
  return {p[0], p[1], p[2]};
}

/// Looks straight at the wall: one metre is a fifth of the picture.
image::Pixels straight(const BakedScene& baked, Vec3 background = {}) {
  Camera camera;
  camera.eye = {0, 0, 2.5};
  camera.target = {0, 0, 0};
  camera.fov_degrees = 90;
  return render_view(baked, camera, {.width = 50, .height = 50, .samples = 2, .background = background}).value();
}

TEST(View, ShowsWhatAWallSendsOfItsLightTheRightWayUp) {
  const image::Pixels picture = straight(painted_wall());
  const double sent = 0.5 * 100 / std::numbers::pi;
  EXPECT_NEAR(pixel(picture, 18, 18).x, sent, kSinglePrecision * sent);
  EXPECT_EQ(pixel(picture, 18, 18).y, 0);
  EXPECT_NEAR(pixel(picture, 31, 18).y, sent, kSinglePrecision * sent);
  EXPECT_NEAR(pixel(picture, 18, 31).z, sent, kSinglePrecision * sent);
  EXPECT_NEAR(pixel(picture, 31, 31).z, sent, kSinglePrecision * sent);
}

TEST(View, LooksLightUpBilinearly) {
  // In the middle of the wall's upper half: red and green in equal shares.
  const Vec3 amid = (pixel(straight(painted_wall()), 24, 18) + pixel(straight(painted_wall()), 25, 18)) / 2;
  EXPECT_NEAR(amid.x, amid.y, 1e-4 * amid.x);
  EXPECT_NEAR(amid.x, 0.5 * 50 / std::numbers::pi, 1e-3 * amid.x);
}

TEST(View, ShowsWhatEmitsAndTheBackground) {
  BakedScene baked = painted_wall();
  baked.scene.materials[0].emissive = {1000, 500, 250};
  baked.lightmap_of_mesh = {-1};
  const image::Pixels picture = straight(baked, {1, 2, 3});
  EXPECT_NEAR(pixel(picture, 25, 25).x, 1000, 1000 * kSinglePrecision);
  EXPECT_NEAR(pixel(picture, 25, 25).z, 250, 250 * kSinglePrecision);
  EXPECT_NEAR(pixel(picture, 2, 2).y, 2, 1e-6);
}

// From behind, a single-sided wall is not there, and what stands beyond it is.
TEST(View, LooksThroughBacks) {
  const auto from_behind = [](const BakedScene& baked) {
    Camera camera;
    camera.eye = {0, 0, -2.5};
    camera.fov_degrees = 90;
    return pixel(render_view(baked, camera, {.width = 50, .height = 50, .background = {1, 2, 3}}).value(), 23, 28);
  };
  BakedScene baked = painted_wall();
  EXPECT_NEAR(from_behind(baked).y, 2, 1e-6);
  Mesh lamp = baked.scene.meshes[0];
  for (Vec3& p : lamp.positions) p = {-p.x, p.y, 3};
  lamp.material = 1;
  Material glow;
  glow.emissive = {7, 8, 9};
  baked.scene.materials.push_back(glow);
  baked.scene.meshes.push_back(lamp);
  baked.lightmap_of_mesh.push_back(-1);
  EXPECT_NEAR(from_behind(baked).y, 8, 8 * kSinglePrecision);
  baked.scene.materials[0].is_double_sided = true;
  EXPECT_LT(from_behind(baked).x, 1);
}

TEST(View, RefusesACameraThatLooksNowhere) {
  Camera camera;
  EXPECT_FALSE(render_view(painted_wall(), camera, {}).ok());
  camera.target = {0, 5, 0};
  EXPECT_FALSE(render_view(painted_wall(), camera, {}).ok());
  EXPECT_FALSE(parse_camera("1,2,3").ok());
  EXPECT_FALSE(parse_camera("1,2,3,4,5,x").ok());
  EXPECT_FALSE(parse_camera("1,2,3,4,5,6,180").ok());
  EXPECT_FALSE(parse_camera("1,2,3,4,5,6,").ok());
  const auto camera_of = parse_camera("1,2,3,-4,5e-1,6,35");
  ASSERT_TRUE(camera_of.ok());
  EXPECT_EQ(camera_of->eye, (Vec3{1, 2, 3}));
  EXPECT_EQ(camera_of->target, (Vec3{-4, 0.5, 6}));
  EXPECT_EQ(camera_of->fov_degrees, 35);
}

TEST(View, DevelopsByTheBrightestParts) {
  image::Pixels luminance{20, 1, 3, std::vector<float>(60, 10.0F)};
  // The 95th percentile becomes 1: 17/32 of white after the tone curve, 75 % in sRGB.
  for (const std::uint8_t value : developed(luminance, 0)) EXPECT_NEAR(value, 0.755 * 255, 1);
  for (const std::uint8_t value : developed(luminance, 0.4)) EXPECT_EQ(value, 255);
  luminance.values.assign(60, 0.0F);
  for (const std::uint8_t value : developed(luminance, 0)) EXPECT_EQ(value, 0);
}

TEST(View, RefusesADocumentThatIsNotOne) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "radbake_view";
  std::filesystem::create_directories(folder);
  for (const char* text : {"[]", "{\"lightmaps\": 3, \"meshes\": []}", "{\"lightmaps\": [3], \"meshes\": []}",
                           "{\"lightmaps\": [{\"files\": [4, {\"encoding\": 5}]}], \"meshes\": [6]}"}) {
    std::ofstream(folder / "lightmaps.json") << text;
    const auto baked = read_baked_scene(folder);
    ASSERT_FALSE(baked.ok());
    EXPECT_NE(baked.error().message.find("lightmaps.json"), std::string::npos) << baked.error().message;
  }
}

TEST(View, NamesTheFileThatIsMissing) {
  const auto baked = read_baked_scene("nowhere");
  ASSERT_FALSE(baked.ok());
  EXPECT_NE(baked.error().message.find("lightmaps.json"), std::string::npos);
}

}  // namespace
}  // namespace radbake::study
