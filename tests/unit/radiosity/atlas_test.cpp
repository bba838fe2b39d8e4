#include "server/radiosity/lightmap/atlas.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

constexpr double kRounding = 1e-9;

Atlas make_atlas(const Surfaces& surfaces, int size) {
  LayoutOptions options;
  options.sheet_size = size;
  return Atlas::make(surfaces, make_layout(surfaces, options).value()).value();
}

TEST(Atlas, CoversExactlyTheAreaOfTheCharts) {
  const Scene scene = tests::furnace_room(0.5);
  const SurveyedScene surveyed = survey_scene(scene).value();
  for (const int size : {64, 100, 256}) {
    const Atlas atlas = make_atlas(surveyed.surfaces, size);
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
    EXPECT_NEAR(atlas.fill(), 12 * 0.2 * 0.2, 1e-6);
  }
}

// Large triangles and small ones, slivers, needles below a texel: counting them by strips finds what footprints find.
TEST(Atlas, CountsTheTexelsThatHaveAFootprint) {
  constexpr int kSize = 128, kTriangles = 400;
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> place(2, kSize - 2), exponent(-7, 1.5), any(-1, 1);
  Scene scene = tests::furnace_room(0.5);
  scene.meshes.resize(1);
  Mesh& mesh = scene.meshes[0];
  mesh.positions.clear();
  mesh.texcoord1.clear();
  mesh.triangles.clear();
  Layout layout;
  layout.width = layout.height = kSize;
  layout.num_sheets = 1;
  for (std::uint32_t t = 0; t < kTriangles; ++t) {
    const Vec2 a{place(random), place(random)};
    const auto moved = [&](double length) {
      return Vec2{std::clamp(a.x + length * any(random), 0.0, double{kSize}),
                  std::clamp(a.y + length * any(random), 0.0, double{kSize})};
    };
    const double longest = std::pow(10, exponent(random)), width = std::pow(10, exponent(random));
    layout.corners.push_back({a, moved(longest), moved(width)});
    mesh.positions.insert(mesh.positions.end(), {{any(random), any(random), 0}, {2, 0, 0}, {0, 2, 1}});
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  const SurveyedScene surveyed = survey_scene(scene).value();
  ASSERT_EQ(surveyed.surfaces.size(), std::size_t{kTriangles});
  const Atlas atlas = Atlas::make(surveyed.surfaces, layout).value();
  std::uint64_t texels = 0;
  Footprint footprint;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      atlas.footprint(x, y, footprint);
      texels += !footprint.is_empty();
    }
  }
  EXPECT_GT(texels, 1000u);
  EXPECT_EQ(atlas.num_texels(), texels);
}

TEST(Atlas, SamplesLieInsideTheirTexelUniformly) {
  const Scene scene = tests::furnace_room(0.5);
  const SurveyedScene surveyed = survey_scene(scene).value();
  constexpr int kSize = 64;
  const Atlas atlas = make_atlas(surveyed.surfaces, kSize);
  Footprint footprint;
  const int tx = 5, ty = 7;  // on the diagonal of the first chart: two triangles
  atlas.footprint(tx, ty, footprint);
  ASSERT_FALSE(footprint.is_empty());
  Vec2 mean;
  constexpr int kSide = 40;
  for (int i = 0; i < kSide * kSide; ++i) {
    const SurfacePoint p = footprint.sample((i % kSide + 0.5) / kSide, (i / kSide + 0.5) / kSide);
    const PlaneTriangle& corners = atlas.layout().corners[p.triangle];
    const Vec2 at = corners[0] * (1 - p.u - p.v) + corners[1] * p.u + corners[2] * p.v;
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

}  // namespace
}  // namespace radbake::radiosity
