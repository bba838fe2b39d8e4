// Leaves and curtains through whole bakes: what they let through scattered.
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
constexpr double kSinglePrecision = 1e-5;

/// Irradiance at the texels of a chart: RoomBuilder's cells, four a side.
std::vector<Vec3> texels_of_cell(const BakeOutcome& outcome, int cell) {
  const radiosity::Layer& layer = outcome.layers.at(0);
  const int size = layer.width / 4, x0 = cell % 4 * size, y0 = cell / 4 * size;
  std::vector<Vec3> texels;
  for_each_covered_texel(layer, [&](int x, int y, Vec3 h) {
    if (x >= x0 && x < x0 + size && y >= y0 && y < y0 + size) texels.push_back(h);
  });
  EXPECT_FALSE(texels.empty());
  return texels;
}

int add_leaf(RoomBuilder& builder, Vec3 reflectance, Vec3 transmittance) {
  const int leaf = builder.add_material("leaf", reflectance, {}, true);
  builder.scene().materials[static_cast<std::size_t>(leaf)].diffuse_transmittance = transmittance;
  return leaf;
}

// A lone leaf under the sun: (rho H + tau H_opp) / (rho + tau), with the sun on either side.
TEST(DiffuseTransmission, LightsALeafFromBehind) {
  const Vec3 rho{0.5, 0.25, 0.125}, tau{0.25, 0.5, 0};
  for (const bool is_behind : {false, true}) {
    RoomBuilder builder(4);
    builder.add_quad("leaf", {0, 0, 0}, {0, 0, 1}, {1, 0, 0}, add_leaf(builder, rho, tau));
    builder.scene().lights.push_back(
        {"sun", DirectionalLight{normalized({0.6, is_behind ? 0.8 : -0.8, 0}), {1000, 1000, 1000}}});
    for (const Vec3 h : texels_of_cell(baked(builder.scene(), {.atlas_size = 64, .rays = 64}), 0)) {
      for (int c = 0; c < 3; ++c) {
        const double exact = 800 * (is_behind ? tau[c] : rho[c]) / (rho[c] + tau[c]);
        ASSERT_NEAR(h[c], exact, kSinglePrecision * 800);
      }
    }
  }
}

/// Form factor from a point to a parallel square of side 2 a about the foot of its normal at height h.
double point_to_square(double a, double h) {
  const double x = a / h, root = std::sqrt(1 + x * x);
  return 4 / (2 * std::numbers::pi) * 2 * (x / root) * std::atan(x / root);
}

// The slab: the sun behind a black sheet that scatters tau of it; below its middle a floor gets tau E F.
TEST(DiffuseTransmission, ASlabSendsItsShareOfTheSunOn) {
  constexpr double kSun = 1000, kSide = 4, kHeight = 1;
  const Vec3 tau{0.8, 0.4, 0.1};
  RoomBuilder builder(4);
  const int black = builder.add_material("black", {0, 0, 0});
  builder.add_quad("floor", {-0.05, 0, -0.05}, {0, 0, 0.1}, {0.1, 0, 0}, black);
  builder.add_quad("sheet", {-kSide / 2, kHeight, -kSide / 2}, {0, 0, kSide}, {kSide, 0, 0},
                   add_leaf(builder, {0, 0, 0}, tau));
  builder.scene().lights.push_back({"sun", DirectionalLight{{0, -1, 0}, {kSun, kSun, kSun}}});
  const BakeOutcome outcome = baked(builder.scene(), {.atlas_size = 256, .rays = 4096});
  Vec3 mean;
  const std::vector<Vec3> texels = texels_of_cell(outcome, 0);
  for (const Vec3 h : texels) mean += h / static_cast<double>(texels.size());
  // The floor is small: at its border the form factor is 0.1 % less than in the middle.
  const double share = point_to_square(kSide / 2, kHeight);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(mean[c], tau[c] * kSun * share, kOnePercent * tau[c] * kSun * share);
}

// In a furnace of B = E / (1 - rho) = 2 a sheet that passes on as much as the walls in all, and glows as they do,
// changes nothing.
TEST(DiffuseTransmission, AFurnaceStaysOneWithALeafInIt) {
  RoomBuilder builder(4);
  builder.scene() = furnace_room(0.5);
  const int leaf = builder.add_material("leaf", {0.2, 0.3, 0.4}, {1, 1, 1}, true);
  builder.scene().materials.back().diffuse_transmittance = {0.3, 0.2, 0.1};
  Mesh mesh;
  mesh.name = "leaf";
  mesh.material = leaf;
  mesh.positions = {{0.5, 2, 0.5}, {3.5, 2, 0.5}, {3.5, 2.2, 4.5}, {0.5, 2.2, 4.5}};
  mesh.texcoord1 = {{0.78, 0.78}, {0.97, 0.78}, {0.97, 0.97}, {0.78, 0.97}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  builder.scene().meshes.push_back(mesh);
  double worst = 0;
  const BakeOutcome outcome = baked(builder.scene(), {.atlas_size = 64, .rays = 64});
  for_each_covered_texel(outcome.layers.at(0), [&](int, int, Vec3 h) {
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::fabs(h[c] / 2 - 1));
  });
  constexpr double kRoundingOfFloat = 1e-3;
  EXPECT_LE(worst, kRoundingOfFloat);
}

// A curtain across a closed room with a lamp on one side: what is sent is absorbed, within 3 standard errors.
TEST(DiffuseTransmission, KeepsTheEnergyOfARoom) {
  RoomBuilder builder(4);
  builder.add_box("room", {0, 0, 0}, {4, 3, 5}, builder.add_material("grey", {0.5, 0.5, 0.5}), true);
  builder.add_quad("curtain", {2, 0.001, 0.001}, {0, 2.998, 0}, {0, 0, 4.998},
                   add_leaf(builder, {0.3, 0.3, 0.3}, {0.5, 0.5, 0.5}));
  builder.add_quad("lamp", {0.5, 2.9, 2}, {0.5, 0, 0}, {0, 0, 0.5},
                   builder.add_material("lamp", {0, 0, 0}, {1000, 1000, 1000}));
  const auto energy = baked(builder.scene(), {.atlas_size = 64, .rays = 256}).report.energy;
  EXPECT_NEAR(energy.emitted / 250, 1, 0.05);
  EXPECT_LE(std::fabs(energy.gap), std::max(3 * energy.gap_standard_error, kOnePercent * energy.emitted));
}

// Behind the curtain it is dark without it.
TEST(DiffuseTransmission, LightsWhatLiesBehind) {
  const auto behind = [](Vec3 tau) {
    RoomBuilder builder(4);
    builder.add_box("room", {0, 0, 0}, {4, 3, 5}, builder.add_material("grey", {0.5, 0.5, 0.5}), true);
    builder.add_quad("curtain", {2, 0, 0}, {0, 3, 0}, {0, 0, 5}, add_leaf(builder, {0.3, 0.3, 0.3}, tau));
    builder.scene().lights.push_back({"lamp", PointLight{{1, 1.5, 2.5}, {100, 100, 100}}});
    // Of all walls' texels the right half's are lit through the curtain alone.
    return baked(builder.scene(), {.atlas_size = 128, .rays = 256}).report.energy;
  };
  const auto dark = behind({0, 0, 0}), lit = behind({0.5, 0.5, 0.5});
  EXPECT_GT(lit.mean_irradiance, 1.1 * dark.mean_irradiance);
}

}  // namespace
}  // namespace radbake::tests
