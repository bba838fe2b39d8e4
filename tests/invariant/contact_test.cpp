// What stands on a surface: walls without thickness, boxes. No light leaks, no halo.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>

#include "tests/invariant/bake_support.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

constexpr double kHeight = 2.5, kDepth = 4, kWidth = 3;

enum class Floor { kOnePerRoom, kOneForBoth };

/// Two rooms side by side along x, [-3, 0] and [0, 3], with a wall of zero thickness at x = 0; a lamp panel below the
/// ceiling of the left one.
Scene two_rooms(Floor floor) {
  tests::RoomBuilder builder(4);
  const int wall = builder.add_material("wall", {0.7, 0.7, 0.7});
  const int sheet = builder.add_material("sheet", {0.7, 0.7, 0.7}, {}, true);
  const int lamp = builder.add_material("lamp", {0, 0, 0}, {50, 50, 50});
  const Vec3 up{0, kHeight, 0}, z{0, 0, kDepth};
  const auto floor_and_ceiling = [&](const std::string& name, double low, double high) {
    const Vec3 x{high - low, 0, 0};
    builder.add_quad(name + " floor", {low, 0, 0}, z, x, wall);
    builder.add_quad(name + " ceiling", {low, kHeight, 0}, x, z, wall);
  };
  if (floor == Floor::kOneForBoth) {
    floor_and_ceiling("both", -kWidth, kWidth);
  } else {
    floor_and_ceiling("left", -kWidth, 0);
    floor_and_ceiling("right", 0, kWidth);
  }
  for (const double low : {-kWidth, 0.0}) {
    const std::string name = low < 0 ? "left" : "right";
    const Vec3 x{kWidth, 0, 0};
    builder.add_quad(name + " back", {low, 0, 0}, x, up, wall);
    builder.add_quad(name + " front", {low, 0, kDepth}, up, x, wall);
  }
  builder.add_quad("left end", {-kWidth, 0, 0}, up, z, wall);
  builder.add_quad("right end", {kWidth, 0, 0}, z, up, wall);
  builder.add_quad("between", {0, 0, 0}, z, up, sheet);
  builder.add_quad("lamp", {-2, kHeight - 0.01, 1.5}, {1, 0, 0}, {0, 0, 1}, lamp);
  return builder.scene();
}

/// Texels of a bake that a mesh covers, with the places of their corners in world x.
struct SeenTexel {
  double low_x, high_x;
  double value;  // mean of the channels, lx
};

/// The texels of a quad that its own layout maps affinely: world x of each texel's four corners.
std::vector<SeenTexel> texels_of(const Scene& scene, const Layer& map, const std::string& name) {
  std::vector<SeenTexel> seen;
  for (const Mesh& mesh : scene.meshes) {
    if (mesh.name != name) continue;
    const Vec2 o = mesh.texcoord1[0] * map.width, s = (mesh.texcoord1[1] - mesh.texcoord1[0]) * map.width,
               t = (mesh.texcoord1[3] - mesh.texcoord1[0]) * map.width;
    for (int y = 0; y < map.height; ++y) {
      for (int x = 0; x < map.width; ++x) {
        const float* texel = &map.values[4 * (static_cast<std::size_t>(y) * map.width + x)];
        if (texel[3] == 0) continue;
        double low = 1e9, high = -1e9;
        bool is_inside = false;
        for (int k = 0; k < 5; ++k) {
          const Vec2 p = (k == 4 ? Vec2{x + 0.5, y + 0.5} : Vec2{x + k % 2 * 1.0, y + k / 2 * 1.0}) - o;
          const double a = cross(p, t) / cross(s, t), b = cross(s, p) / cross(s, t);
          const double world = mesh.positions[0].x + a * (mesh.positions[1].x - mesh.positions[0].x) +
                               b * (mesh.positions[3].x - mesh.positions[0].x);
          low = std::min(low, world);
          high = std::max(high, world);
          constexpr double kOneTexel = 0.05;
          is_inside = is_inside || (a > -kOneTexel && a < 1 + kOneTexel && b > -kOneTexel && b < 1 + kOneTexel);
        }
        if (is_inside) seen.push_back({low, high, (texel[0] + texel[1] + texel[2]) / 3.0});
      }
    }
  }
  return seen;
}

BakeOptions options_of(int atlas_size, int rays) {
  BakeOptions options;
  options.atlas_size = atlas_size;
  options.rays = rays;
  options.threads = 2;
  return options;
}

TEST(WallOfZeroThickness, LetsNothingThroughBetweenRoomsWithTheirOwnFloors) {
  const Scene scene = two_rooms(Floor::kOnePerRoom);
  for (const int atlas_size : {128, 250}) {
    const BakeOutcome outcome = tests::baked(scene, options_of(atlas_size, 128));
    for (const std::string name : {"right floor", "right ceiling", "right back", "right front", "right end"}) {
      const auto texels = texels_of(scene, outcome.layers[0], name);
      ASSERT_GT(texels.size(), 100U);
      for (const SeenTexel& texel : texels) EXPECT_EQ(texel.value, 0) << name;
    }
    for (const SeenTexel& texel : texels_of(scene, outcome.layers[0], "left floor")) EXPECT_GT(texel.value, 0);
  }
}

TEST(WallOfZeroThickness, LetsNothingThroughOverOneFloor) {
  const Scene scene = two_rooms(Floor::kOneForBoth);
  for (const int atlas_size : {128, 250}) {
    const BakeOutcome outcome = tests::baked(scene, options_of(atlas_size, 128));
    for (const std::string name : {"both floor", "both ceiling"}) {
      const auto texels = texels_of(scene, outcome.layers[0], name);
      ASSERT_GT(texels.size(), 100U);
      for (const SeenTexel& texel : texels) {
        // Clearly: a sliver of less than an eighth of a texel is too little to be told from nothing.
        constexpr double kRounding = 1e-9, kSliver = 0.125;
        const double dark_share = texel.high_x / (texel.high_x - texel.low_x);
        if (texel.low_x > -kRounding) {
          EXPECT_EQ(texel.value, 0) << name << " at " << texel.low_x;
        } else if (dark_share > 2 * kSliver) {
          EXPECT_EQ(texel.value, 0) << name << ": a bright fringe in the dark room at " << texel.low_x;
        } else if (texel.high_x < -kRounding) {
          EXPECT_GT(texel.value, 0) << name << " at " << texel.low_x;
        }
      }
    }
    for (const std::string name : {"right back", "right front", "right end"}) {
      for (const SeenTexel& texel : texels_of(scene, outcome.layers[0], name)) EXPECT_EQ(texel.value, 0) << name;
    }
  }
}

/// A floor of 4 x 4 m under a sky, and a box of 1 x 1 x 1 m on it that no grid line meets. `is_cut`: the floor is made
/// of the four pieces around the box, laid out as the whole floor is.
Scene box_on_floor(bool is_double_sided, double sunk, bool is_cut) {
  constexpr double kLow = 1.53, kHigh = 2.59;  // of the box, along x and z
  Scene scene;
  const auto add_material = [&](Vec3 reflectance, bool is_double) {
    Material& material = scene.materials.emplace_back();
    material.reflectance = reflectance;
    material.is_double_sided = is_double;
  };
  add_material({0.5, 0.5, 0.5}, false);
  add_material({0.6, 0.3, 0.2}, is_double_sided);
  const auto add_floor = [&](double x0, double z0, double x1, double z1) {
    Mesh& mesh = scene.meshes.emplace_back();
    mesh.name = "floor";
    mesh.positions = {{x0, 0, z0}, {x0, 0, z1}, {x1, 0, z1}, {x1, 0, z0}};
    for (const Vec3 p : mesh.positions) mesh.texcoord1.push_back({p.x / 4 * 0.5, p.z / 4 * 0.5});
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  };
  if (is_cut) {
    add_floor(0, 0, 4, kLow);
    add_floor(0, kHigh, 4, 4);
    add_floor(0, kLow, kLow, kHigh);
    add_floor(kHigh, kLow, 4, kHigh);
  } else {
    add_floor(0, 0, 4, 4);
  }
  tests::RoomBuilder builder(4);
  builder.add_box("box", {kLow, -sunk, kLow}, {kHigh, 1 - sunk, kHigh}, 1, false);
  for (Mesh mesh : builder.scene().meshes) {
    for (Vec2& uv : mesh.texcoord1) uv = {0.5 + uv.x / 2, 0.5 + uv.y / 2};
    scene.meshes.push_back(std::move(mesh));
  }
  scene.sky = {1, 1, 1};
  return scene;
}

TEST(BoxOnTheFloor, LeavesNoHalo) {
  // Both maps are estimates: with these rays a texel's standard error is about 0.3 %, at the contact 0.5 %, and the
  // worst of two thousand differences is about four times that.
  constexpr int kRays = 4096, kAtlas = 96;
  constexpr double kAllowed = 0.02;
  const BakeOutcome reference = tests::baked(box_on_floor(false, 0, true), options_of(kAtlas, kRays));
  const std::vector<float>& expected = reference.layers[0].values;
  for (const bool is_double_sided : {false, true}) {
    for (const double sunk : {0.0, 0.01}) {
      const BakeOutcome outcome = tests::baked(box_on_floor(is_double_sided, sunk, false), options_of(kAtlas, kRays));
      const std::vector<float>& values = outcome.layers[0].values;
      double worst = 0;
      int lit = 0, around = 0;
      for (int y = 0; y < kAtlas / 2; ++y) {
        for (int x = 0; x < kAtlas / 2; ++x) {
          const std::size_t at = 4 * (static_cast<std::size_t>(y) * kAtlas + x);
          if (expected[at + 3] == 0) continue;  // wholly under the box
          const double difference = std::fabs(values[at] - expected[at]) / expected[at];
          worst = std::max(worst, difference);
          ++lit;
          around += expected[at + 3] < 0.999;
        }
      }
      std::cout << (is_double_sided ? "double" : "single") << "-sided, sunk by " << sunk << " m: worst of " << lit
                << " lit texels " << 100 * worst << " %, of them " << around << " at the contact\n";
      EXPECT_GT(around, 30);
      EXPECT_LT(worst, kAllowed);
    }
  }
}

}  // namespace
}  // namespace radbake::radiosity
