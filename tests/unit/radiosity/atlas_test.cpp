#include "server/radiosity/lightmap/atlas.h"

#include <gtest/gtest.h>

#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

constexpr double kRounding = 1e-9;

TEST(Atlas, CoversExactlyTheAreaOfTheCharts) {
  const Scene scene = tests::furnace_room(0.5);
  const SurveyedScene surveyed = survey_scene(scene).value();
  for (const int size : {64, 100, 256}) {
    const Atlas atlas = Atlas::make(surveyed.surfaces, size).value();
    double covered = 0, world = 0;
    std::uint64_t texels = 0;
    Footprint footprint;
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        atlas.footprint(x, y, footprint);
        covered += footprint.coverage;
        world += footprint.area();
        texels += !footprint.is_empty();
      }
    }
    // 12 charts, each 0.8 of a quarter of the atlas along a side.
    EXPECT_NEAR(covered / size / size, 12 * 0.2 * 0.2, 1e-6);
    double expected = 0;
    for (const double area : surveyed.surfaces.areas) expected += area;
    EXPECT_NEAR(world / expected, 1, 1e-6);
    EXPECT_EQ(texels, atlas.num_texels());
  }
}

TEST(Atlas, SamplesLieInsideTheirTexelUniformly) {
  const Scene scene = tests::furnace_room(0.5);
  const SurveyedScene surveyed = survey_scene(scene).value();
  constexpr int kSize = 64;
  const Atlas atlas = Atlas::make(surveyed.surfaces, kSize).value();
  Footprint footprint;
  const int tx = 5, ty = 7;  // on the diagonal of the first chart: two triangles
  atlas.footprint(tx, ty, footprint);
  ASSERT_FALSE(footprint.is_empty());
  Vec2 mean;
  constexpr int kSide = 40;
  for (int i = 0; i < kSide * kSide; ++i) {
    const SurfacePoint p = footprint.sample((i % kSide + 0.5) / kSide, (i / kSide + 0.5) / kSide);
    const auto uv = lightmap_corners(surveyed.surfaces, p.triangle);
    const Vec2 at = (uv[0] * (1 - p.u - p.v) + uv[1] * p.u + uv[2] * p.v) * kSize;
    EXPECT_GE(at.x, tx - kRounding);
    EXPECT_LE(at.x, tx + 1 + kRounding);
    EXPECT_GE(at.y, ty - kRounding);
    EXPECT_LE(at.y, ty + 1 + kRounding);
    mean = mean + at * (1.0 / (kSide * kSide));
  }
  constexpr double kFirstOrderInTheGrid = 1.0 / kSide;
  EXPECT_NEAR(mean.x, tx + 0.5, kFirstOrderInTheGrid);
  EXPECT_NEAR(mean.y, ty + 0.5, kFirstOrderInTheGrid);
}

TEST(Atlas, NamesTheMeshWithoutALayout) {
  Scene scene = tests::furnace_room(0.5);
  scene.meshes[3].texcoord1.clear();
  const SurveyedScene surveyed = survey_scene(scene).value();
  const auto atlas = Atlas::make(surveyed.surfaces, 64);
  ASSERT_FALSE(atlas.ok());
  EXPECT_NE(atlas.error().message.find("'room.right' has no TEXCOORD_1"), std::string::npos) << atlas.error().message;
}

TEST(Atlas, NamesMeshesThatOverlap) {
  Scene scene = tests::furnace_room(0.5);
  scene.meshes[3].texcoord1 = scene.meshes[2].texcoord1;
  const SurveyedScene surveyed = survey_scene(scene).value();
  const auto atlas = Atlas::make(surveyed.surfaces, 64);
  ASSERT_FALSE(atlas.ok());
  EXPECT_NE(atlas.error().message.find("'room.left' with 'room.right'"), std::string::npos) << atlas.error().message;
}

TEST(Atlas, NamesCoordinatesOutsideTheUnitSquare) {
  Scene scene = tests::furnace_room(0.5);
  scene.meshes[0].texcoord1[2].x = 1.5;
  const SurveyedScene surveyed = survey_scene(scene).value();
  const auto atlas = Atlas::make(surveyed.surfaces, 64);
  ASSERT_FALSE(atlas.ok());
  EXPECT_NE(atlas.error().message.find("1.5"), std::string::npos) << atlas.error().message;
}

TEST(AtlasSize, IsTheSmallestPowerOfTwoThatGivesTheDensity) {
  const Scene scene = tests::furnace_room(0.5);
  const SurveyedScene surveyed = survey_scene(scene).value();
  // 12 charts of 0.2 x 0.2 hold 94 + 8.5 m2 ... the size is the first with size * sqrt(0.48 / area) >= density.
  const double share = std::sqrt(0.48 / surveyed.survey.area_m2);
  for (const double density : {1.0, 10.0, 32.0, 100.0}) {
    const int size = atlas_size_for_density(surveyed.surfaces, density);
    EXPECT_TRUE(size == 4096 || size * share >= density);
    EXPECT_TRUE(size == 64 || size / 2 * share < density);
  }
}

}  // namespace
}  // namespace radbake::radiosity
