#include "server/radiosity/lightmap/layout.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <set>

#include "server/radiosity/lightmap/atlas.h"
#include "server/radiosity/lightmap/clusters.h"
#include "server/radiosity/lightmap/unwrap.h"
#include "server/radiosity/survey/mesh_edges.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"
#include "tests/scenes/solids.h"

namespace radbake::radiosity {
namespace {

using ::testing::HasSubstr;

Scene scene_of(Mesh mesh) {
  Scene scene;
  scene.materials.emplace_back();
  scene.meshes.push_back(std::move(mesh));
  scene.sky = {1, 1, 1};
  return scene;
}

/// The room of 12 quads as 12 objects, each with the whole unit square as its own layout.
Scene room_of_instances() {
  Scene scene = tests::furnace_room(0.5);
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    scene.meshes[m].object = static_cast<int>(m);
    scene.meshes[m].texcoord1 = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  }
  return scene;
}

/// The text of a layout's warning, or nothing.
std::string warning_of(const Layout& layout, const std::string& id) {
  for (const Warning& warning : layout.warnings) {
    if (warning.id == id) return warning.text;
  }
  return {};
}

/// Counts places of a grid of 8 points a texel that lie strictly inside two triangles, and holds that every triangle
/// keeps to its sheet.
int count_overlaps(const Surfaces& surfaces, const Layout& layout) {
  constexpr int kFine = 8;
  constexpr double kStrictlyInside = 1e-6;
  const auto row = static_cast<std::size_t>(layout.width) * kFine;
  std::vector<bool> is_taken(row * static_cast<std::size_t>(layout.height * layout.num_sheets) * kFine);
  int overlaps = 0;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    const PlaneTriangle& c = layout.corners[t];
    const int sheet = layout.meshes[surfaces.meshes[t]].sheet;
    for (const Vec2 corner : c) {
      EXPECT_GE(corner.x, 0);
      EXPECT_LE(corner.x, layout.width);
      EXPECT_GE(corner.y, sheet * layout.height);
      EXPECT_LE(corner.y, (sheet + 1) * layout.height);
    }
    const double area = twice_area(c);
    if (area == 0) continue;
    const auto [low_x, high_x] = std::minmax({c[0].x, c[1].x, c[2].x});
    const auto [low_y, high_y] = std::minmax({c[0].y, c[1].y, c[2].y});
    for (int y = static_cast<int>(low_y * kFine); y <= static_cast<int>(high_y * kFine); ++y) {
      for (int x = static_cast<int>(low_x * kFine); x <= static_cast<int>(high_x * kFine); ++x) {
        const Vec2 p{(x + 0.5) / kFine, (y + 0.5) / kFine};
        const double u = cross(p - c[0], c[2] - c[0]) / area, v = cross(c[1] - c[0], p - c[0]) / area;
        if (u < kStrictlyInside || v < kStrictlyInside || u + v > 1 - kStrictlyInside) continue;
        const std::size_t at = static_cast<std::size_t>(y) * row + static_cast<std::size_t>(x);
        overlaps += is_taken[at];
        is_taken[at] = true;
      }
    }
  }
  return overlaps;
}

/// Texels that two charts (or, where nothing was unwrapped, two meshes) reach by bilinear look-ups.
int count_shared_texels(const Surfaces& surfaces, const Layout& layout) {
  // A margin of one texel: look-ups at the border reach beyond it.
  const auto row = static_cast<std::size_t>(layout.width) + 2;
  constexpr std::uint32_t kNobody = 0xfffffffeu;
  std::vector<std::uint32_t> owner(row * static_cast<std::size_t>(layout.height * layout.num_sheets + 2), kNobody);
  int shared = 0;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    const std::uint32_t chart = layout.chart_of[t] == kNoChart ? 1u << 31 | surfaces.meshes[t] : layout.chart_of[t];
    const PlaneTriangle& c = layout.corners[t];
    const auto [low_x, high_x] = std::minmax({c[0].x, c[1].x, c[2].x});
    const auto [low_y, high_y] = std::minmax({c[0].y, c[1].y, c[2].y});
    // A look-up at p reads the texels whose centres lie within one texel of p. The box of a triangle is enough here.
    constexpr double kRounding = 1e-9;
    for (int y = static_cast<int>(std::floor(low_y - 0.5 + kRounding));
         y <= static_cast<int>(std::floor(high_y + 0.5 - kRounding)); ++y) {
      for (int x = static_cast<int>(std::floor(low_x - 0.5 + kRounding));
           x <= static_cast<int>(std::floor(high_x + 0.5 - kRounding)); ++x) {
        std::uint32_t& first = owner[static_cast<std::size_t>(y + 1) * row + static_cast<std::size_t>(x + 1)];
        if (first == kNobody) first = chart;
        shared += first != chart;
      }
    }
  }
  return shared;
}

/// Largest of s and 1/s over the scales s of a layout's triangles along any direction, against a density in texels a
/// metre: by the singular values of each triangle's map.
double worst_stretch(const Surfaces& surfaces, const Layout& layout, double density) {
  double worst = 1;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    const auto& p = surfaces.corners[t];
    const Vec3 e1 = p[1] - p[0], e2 = p[2] - p[0];
    const double length1 = length(e1);
    const Vec2 q2{dot(e2, e1) / length1, 2 * surfaces.areas[t] / length1};
    const PlaneTriangle& c = layout.corners[t];
    const Vec2 column1 = (c[1] - c[0]) * (1 / length1);
    const Vec2 column2 = (c[2] - c[0] - column1 * q2.x) * (1 / q2.y);
    const double a = dot(column1, column1), b = dot(column1, column2), d = dot(column2, column2);
    const double middle = (a + d) / 2, spread = std::sqrt((a - d) * (a - d) / 4 + b * b);
    const double unit = density * surfaces.metres_per_unit;
    const double high = std::sqrt(middle + spread) / unit, low = std::sqrt(std::max(middle - spread, 0.0)) / unit;
    worst = std::max({worst, high, 1 / low});
  }
  return worst;
}

TEST(Layout, KeepsACoordinateThatIsDisjointOverTheScene) {
  const Scene scene = tests::furnace_room(0.5);
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Layout layout = make_layout(surveyed.surfaces, {.sheet_size = 128}).value();
  EXPECT_EQ(layout.width, 128);
  EXPECT_EQ(layout.height, 128);
  EXPECT_EQ(layout.num_charts, 0U);
  for (const MeshPlacement& mesh : layout.meshes) {
    EXPECT_EQ(mesh.source, UvSource::kKept);
    EXPECT_EQ(mesh.scale, (Vec2{1, 1}));
    EXPECT_EQ(mesh.offset, Vec2{});
  }
}

TEST(Layout, SizesAKeptOneAsTheSmallestPowerOfTwoThatGivesTheDensity) {
  const Scene scene = tests::furnace_room(0.5);
  const SurveyedScene surveyed = survey_scene(scene).value();
  const double share = std::sqrt(12 * 0.2 * 0.2 / surveyed.survey.area_m2);
  for (const double density : {1.0, 10.0, 32.0, 100.0}) {
    const int size = make_layout(surveyed.surfaces, {.texels_per_meter = density}).value().width;
    EXPECT_TRUE(size == 4096 || size * share >= density);
    EXPECT_TRUE(size == 64 || size / 2 * share < density);
  }
}

TEST(Layout, NamesTheMeshesThatOverlapAndKeepsALittleOverlap) {
  Scene scene = tests::furnace_room(0.5);
  scene.meshes[3].texcoord1 = scene.meshes[2].texcoord1;
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) scene.meshes[m].object = static_cast<int>(m);
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Layout layout = make_layout(surveyed.surfaces, {}).value();
  EXPECT_EQ(layout.meshes[0].source, UvSource::kPlaced);
  ASSERT_EQ(layout.warnings.size(), 1U);
  EXPECT_EQ(layout.warnings[0].id, "lightmap_uv_overlap");
  EXPECT_THAT(layout.warnings[0].text, HasSubstr("'room.left' with 'room.right'"));

  // Charts that share little stay as they are, and that is said.
  Scene touching = tests::furnace_room(0.5);
  const double gap = touching.meshes[1].texcoord1[0].x - touching.meshes[0].texcoord1[1].x;
  for (const int corner : {1, 2}) touching.meshes[0].texcoord1[corner].x += 1.05 * gap;
  const SurveyedScene surveyed_touching = survey_scene(touching).value();
  const Layout kept = make_layout(surveyed_touching.surfaces, {}).value();
  EXPECT_EQ(kept.meshes[0].source, UvSource::kKept);
  ASSERT_EQ(kept.warnings.size(), 1U);
  EXPECT_THAT(kept.warnings[0].text, HasSubstr("the light there is mixed"));
}

TEST(Layout, GivesEachInstanceOfOneLayoutARectangle) {
  const Scene scene = room_of_instances();
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Layout layout = make_layout(surveyed.surfaces, {.texels_per_meter = 32}).value();
  EXPECT_EQ(count_overlaps(surveyed.surfaces, layout), 0);
  EXPECT_EQ(count_shared_texels(surveyed.surfaces, layout), 0);
  constexpr double kRounding = 1e-9;
  for (std::uint32_t t = 0; t < surveyed.surfaces.size(); ++t) {
    const std::uint32_t m = surveyed.surfaces.meshes[t];
    const MeshPlacement& placement = layout.meshes[m];
    EXPECT_EQ(placement.source, UvSource::kPlaced);
    for (int k = 0; k < 3; ++k) {
      const Vec2 own = scene.meshes[m].texcoord1[surveyed.surfaces.vertices(t)[k]];
      const Vec2 final = layout.uv_of(t, k, placement.sheet);
      EXPECT_NEAR(final.x, placement.scale.x * own.x + placement.offset.x, kRounding);
      EXPECT_NEAR(final.y, placement.scale.y * own.y + placement.offset.y, kRounding);
    }
  }
  // The root of the ratio of areas is the density that was asked for.
  for (std::uint32_t t = 0; t < surveyed.surfaces.size(); ++t) {
    const double metres = surveyed.surfaces.metres_per_unit;
    const double area = surveyed.surfaces.areas[t] * metres * metres;
    EXPECT_NEAR(std::sqrt(std::fabs(twice_area(layout.corners[t])) / 2 / area), 32, 1e-6);
  }
}

TEST(Layout, MixesRectanglesAndCharts) {
  Scene scene = room_of_instances();
  scene.meshes[3].texcoord1.clear();
  scene.meshes[4].texcoord1[1].x = 1.5;
  scene.meshes[5].texcoord1 = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};  // a bow tie: its triangles overlap
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Layout layout = make_layout(surveyed.surfaces, {}).value();
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    EXPECT_EQ(layout.meshes[m].source, m >= 3 && m <= 5 ? UvSource::kUnwrapped : UvSource::kPlaced) << m;
  }
  EXPECT_EQ(layout.num_charts, 3U);
  EXPECT_EQ(count_overlaps(surveyed.surfaces, layout), 0);
  ASSERT_EQ(layout.warnings.size(), 1U);
  EXPECT_EQ(layout.warnings[0].id, "lightmap_uv_unwrapped");
  // The mesh that never had a layout is not mentioned.
  EXPECT_THAT(layout.warnings[0].text, HasSubstr("2 objects"));
  EXPECT_THAT(layout.warnings[0].text, HasSubstr("'" + scene.meshes[4].name + "' has a TEXCOORD_1 (1.5"));
  EXPECT_THAT(layout.warnings[0].text, HasSubstr("'" + scene.meshes[5].name + "' with itself"));
}

TEST(Layout, HoldsTheMeshesOfAnObjectTogether) {
  // Two meshes of one object share a layout: left and right half.
  Scene scene = room_of_instances();
  for (int m = 0; m < 2; ++m) {
    scene.meshes[m].object = 77;
    const double x = 0.5 * m;
    scene.meshes[m].texcoord1 = {{x, 0}, {x + 0.5, 0}, {x + 0.5, 1}, {x, 1}};
  }
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Layout layout = make_layout(surveyed.surfaces, {}).value();
  EXPECT_EQ(layout.meshes[0].scale, layout.meshes[1].scale);
  EXPECT_EQ(layout.meshes[0].offset, layout.meshes[1].offset);
  EXPECT_EQ(count_overlaps(surveyed.surfaces, layout), 0);
}

TEST(Layout, RefusesToKeepWhatIsNotThere) {
  for (const bool is_missing : {true, false}) {
    Scene scene = room_of_instances();
    if (is_missing) {
      scene.meshes[3].texcoord1.clear();
    } else {
      scene.meshes[3].texcoord1 = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
    }
    const SurveyedScene surveyed = survey_scene(scene).value();
    const auto layout = make_layout(surveyed.surfaces, {.uv = LightmapUv::kKeep});
    ASSERT_FALSE(layout.ok());
    EXPECT_EQ(layout.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(layout.error().message, HasSubstr("'" + scene.meshes[3].name + "'"));
    EXPECT_THAT(layout.error().message, HasSubstr(is_missing ? "has no TEXCOORD_1" : "overlaps"));
  }
}

TEST(Layout, FillsSheetAfterSheet) {
  const Scene scene = room_of_instances();
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Layout layout = make_layout(surveyed.surfaces, {.sheet_size = 128, .texels_per_meter = 16}).value();
  EXPECT_EQ(layout.width, 128);
  EXPECT_EQ(layout.height, 128);
  EXPECT_GT(layout.num_sheets, 1);
  EXPECT_EQ(count_overlaps(surveyed.surfaces, layout), 0);
  std::set<int> used;
  for (const MeshPlacement& mesh : layout.meshes) used.insert(mesh.sheet);
  EXPECT_EQ(static_cast<int>(used.size()), layout.num_sheets);
}

TEST(Layout, MakesAnObjectCoarserThatFitsInNoSheet) {
  const Scene scene = room_of_instances();  // walls of up to 5 m
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Layout layout = make_layout(surveyed.surfaces, {.sheet_size = 64, .texels_per_meter = 32}).value();
  EXPECT_EQ(count_overlaps(surveyed.surfaces, layout), 0);
  EXPECT_THAT(warning_of(layout, "object_too_large"), HasSubstr("'" + scene.meshes[0].name + "'"));
}

TEST(Layout, LowersADensityThatNobodyAskedForAndRefusesOneThatSomebodyDid) {
  Scene scene = room_of_instances();
  for (Mesh& mesh : scene.meshes) {
    for (Vec3& p : mesh.positions) p *= 1000;  // a room in millimetres
  }
  scene.sky = {1, 1, 1};
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Layout layout = make_layout(surveyed.surfaces, {}).value();
  EXPECT_THAT(warning_of(layout, "texel_density_lowered"), HasSubstr("32 texels per metre"));
  EXPECT_LE(std::int64_t{layout.width} * layout.height * layout.num_sheets, kMaxTexels);
  const auto refused = make_layout(surveyed.surfaces, {.may_lower_density = false});
  ASSERT_FALSE(refused.ok());
  EXPECT_THAT(refused.error().message, HasSubstr("lower --texels-per-meter"));
}

TEST(Layout, GivesAMeshItsOwnDensity) {
  Scene scene = room_of_instances();
  scene.meshes[2].texel_density = 2;
  scene.meshes[5].texel_density = 0.5;
  const SurveyedScene surveyed = survey_scene(scene).value();
  for (const LightmapUv uv : {LightmapUv::kAuto, LightmapUv::kUnwrap}) {
    const Layout layout = make_layout(surveyed.surfaces, {.uv = uv, .texels_per_meter = 16}).value();
    for (std::uint32_t t = 0; t < surveyed.surfaces.size(); ++t) {
      const double metres = surveyed.surfaces.metres_per_unit;
      const double density =
          std::sqrt(std::fabs(twice_area(layout.corners[t])) / 2 / surveyed.surfaces.areas[t]) / metres;
      EXPECT_NEAR(density, 16 * scene.meshes[surveyed.surfaces.meshes[t]].texel_density, 1e-6);
    }
  }
}

/// Lays a scene out by unwrapping and holds what every unwrap must hold; prints what the layout is like.
void expect_sound_unwrap(const Scene& scene, double density, double least_fill) {
  const SurveyedScene surveyed = survey_scene(scene).value();
  Layout layout = make_layout(surveyed.surfaces, {.uv = LightmapUv::kUnwrap, .texels_per_meter = density}).value();
  EXPECT_TRUE(layout.warnings.empty());
  EXPECT_EQ(count_overlaps(surveyed.surfaces, layout), 0);
  EXPECT_EQ(count_shared_texels(surveyed.surfaces, layout), 0);
  const double stretch = worst_stretch(surveyed.surfaces, layout, density);
  constexpr double kRounding = 1e-6;
  EXPECT_LE(stretch, kMaxStretch + kRounding);
  EXPECT_NEAR(stretch, layout.max_stretch, 0.05) << "the reported stretch is a bound by charts";
  const std::uint64_t num_charts = layout.num_charts;
  const Atlas atlas = Atlas::make(surveyed.surfaces, std::move(layout)).value();
  std::cout << surveyed.surfaces.size() << " triangles: " << num_charts << " charts, " << atlas.width() << " x "
            << atlas.height() << ", stretch " << stretch << ", fill " << atlas.fill() << '\n';
  EXPECT_GE(atlas.fill(), least_fill);
}

// Asked of every layout that is sized here.
constexpr double kLeastFill = 0.6;

TEST(Unwrap, LaysASphereOutSoundly) { expect_sound_unwrap(scene_of(tests::make_sphere(24)), 128, kLeastFill); }

TEST(Unwrap, LaysAVaseOutSoundly) { expect_sound_unwrap(scene_of(tests::make_vase(48)), 256, kLeastFill); }

TEST(Unwrap, LaysAHallOfTwoHundredMeshesOutSoundly) {
  expect_sound_unwrap(tests::make_furnished_hall(), 32, kLeastFill);
}

TEST(Unwrap, MakesOneChartOfAFlatMesh) {
  // A grid of 20 x 20 quads, with holes.
  Mesh mesh;
  mesh.name = "grid";
  for (int y = 0; y <= 20; ++y) {
    for (int x = 0; x <= 20; ++x) mesh.positions.push_back({0.1 * x, 0, -0.1 * y});
  }
  for (std::uint32_t y = 0; y < 20; ++y) {
    for (std::uint32_t x = 0; x < 20; ++x) {
      if (x % 5 == 3 && y % 5 == 2) continue;
      const std::uint32_t v = 21 * y + x;
      mesh.triangles.push_back({v, v + 1, v + 22});
      mesh.triangles.push_back({v, v + 22, v + 21});
    }
  }
  const Scene scene = scene_of(std::move(mesh));
  const SurveyedScene surveyed = survey_scene(scene).value();
  const auto charts = unwrap(surveyed.surfaces, 0, static_cast<std::uint32_t>(surveyed.surfaces.size()), 0.01);
  ASSERT_EQ(charts.size(), 1U);
  EXPECT_NEAR(charts[0].stretch, 1, 1e-9);
  EXPECT_NEAR(charts[0].size.x * surveyed.surfaces.metres_per_unit, 2, 1e-9);
  EXPECT_NEAR(charts[0].size.y * surveyed.surfaces.metres_per_unit, 2, 1e-9);
}

TEST(Unwrap, CutsAChartThatWouldLieOnItself) {
  // A flat spiral stair that winds twice: every normal points up, and its second turn lies over the first.
  Mesh mesh;
  mesh.name = "ramp";
  constexpr int kSteps = 48;
  for (int i = 0; i <= kSteps; ++i) {
    const double angle = 4 * 3.14159265358979 * i / kSteps, height = 1.0 * i / kSteps;
    for (const double radius : {1.0, 2.0}) {
      mesh.positions.push_back({radius * std::cos(angle), height, -radius * std::sin(angle)});
    }
  }
  for (std::uint32_t i = 0; i < kSteps; ++i) {
    mesh.triangles.push_back({2 * i, 2 * i + 1, 2 * i + 3});
    mesh.triangles.push_back({2 * i, 2 * i + 3, 2 * i + 2});
  }
  const Scene scene = scene_of(std::move(mesh));
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Layout layout = make_layout(surveyed.surfaces, {}).value();
  EXPECT_GE(layout.num_charts, 2U);
  EXPECT_EQ(count_overlaps(surveyed.surfaces, layout), 0);
}

TEST(Unwrap, LooksAtFrontsSoThatNothingIsMirrored) {
  for (const Mesh& mesh : {tests::make_sphere(8), tests::make_vase(12)}) {
    const Scene scene = scene_of(mesh);
    const SurveyedScene surveyed = survey_scene(scene).value();
    const Layout layout = make_layout(surveyed.surfaces, {}).value();
    // Front faces turn counter-clockwise; with rows from the top that is a negative turn.
    for (const PlaneTriangle& corners : layout.corners) EXPECT_LT(twice_area(corners), 0);
  }
}

TEST(Clusters, NeverCrossASharpEdge) {
  const Scene scene = tests::make_furnished_hall();
  const SurveyedScene surveyed = survey_scene(scene).value();
  for (const MeshRange& range : mesh_ranges(surveyed.surfaces)) {
    const auto clusters = cluster_triangles(surveyed.surfaces, range.begin, range.end, 0.8, 0.7);
    EXPECT_EQ(clusters.size(), 6U);  // the sides of a box
  }
}

}  // namespace
}  // namespace radbake::radiosity
