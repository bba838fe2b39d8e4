#include "server/radiosity/patches/patches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"
#include "tests/unit/radiosity/cut_scene.h"

namespace radbake::radiosity {
namespace {

double total_area(const Patches& patches) {
  double area = 0;
  for (std::uint32_t i = 0; i < patches.num_cells(); ++i) area += patches.area(i);
  return area;
}

constexpr double kRounding = 1e-9;

TEST(Patches, TileTheSurfaceAndFindTheirOwnSamples) {
  const CutScene cut(tests::furnace_room(0.5), 0.25, 10000);
  const double area = std::accumulate(cut.surveyed.surfaces.areas.begin(), cut.surveyed.surfaces.areas.end(), 0.0);
  EXPECT_NEAR(total_area(cut.patches) / area, 1, kRounding);
  int strays = 0;
  for (std::uint32_t i = 0; i < cut.patches.size(); ++i) {
    for (const double x : {0.0137, 0.317, 0.621, 0.989}) {
      const SurfacePoint p = cut.patches.sample(i, x, 0.4);
      strays += cut.patches.find(p.triangle, p.u, p.v, cut.patches.is_back(i)) != i;
    }
  }
  EXPECT_EQ(strays, 0);
  // A wall of 4 x 3 m is a regular grid of 16 x 12.
  EXPECT_NEAR(cut.patches.area(0) * cut.surveyed.surfaces.metres_per_unit * cut.surveyed.surfaces.metres_per_unit,
              0.25 * 0.25, kRounding);
}

TEST(Patches, OfSingleSidedSurfacesHaveNoBack) {
  const CutScene cut(tests::furnace_room(0.5), 0.5, 10000);
  EXPECT_EQ(cut.patches.size(), cut.patches.num_cells());
  EXPECT_EQ(cut.patches.find(0, 0.3, 0.3, true), kNoPatch);
}

TEST(Patches, OfDoubleSidedSurfacesHaveAPatchOnEachSide) {
  Scene scene = tests::furnace_room(0.5);
  for (Material& material : scene.materials) material.is_double_sided = true;
  const CutScene cut(std::move(scene), 0.5, 10000);
  EXPECT_EQ(cut.patches.size(), 2 * cut.patches.num_cells());
  const std::uint32_t back = cut.patches.find(0, 0.3, 0.3, true);
  EXPECT_TRUE(cut.patches.is_back(back));
  EXPECT_EQ(cut.patches.area(back), cut.patches.area(cut.patches.find(0, 0.3, 0.3, false)));
}

TEST(Patches, KeepTheBoundForAMillionSlivers) {
  // Unconnected slivers in all directions: nothing to merge by neighbourhood.
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  Scene scene;
  Material straw;
  straw.emissive = {1, 1, 1};
  scene.materials.push_back(straw);
  Mesh mesh;
  mesh.name = "straw";
  constexpr std::uint32_t kSlivers = 1'000'000;
  for (std::uint32_t i = 0; i < kSlivers; ++i) {
    const Vec3 a{10 * any(random), 10 * any(random), 10 * any(random)};
    const Vec3 along{0.1 * any(random), 0.1 * any(random), 0.1 * any(random)};
    const Vec3 aside{0.001 * any(random), 0.001 * any(random), 0.001 * any(random)};
    mesh.positions.insert(mesh.positions.end(), {a, a + along, a + aside});
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  scene.meshes.push_back(std::move(mesh));
  const CutScene cut(std::move(scene), 0.01, 4096);
  EXPECT_LE(cut.patches.size(), 4096u);
  EXPECT_GE(cut.patches.size(), 500u);
  const double area = std::accumulate(cut.surveyed.surfaces.areas.begin(), cut.surveyed.surfaces.areas.end(), 0.0);
  EXPECT_NEAR(total_area(cut.patches) / area, 1, 1e-6);
}

TEST(Patches, KeepTheSmallestBoundForManyMaterials) {
  Scene scene = tests::furnace_room(0.5);
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    scene.materials.push_back(scene.materials[0]);
    scene.meshes[m].material = static_cast<int>(scene.materials.size()) - 1;
  }
  EXPECT_LE(CutScene(std::move(scene), 0.01, 64).patches.size(), 64u);
}

TEST(Patches, AreCutWhereAWallStandsOnTheFloor) {
  // A floor of 4 x 4 m cut into one cell; a wall across it at x = 1.5, from end to end.
  tests::RoomBuilder builder(4);
  const int grey = builder.add_material("grey", {0.5, 0.5, 0.5}, {1, 1, 1});
  builder.add_quad("floor", {0, 0, 0}, {0, 0, 4}, {4, 0, 0}, grey);
  builder.add_quad("wall", {1.5, 0, 0}, {0, 0, 4}, {0, 2, 0}, grey);
  const CutScene cut(builder.scene(), 4, 64);
  std::set<std::uint32_t> left, right;
  for (std::uint32_t t = 0; t < 2; ++t) {
    for (double u = 0.05; u < 1; u += 0.1) {
      for (double v = 0.05; u + v < 1; v += 0.1) {
        const double x = cut.surveyed.surfaces.position({t, u, v}).x * cut.surveyed.surfaces.metres_per_unit +
                         cut.surveyed.surfaces.centre.x;
        (x < 1.5 ? left : right).insert(cut.patches.find(t, u, v, false));
      }
    }
  }
  ASSERT_EQ(left.size(), 1u);
  ASSERT_EQ(right.size(), 1u);
  EXPECT_NE(*left.begin(), *right.begin());
  EXPECT_NEAR(cut.patches.area(*left.begin()) / cut.patches.area(*right.begin()), 1.5 / 2.5, kRounding);
}

TEST(Patches, AreCutWhereAWallStandsOnASideBetweenTwoTrianglesOfTheFloor) {
  // The floor's own triangulation runs along the wall: its diagonal.
  tests::RoomBuilder builder(4);
  const int grey = builder.add_material("grey", {0.5, 0.5, 0.5}, {1, 1, 1});
  builder.add_quad("floor", {0, 0, 0}, {0, 0, 4}, {4, 0, 0}, grey);
  builder.add_quad("wall", {0, 0, 0}, {4, 0, 4}, {0, 2, 0}, grey);
  const CutScene cut(builder.scene(), 4, 64);
  EXPECT_NE(cut.patches.find(0, 0.3, 0.3, false), cut.patches.find(1, 0.3, 0.3, false));
}

// A hilly surface is many groups that border on each other; borders are no contacts.
TEST(Patches, OfAHillySurfaceAreNotCutWhereItsGroupsMeet) {
  constexpr std::uint32_t kSide = 40;
  Scene scene;
  scene.materials.push_back(Material{});
  scene.materials[0].emissive = {1, 1, 1};
  Mesh hills;
  for (std::uint32_t z = 0; z <= kSide; ++z) {
    for (std::uint32_t x = 0; x <= kSide; ++x) {
      hills.positions.push_back({0.25 * x, std::sin(0.7 * x) * std::cos(0.9 * z), 0.25 * z});
    }
  }
  for (std::uint32_t z = 0; z < kSide; ++z) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const std::uint32_t i = z * (kSide + 1) + x, below = i + kSide + 1;
      hills.triangles.push_back({i, below, i + 1});
      hills.triangles.push_back({i + 1, below, below + 1});
    }
  }
  scene.meshes.push_back(hills);
  // Room for no cut at all: were borders contacts, cells would be left uncut and counted.
  const std::size_t num_patches = CutScene(scene, 1, 100000).patches.size();
  EXPECT_LE(num_patches, 3200u);
  const CutScene cut(scene, 1, 4096);
  EXPECT_EQ(cut.patches.num_uncut(), 0u);
  EXPECT_EQ(cut.patches.size(), num_patches);
  for (std::uint32_t i = 0; i < cut.patches.size(); ++i) EXPECT_GT(cut.patches.area(i), 0);
}

// The quick look-up is the exact one wherever it dares to answer: at contacts, borders of patches, grazing rays, backs.
TEST(Patches, AreFoundQuicklyAsTheyAreFoundExactly) {
  for (const bool is_double_sided : {false, true}) {
    tests::RoomBuilder builder(4);
    const int grey = builder.add_material("grey", {0.5, 0.5, 0.5}, {1, 1, 1}, is_double_sided);
    builder.add_box("room", {0, 0, 0}, {4, 3, 5}, grey, true);
    builder.add_box("block", {1.03, 0, 1.51}, {2.2, 1.3, 2.7}, grey, false);
    const auto checked = survey_scene(builder.scene());
    ASSERT_TRUE(checked.ok()) << checked.error().message;
    const CutScene cut(builder.scene(), 0.25, 10000);
    const Surfaces& surfaces = cut.surveyed.surfaces;
    std::mt19937_64 random(7);
    std::uniform_real_distribution<float> any(-1, 1), weight(0, 1);
    int differences = 0;
    for (int k = 0; k < 200'000; ++k) {
      Hit hit{static_cast<std::uint32_t>(random() % surfaces.corners.size()), weight(random), weight(random)};
      if (hit.u + hit.v > 1) hit.u = 1 - hit.u, hit.v = 1 - hit.v;
      Vec3 direction{any(random), any(random), any(random)};
      if (k % 3 == 0)
        direction =
            direction - surfaces.normals[hit.triangle] * dot(direction, surfaces.normals[hit.triangle]) * (1 - 1e-3);
      direction = normalized(direction);
      const std::array<float, 3> rounded{static_cast<float>(direction.x), static_cast<float>(direction.y),
                                         static_cast<float>(direction.z)};
      const Vec3 exactly{rounded[0], rounded[1], rounded[2]};
      const Patches::Meeting met = cut.patches.meet(hit, rounded, surfaces);
      differences += met.patch != cut.patches.met_by(hit, exactly, surfaces);
      differences += met.is_back != (dot(exactly, surfaces.normals[hit.triangle]) > 0);
    }
    EXPECT_EQ(differences, 0);
  }
}

}  // namespace
}  // namespace radbake::radiosity
