// Masks and tinted sheets through whole bakes: what passes them, and what they send on themselves.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/invariant/bake_support.h"
#include "tests/scenes/rooms.h"

namespace radbake::tests {
namespace {

using radiosity::BakeOptions;
using radiosity::BakeOutcome;

constexpr double kOnePercent = 0.01;
constexpr int kHoles = 16;  // along a side of a masked sheet, as many as webs

/// A checkerboard of holes and webs. Bilinear look-ups of it pass one half half-way between two texels, so just half of
/// the sheet is open.
TexturePlane checkerboard() {
  TexturePlane plane{.name = "holes", .width = 2 * kHoles, .height = 2 * kHoles, .channels = 4, .values = {}};
  for (int row = 0; row < plane.height; ++row) {
    for (int column = 0; column < plane.width; ++column) {
      const float alpha = (row + column) % 2 == 0 ? 1.0f : 0.0f;
      plane.values.insert(plane.values.end(), {1, 1, 1, alpha});
    }
  }
  return plane;
}

/// Makes the last mesh of a scene a checkerboard of holes.
void punch_holes(Scene& scene) {
  Mesh& sheet = scene.meshes.back();
  sheet.texcoord0 = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  Material& material = scene.materials[static_cast<std::size_t>(sheet.material)];
  material.alpha_mode = AlphaMode::kMask;
  scene.textures.push_back(checkerboard());
  material.reflectance_texture = TextureReference{static_cast<int>(scene.textures.size()) - 1, 0};
}

/// Mean irradiance of a mesh's texels, by its chart: RoomBuilder's cells, four a side.
Vec3 mean_of_cell(const BakeOutcome& outcome, int cell) {
  const radiosity::Layer& layer = outcome.layers.at(0);
  const int size = layer.width / 4, x0 = cell % 4 * size, y0 = cell / 4 * size;
  Vec3 sum;
  int count = 0;
  for_each_covered_texel(layer, [&](int x, int y, Vec3 h) {
    if (x < x0 || x >= x0 + size || y < y0 || y >= y0 + size) return;
    sum += h;
    ++count;
  });
  EXPECT_GT(count, 0);
  return sum / std::max(count, 1);
}

/// A black room of 10 x 2 x 10 m with a black sheet across it half-way up; the first quad is the floor.
struct BlackRoom {
  RoomBuilder builder{4};

  explicit BlackRoom(bool has_ceiling) {
    const int black = builder.add_material("black", {0, 0, 0});
    const int glowing = builder.add_material("glowing", {0, 0, 0}, {1000, 1000, 1000});
    builder.add_quad("floor", {0, 0, 0}, {0, 0, 10}, {10, 0, 0}, black);
    if (has_ceiling) builder.add_quad("ceiling", {0, 2, 0}, {10, 0, 0}, {0, 0, 10}, glowing);
  }
  Material& add_sheet() {
    const int sheet = builder.add_material("sheet", {0, 0, 0});
    builder.add_quad("sheet", {0, 1, 0}, {0, 0, 10}, {10, 0, 0}, sheet);
    return builder.scene().materials[static_cast<std::size_t>(sheet)];
  }
};
const BakeOptions kOptions{.atlas_size = 256, .rays = 256};

TEST(SeeThrough, RegularHolesOfOneHalfPassHalfOfTheSun) {
  BlackRoom room(false);
  room.add_sheet();
  punch_holes(room.builder.scene());
  room.builder.scene().lights.push_back({"sun", DirectionalLight{{0, -1, 0}, {1000, 1000, 1000}}});
  EXPECT_NEAR(mean_of_cell(baked(room.builder.scene(), kOptions), 0).x, 500, 500 * kOnePercent);
}

// The ceiling glows too widely to be sampled as an emitter: its light comes by the rays of rows.
TEST(SeeThrough, RegularHolesOfOneHalfPassHalfOfWhatSurfacesSend) {
  const double without = mean_of_cell(baked(BlackRoom(true).builder.scene(), kOptions), 0).x;
  BlackRoom room(true);
  room.add_sheet();
  punch_holes(room.builder.scene());
  const BakeOutcome outcome = baked(room.builder.scene(), kOptions);
  EXPECT_EQ(outcome.report.plan.survey.num_emitter_triangles, 0u);
  // Light that comes aslant passes as much: holes without depth.
  EXPECT_NEAR(mean_of_cell(outcome, 0).x / without, 0.5, 0.5 * kOnePercent);
}

TEST(SeeThrough, ATintedSheetColoursWhatSurfacesSend) {
  const double without = mean_of_cell(baked(BlackRoom(true).builder.scene(), kOptions), 0).x;
  BlackRoom room(true);
  room.add_sheet().transmittance = {0.9, 0.5, 0.25};
  const Vec3 h = mean_of_cell(baked(room.builder.scene(), kOptions), 0);
  EXPECT_NEAR(h.x / without, 0.9, 0.9 * kOnePercent);
  EXPECT_NEAR(h.y / without, 0.5, 0.5 * kOnePercent);
  EXPECT_NEAR(h.z / without, 0.25, 0.25 * kOnePercent);
}

/// E = 1 everywhere with one reflectance: H = E / (1 - rho), wherever sheets stand and whatever passes them.
Scene furnace_with_sheet(Vec3 transmittance, bool has_holes) {
  Scene scene = furnace_room(0.5);
  RoomBuilder builder(4);
  builder.scene() = scene;
  const Vec3 opaque = Vec3{1, 1, 1} - transmittance;
  const int sheet = builder.add_material("sheet", opaque * 0.5, {1, 1, 1}, true);
  builder.scene().materials.back().transmittance = transmittance;
  Mesh mesh;
  mesh.name = "sheet";
  mesh.material = sheet;
  mesh.positions = {{0.5, 2, 0.5}, {3.5, 2, 0.5}, {3.5, 2.2, 4.5}, {0.5, 2.2, 4.5}};
  mesh.texcoord1 = {{0.78, 0.78}, {0.97, 0.78}, {0.97, 0.97}, {0.78, 0.97}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  builder.scene().meshes.push_back(mesh);
  if (has_holes) punch_holes(builder.scene());
  return builder.scene();
}

void expect_furnace(const Scene& scene) {
  constexpr double kRoundingOfFloat = 1e-3;
  const BakeOutcome outcome = baked(scene, {.atlas_size = 64, .rays = 64});
  double worst = 0;
  int texels = 0;
  for_each_covered_texel(outcome.layers.at(0), [&](int, int, Vec3 h) {
    ++texels;
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::fabs(h[c] / 2 - 1));
  });
  EXPECT_GT(texels, 1000);
  EXPECT_LE(worst, kRoundingOfFloat);
}

TEST(SeeThrough, AFurnaceStaysOneWithAMaskedSheetInIt) { expect_furnace(furnace_with_sheet({}, true)); }
TEST(SeeThrough, AFurnaceStaysOneWithATintedSheetInIt) { expect_furnace(furnace_with_sheet({0.7, 0.4, 0.1}, false)); }
TEST(SeeThrough, AFurnaceStaysOneWithAClearSheetInIt) { expect_furnace(furnace_with_sheet({0.6, 0.6, 0.6}, false)); }

// A panel full of holes sends half of what it would without: the balance of a closed room holds within 3 standard
// errors.
TEST(SeeThrough, AMaskedEmitterKeepsTheEnergyOfARoom) {
  RoomBuilder builder(4);
  builder.add_box("room", {0, 0, 0}, {4, 3, 5}, builder.add_material("grey", {0.5, 0.5, 0.5}), true);
  const int lamp = builder.add_material("lamp", {0.5, 0.5, 0.5}, {1000, 1000, 1000}, true);
  builder.add_quad("panel", {2, 2, 2}, {0.5, 0, 0}, {0, 0, 0.5}, lamp);
  punch_holes(builder.scene());
  const auto energy = baked(builder.scene(), {.atlas_size = 64, .rays = 256}).report.energy;
  EXPECT_TRUE(energy.is_closed);
  EXPECT_NEAR(energy.emitted / (2 * 0.25 * 0.5 * 1000), 1, 0.05);
  EXPECT_LE(std::fabs(energy.gap), 3 * energy.gap_standard_error);
  EXPECT_LT(energy.gap_standard_error, 0.02 * energy.emitted);
}

TEST(SeeThrough, IsRefusedByFormFactorsByFormula) {
  BlackRoom room(true);
  room.add_sheet().transmittance = {0.5, 0.5, 0.5};
  const Scene scene = room.builder.scene();
  BakeOptions options = kOptions;
  options.form_factors = radiosity::FormFactors::kAnalytic;
  const auto planned = radiosity::plan_scene(scene, options);
  ASSERT_FALSE(planned.ok());
  EXPECT_NE(planned.error().message.find("--form-factors analytic"), std::string::npos) << planned.error().message;
}

// All light is direct and indirect light: layer by layer, and their sum to single precision.
TEST(Layers, DirectAndIndirectAddUpToAllLight) {
  BakeOptions options{.atlas_size = 128, .rays = 64};
  options.wants_direct = options.wants_indirect = true;
  const BakeOutcome outcome = baked(small_emitter_room(0.5), options);
  ASSERT_EQ(outcome.layers.size(), 4u);
  EXPECT_EQ(outcome.layers[1].name, "lightmap_0_direct");
  EXPECT_EQ(outcome.layers[2].name, "lightmap_0_indirect");
  double direct = 0, indirect = 0;
  for (std::size_t at = 0; at < outcome.layers[0].values.size(); ++at) {
    const double all = outcome.layers[0].values[at];
    if (at % 4 == 3) continue;
    constexpr double kFloat = 1e-6;
    // Seams are levelled layer by layer: charts of this room have none.
    EXPECT_NEAR(outcome.layers[1].values[at] + outcome.layers[2].values[at], all, kFloat * (1 + all));
    direct += outcome.layers[1].values[at];
    indirect += outcome.layers[2].values[at];
  }
  EXPECT_GT(direct, 0);
  EXPECT_GT(indirect, 0);
}

// In a furnace that emits, E is direct light and what is reflected of it is indirect: 1 and 1 of 2.
TEST(Layers, WhatSurfacesEmitIsDirectLight) {
  BakeOptions options{.atlas_size = 64, .rays = 64};
  options.wants_direct = options.wants_indirect = true;
  const BakeOutcome outcome = baked(furnace_room(0.5), options);
  for_each_covered_texel(outcome.layers.at(1), [&](int, int, Vec3 h) { EXPECT_NEAR(h.x, 1, 1e-3); });
  for_each_covered_texel(outcome.layers.at(2), [&](int, int, Vec3 h) { EXPECT_NEAR(h.x, 1, 1e-3); });
}

// Over a floor with a ceiling at height h, what lies within a distance d is seen at angles below acos(h / d):
// openness = 1 - sin^2 = (h / d)^2; none where d < h.
TEST(Layers, AmbientOcclusionIsTheOpenShareOfTheLobe) {
  RoomBuilder builder(4);
  const int grey = builder.add_material("grey", {0.5, 0.5, 0.5});
  builder.add_quad("floor", {-0.5, 0, -0.5}, {0, 0, 1}, {1, 0, 0}, grey);
  builder.add_quad("ceiling", {-40, 2, -40}, {80, 0, 0}, {0, 0, 80}, grey);
  builder.scene().sky = {1, 1, 1};
  BakeOptions options{.atlas_size = 256, .rays = 1024};
  options.wants_ao = true;
  for (const double distance : {1.0, 2.5, 4.0}) {
    options.ao_distance = distance;
    const BakeOutcome outcome = baked(builder.scene(), options);
    ASSERT_EQ(outcome.layers.size(), 3u);
    EXPECT_EQ(outcome.layers[1].name, "lightmap_0_ao");
    const double exact = distance < 2 ? 1 : 4 / (distance * distance);
    double sum = 0;
    int count = 0;
    for_each_covered_texel(outcome.layers[1], [&](int x, int y, Vec3 open) {
      if (x >= 64 || y >= 64) return;
      sum += open.x;
      ++count;
    });
    EXPECT_NEAR(sum / count, exact, 0.005) << distance;
  }
}

}  // namespace
}  // namespace radbake::tests
