// Charts that meet at a smooth edge, and light by vertex.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <map>
#include <tuple>

#include "tests/invariant/bake_support.h"
#include "tests/scenes/rooms.h"
#include "tests/scenes/solids.h"

namespace radbake::radiosity {
namespace {

/// A smooth sphere over a floor, under a sky and a sun from the side.
Scene sphere_on_floor() {
  Scene scene;
  scene.materials.emplace_back().reflectance = {0.6, 0.5, 0.4};
  scene.meshes.push_back(tests::make_sphere(24));
  Mesh& floor = scene.meshes.emplace_back();
  floor.name = "floor";
  floor.object = 1;
  floor.positions = {{-4, -1.2, -4}, {-4, -1.2, 4}, {4, -1.2, 4}, {4, -1.2, -4}};
  floor.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.lights.push_back({"sun", DirectionalLight{normalized(Vec3{-1, -0.7, 0.2}), {2, 2, 2}}});
  scene.sky = {1, 1, 1};
  return scene;
}

/// A bilinear look-up as a viewer makes it: texel centres at halves.
Vec3 looked_up(const Layer& map, double u, double v) {
  const double x = u * map.width - 0.5, y = v * map.height - 0.5;
  const int left = static_cast<int>(std::floor(x)), top = static_cast<int>(std::floor(y));
  Vec3 sum;
  for (int k = 0; k < 4; ++k) {
    const int column = std::clamp(left + k % 2, 0, map.width - 1), row = std::clamp(top + k / 2, 0, map.height - 1);
    const float* texel = &map.values[4 * (static_cast<std::size_t>(row) * map.width + column)];
    const double weight = (k % 2 ? x - left : 1 - (x - left)) * (k / 2 ? y - top : 1 - (y - top));
    sum += Vec3{texel[0], texel[1], texel[2]} * weight;
  }
  return sum;
}

TEST(SmoothSphere, AgreesAlongTheSeamsOfItsCharts) {
  constexpr double kAsked = 0.02;
  const Scene scene = sphere_on_floor();
  const BakeOutcome outcome = tests::baked(scene, {.texels_per_meter = 32, .rays = 256, .threads = 2});
  const LightmapSummary& summary = outcome.report.lightmap;
  EXPECT_GT(summary.num_charts, 6U);
  EXPECT_GT(summary.num_seam_samples, 500U);

  // Both sides of every edge that lies in the map twice, at its middle and quarters.
  const MeshOutput& sphere = outcome.meshes[0];
  ASSERT_EQ(sphere.placement.source, UvSource::kUnwrapped);
  using Place = std::tuple<double, double, double>;
  std::map<std::pair<Place, Place>, std::array<std::array<float, 2>, 2>> first_side;
  const auto place = [&](std::uint32_t vertex) {
    const Vec3 p = scene.meshes[0].positions[sphere.source_vertices[vertex]];
    return Place(p.x, p.y, p.z);
  };
  std::vector<double> differences;
  for (const auto& triangle : sphere.triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
      const bool is_turned = place(b) < place(a);
      const std::uint32_t low = is_turned ? b : a, high = is_turned ? a : b;
      const std::array<std::array<float, 2>, 2> uvs = {sphere.uvs[low], sphere.uvs[high]};
      const auto [other, is_first] = first_side.emplace(std::pair(place(low), place(high)), uvs);
      if (is_first || other->second == uvs) continue;
      for (const double s : {0.25, 0.5, 0.75}) {
        const auto at = [&](const auto& side) {
          return looked_up(outcome.layers[0], side[0][0] * (1 - s) + side[1][0] * s,
                           side[0][1] * (1 - s) + side[1][1] * s);
        };
        const Vec3 one = at(uvs), two = at(other->second);
        differences.push_back(std::fabs(mean_component(one - two)) / mean_component((one + two) / 2));
      }
    }
  }
  ASSERT_GT(differences.size(), 100U);
  std::sort(differences.begin(), differences.end());
  double squares = 0;
  for (const double d : differences) squares += d * d;
  const double rms = std::sqrt(squares / static_cast<double>(differences.size()));
  std::cout << differences.size() << " places on seams: rms " << 100 * rms << " %, 95th percentile "
            << 100 * differences[differences.size() * 95 / 100] << " %, worst " << 100 * differences.back()
            << " % of the local value; reported " << 100 * summary.seam_difference_before << " % before, "
            << 100 * summary.seam_difference << " % after\n";
  EXPECT_LT(rms, kAsked);
  EXPECT_LT(differences[differences.size() * 95 / 100], kAsked);
  EXPECT_LT(summary.seam_difference, kAsked);
  EXPECT_LT(summary.seam_difference, 0.5 * summary.seam_difference_before);
}

TEST(LightByVertex, IsEvenInAFurnace) {
  constexpr double kRoundingOfFloat = 1e-3;
  const BakeOutcome outcome =
      tests::baked(tests::furnace_room(0.5), {.rays = 64, .output = Output::kVertices, .threads = 2});
  EXPECT_TRUE(outcome.layers.empty());
  for (const MeshOutput& mesh : outcome.meshes) {
    ASSERT_EQ(mesh.irradiance.size(), 4U);
    EXPECT_TRUE(mesh.source_vertices.empty());
    for (const auto& h : mesh.irradiance) {
      for (const float value : h) EXPECT_NEAR(value / 2, 1, kRoundingOfFloat);
    }
  }
}

TEST(LightByVertex, SplitsAVertexAtCreasesAndKeepsTheOrderOfTheRest) {
  // A cube of eight vertices without normals, in the light of one sun from above.
  Scene scene;
  scene.materials.emplace_back().reflectance = {0, 0, 0};
  Mesh& cube = scene.meshes.emplace_back();
  cube.name = "cube";
  for (int v = 0; v < 8; ++v) cube.positions.push_back({double(v & 1), double(v >> 1 & 1), double(v >> 2)});
  cube.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  scene.lights.push_back({"sun", DirectionalLight{{0, -1, 0}, {3, 3, 3}}});
  const BakeOutcome outcome = tests::baked(scene, {.rays = 16, .output = Output::kVertices, .threads = 1});
  const MeshOutput& out = outcome.meshes[0];
  ASSERT_EQ(out.num_vertices, 24U);
  for (std::uint32_t v = 0; v < 24; ++v) {
    if (v < 8) {
      EXPECT_EQ(out.source_vertices[v], v);
    } else {
      EXPECT_LT(out.source_vertices[v], 8U);
    }
  }
  ASSERT_EQ(out.triangles.size(), cube.triangles.size());
  for (std::size_t t = 0; t < out.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(out.source_vertices[out.triangles[t][k]], cube.triangles[t][k]);
      // The top (triangles 6 and 7) takes the sun, every other side nothing.
      EXPECT_NEAR(out.irradiance[out.triangles[t][k]][1], t == 6 || t == 7 ? 3 : 0, 1e-5) << t;
    }
  }
}

TEST(LightByVertex, AgreesWithTheLightmap) {
  // A fine floor in a lit room: the light changes little from vertex to vertex.
  constexpr int kSide = 16;
  constexpr double kNoiseAndSmoothing = 0.05;
  tests::RoomBuilder builder(4);
  const int wall = builder.add_material("wall", {0.5, 0.5, 0.5});
  const int lamp = builder.add_material("lamp", {0, 0, 0}, {40, 40, 40});
  builder.add_box("room", {0, 0, 0}, {4, 3, 4}, wall, true);
  builder.add_quad("lamp", {1.5, 2.9, 1.5}, {1, 0, 0}, {0, 0, 1}, lamp);
  Scene scene = builder.scene();
  Mesh& floor = scene.meshes[0];
  ASSERT_EQ(floor.name, "room.bottom");
  const Mesh quad = floor;
  floor.positions.clear();
  floor.texcoord1.clear();
  floor.triangles.clear();
  for (int y = 0; y <= kSide; ++y) {
    for (int x = 0; x <= kSide; ++x) {
      const double s = double(x) / kSide, t = double(y) / kSide;
      floor.positions.push_back(quad.positions[0] + (quad.positions[1] - quad.positions[0]) * s +
                                (quad.positions[3] - quad.positions[0]) * t);
      floor.texcoord1.push_back(quad.texcoord1[0] + (quad.texcoord1[1] - quad.texcoord1[0]) * s +
                                (quad.texcoord1[3] - quad.texcoord1[0]) * t);
    }
  }
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      const std::uint32_t v = (kSide + 1) * y + x;
      floor.triangles.push_back({v, v + 1, v + kSide + 2});
      floor.triangles.push_back({v, v + kSide + 2, v + kSide + 1});
    }
  }
  const BakeOutcome outcome =
      tests::baked(scene, {.atlas_size = 256, .rays = 512, .output = Output::kBoth, .threads = 2});
  const MeshOutput& out = outcome.meshes[0];
  double worst = 0;
  for (std::uint32_t y = 1; y < kSide; ++y) {
    for (std::uint32_t x = 1; x < kSide; ++x) {
      const std::uint32_t v = (kSide + 1) * y + x;
      const Vec3 map = looked_up(outcome.layers[0], floor.texcoord1[v].x, floor.texcoord1[v].y);
      worst = std::max(worst, std::fabs(out.irradiance[v][0] / map.x - 1));
    }
  }
  EXPECT_LT(worst, kNoiseAndSmoothing);
}

}  // namespace
}  // namespace radbake::radiosity
