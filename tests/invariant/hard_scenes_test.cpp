// Hard cases on whole bakes, by the numbers of tests/docs/hard_cases.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/invariant/bake_support.h"
#include "tests/record_figure.h"
#include "tests/scenes/rooms.h"
#include "tests/scenes/solids.h"

namespace radbake::radiosity {
namespace {

void expect_finite(const BakeOutcome& outcome) {
  ASSERT_FALSE(outcome.layers.empty());
  for (const float value : outcome.layers[0].values) ASSERT_TRUE(std::isfinite(value));
}

float min_of(const BakeOutcome& outcome) {
  const std::vector<float>& values = outcome.layers.at(0).values;
  return *std::min_element(values.begin(), values.end());
}

/// Values of the texels of one mesh, which RoomBuilder laid out. Shapes: [texels]
std::vector<Vec3> texels_of(const Scene& scene, const BakeOutcome& outcome, const std::string& name) {
  const Layer& map = outcome.layers.at(0);
  std::vector<Vec3> texels;
  for (const Mesh& mesh : scene.meshes) {
    if (mesh.name != name) continue;
    const Vec2 low = mesh.texcoord1[0] * map.width, high = mesh.texcoord1[2] * map.width;
    tests::for_each_covered_texel(map, [&](int x, int y, Vec3 value) {
      if (x + 0.5 > low.x && x + 0.5 < high.x && y + 0.5 > low.y && y + 0.5 < high.y) texels.push_back(value);
    });
  }
  EXPECT_FALSE(texels.empty()) << name;
  return texels;
}

double largest(const std::vector<Vec3>& texels) {
  double result = 0;
  for (const Vec3& texel : texels) result = std::max(result, max_component(texel));
  return result;
}

Scene moved_and_scaled(Scene scene, double scale, Vec3 offset) {
  for (Mesh& mesh : scene.meshes) {
    for (Vec3& p : mesh.positions) p = p * scale + offset;
  }
  return scene;
}

/// Coordinates are eighths, so that they stay exact a million units away.
Scene room_of_eighths() {
  tests::RoomBuilder builder(4);
  const int grey = builder.add_material("grey", {0.5, 0.25, 0.75});
  const int lamp = builder.add_material("lamp", {0.5, 0.5, 0.5}, {40, 40, 40});
  builder.add_box("room", {0, 0, 0}, {4, 2.5, 3}, grey, true);
  builder.add_box("block", {1, 0.5, 1}, {1.5, 1.25, 2}, grey, false);
  builder.add_quad("lamp", {2.5, 2.375, 1}, {0.5, 0, 0}, {0, 0, 0.5}, lamp);
  return builder.scene();
}

const BakeOptions kSmallBake{.atlas_size = 64, .rays = 32, .seed = 9};

TEST(HardCase09AMillionUnitsFromTheOrigin, GivesTheSameLightmapBitForBit) {
  const Scene scene = room_of_eighths();
  const auto here = tests::baked(scene, kSmallBake);
  const auto there = tests::baked(moved_and_scaled(scene, 1, {0x1p20, -0x1p20, 0x1p21}), kSmallBake);
  EXPECT_EQ(here.layers.at(0).values, there.layers.at(0).values);
  EXPECT_GT(largest(texels_of(scene, here, "room.bottom")), 0);
}

TEST(HardCase10AnyUnit, GivesTheSameLightmapBitForBit) {
  const Scene scene = tests::small_emitter_room(0.5);
  const auto metres = tests::baked(scene, kSmallBake);
  for (const double scale : {0x1p-20, 0x1p20}) {
    const auto other = tests::baked(moved_and_scaled(scene, scale, {}), kSmallBake);
    EXPECT_EQ(metres.layers.at(0).values, other.layers.at(0).values) << scale;
  }
}

TEST(HardCase13NoConvergence, IsAnErrorThatSaysSoAndNoMap) {
  // The bound divides rounding by 1 - rho: at 1e-13 no solution meets the tolerance, not even a direct one.
  class Silent final : public BakeObserver {
    void on_progress(const BakeProgress&) override {}
    void on_tile(const Tile&) override { ADD_FAILURE() << "a part of a map without a solution"; }
  } observer;
  BakeOptions options = kSmallBake;
  options.max_patches = 64;
  options.solver = Solver::kLu;
  const auto outcome = bake_scene(tests::furnace_room(1 - 1e-13), options, observer);
  ASSERT_FALSE(outcome.ok());
  EXPECT_EQ(outcome.error().code, ErrorCode::kInternal);
  EXPECT_NE(outcome.error().message.find("did not converge"), std::string::npos) << outcome.error().message;
  EXPECT_NE(outcome.error().message.find("residual"), std::string::npos) << outcome.error().message;
}

TEST(HardCase23Emission, OfAnyStrengthGivesTheSameLightmapBitForBit) {
  Scene scene = tests::small_emitter_room(0.5);
  const auto one = tests::baked(scene, kSmallBake);
  for (const double factor : {0x1p-20, 0x1p30}) {
    Scene scaled = scene;
    for (Material& material : scaled.materials) material.emissive = material.emissive * factor;
    const auto other = tests::baked(scaled, kSmallBake);
    const std::vector<float>&expected = one.layers.at(0).values, &values = other.layers.at(0).values;
    ASSERT_EQ(values.size(), expected.size());
    for (std::size_t k = 0; k < values.size(); ++k) {
      ASSERT_EQ(values[k], k % 4 == 3 ? expected[k] : static_cast<float>(expected[k] * factor)) << k;
    }
  }
}

Scene plate(Vec3 exitance) {
  tests::RoomBuilder builder(2);
  builder.add_quad("plate", {0, 0, 0}, {2, 0, 0}, {0, 0, -2}, builder.add_material("grey", {0.5, 0.5, 0.5}, exitance));
  return builder.scene();
}

TEST(HardCase15OpenScene, LetsASinglePlateGainNothing) {
  const Scene scene = plate({1, 2, 3});
  // Nothing lies before a plate, so its rows are made only where that is asked for.
  BakeOptions options = kSmallBake;
  options.effects[Effect::kInterreflection] = true;
  const auto outcome = tests::baked(scene, options);
  EXPECT_EQ(largest(texels_of(scene, outcome, "plate")), 0);
  EXPECT_EQ(outcome.report.transport.escape_share, 1);
  EXPECT_FALSE(outcome.report.energy.is_closed);
}

TEST(HardCase15OpenScene, GivesAPlateUnderASkyThePartOfTheSkyThatItSees) {
  constexpr double kFloat = 1e-6;
  Scene scene = plate({});
  scene.sky = {1, 2, 4};
  const auto outcome = tests::baked(scene, kSmallBake);
  for (const Vec3& h : texels_of(scene, outcome, "plate")) {
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(h[c] / (std::numbers::pi * scene.sky[c]), 1, kFloat);
  }
}

TEST(HardCase14ClosedScene, HasRowsAsMeasuredAndRepairedToRounding) {
  constexpr double kAsked = 1e-12;
  const auto outcome = tests::baked(tests::small_emitter_room(0.5), {.atlas_size = 64, .rays = 64});
  EXPECT_EQ(outcome.report.transport.raw_closure_max, 0);  // hits alone: 3 sigma of nothing
  EXPECT_LE(outcome.report.transport.repaired_row_error_max, kAsked);
  tests::record_figure("repaired_row_error", outcome.report.transport.repaired_row_error_max);
  tests::record_figure("raw_reciprocity_rms", outcome.report.transport.raw_reciprocity_rms);
}

TEST(HardCase22ReversedNormals, AreReportedAsLightLostAtBacks) {
  Scene scene = tests::small_emitter_room(0.5);
  const auto right = tests::baked(scene, kSmallBake);
  EXPECT_EQ(right.report.transport.absorbed_share, 0);
  EXPECT_TRUE(right.report.energy.is_closed);
  for (auto& triangle : scene.meshes[2].triangles) std::swap(triangle[1], triangle[2]);
  const auto wrong = tests::baked(scene, kSmallBake);
  expect_finite(wrong);
  EXPECT_GT(wrong.report.transport.absorbed_share, 0.05);
  EXPECT_FALSE(wrong.report.energy.is_closed);
}

TEST(HardCase22ReversedNormals, AreWarnedOfWhereMostRaysMeetBacks) {
  const auto warning_of = [](const BakeOutcome& outcome) -> std::string {
    for (const Warning& warning : outcome.report.warnings) {
      if (warning.id == "sees_backs") return warning.text;
    }
    return "";
  };
  Scene scene = tests::small_emitter_room(0.5);
  EXPECT_EQ(warning_of(tests::baked(scene, kSmallBake)), "");
  // A room turned inside out: the block in it, and the panel, see nothing but backs.
  for (Mesh& mesh : scene.meshes) {
    if (mesh.name.find("room") == std::string::npos) continue;
    for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
  const auto outcome = tests::baked(scene, kSmallBake);
  expect_finite(outcome);
  EXPECT_NE(warning_of(outcome).find("mostly backs"), std::string::npos) << warning_of(outcome);
  EXPECT_NE(warning_of(outcome).find("block"), std::string::npos) << warning_of(outcome);
}

TEST(HardCase04Coincident, SurfacesOfABakeGiveNoNan) {
  // Two sheets in one place, front to front and back to back, and one twice over.
  tests::RoomBuilder builder(4);
  const int glowing = builder.add_material("glowing", {0.5, 0.5, 0.5}, {1, 1, 1});
  builder.add_box("room", {0, 0, 0}, {2, 2, 2}, glowing, true);
  builder.add_quad("up", {0.5, 1, 0.5}, {0, 0, 1}, {1, 0, 0}, glowing);
  builder.add_quad("down", {0.5, 1, 0.5}, {1, 0, 0}, {0, 0, 1}, glowing);
  builder.add_quad("twice", {0.5, 1, 0.5}, {1, 0, 0}, {0, 0, 1}, glowing);
  const FormFactors all[] = {FormFactors::kHemicube, FormFactors::kHemisphere, FormFactors::kAdaptive,
                             FormFactors::kAnalytic};
  for (const FormFactors form_factors : all) {
    BakeOptions options = kSmallBake;
    options.max_patches = 128;
    options.form_factors = form_factors;
    const auto outcome = tests::baked(builder.scene(), options);
    expect_finite(outcome);
    EXPECT_GE(min_of(outcome), 0) << form_factors_name(form_factors);
  }
}

TEST(HardCase28Isolated, StaysDarkOrItsOwnLightWithoutNan) {
  // A lit room; a sealed box beside it without light; a plate far off that glows and sees nothing.
  tests::RoomBuilder builder(5);
  const int grey = builder.add_material("grey", {0.5, 0.5, 0.5});
  const int glowing = builder.add_material("glowing", {0.5, 0.5, 0.5}, {1, 1, 1});
  builder.add_box("lit", {0, 0, 0}, {2, 2, 2}, glowing, true);
  builder.add_box("dark", {3, 0, 0}, {5, 2, 2}, grey, true);
  builder.add_box("in the dark", {3.5, 0.5, 0.5}, {4, 1, 1}, grey, false);
  builder.add_quad("alone", {8, 0, 0}, {0, 1, 0}, {0, 0, 1}, glowing);
  const Scene scene = builder.scene();
  const auto outcome = tests::baked(scene, {.atlas_size = 64, .rays = 64});
  expect_finite(outcome);
  for (const std::string side : {"bottom", "top", "left", "right", "back", "front"}) {
    EXPECT_EQ(largest(texels_of(scene, outcome, "dark." + side)), 0) << side;
    EXPECT_EQ(largest(texels_of(scene, outcome, "in the dark." + side)), 0) << side;
    constexpr double kFloat = 1e-5;
    EXPECT_NEAR(largest(texels_of(scene, outcome, "lit." + side)), 2, 2 * kFloat) << side;
  }
  EXPECT_EQ(largest(texels_of(scene, outcome, "alone")), 0);
}

TEST(HardCase29TwistedBox, IsAClosedFurnace) {
  constexpr double kAsked = 1e-6, kFloat = 1e-6;
  const auto outcome = tests::baked(tests::twisted_box(0.35), {.atlas_size = 64, .rays = 64});
  EXPECT_EQ(outcome.report.transport.escape_share, 0);
  EXPECT_EQ(outcome.report.transport.absorbed_share, 0);
  EXPECT_LE(outcome.report.transport.repaired_row_error_max, kAsked);
  double worst = 0;
  tests::for_each_covered_texel(outcome.layers.at(0), [&](int, int, Vec3 h) {
    for (int c = 0; c < 3; ++c) worst = std::max(worst, std::fabs(h[c] / 2 - 1));
  });
  // B is solved to 1e-6 of its mean.
  EXPECT_LE(worst, 2 * kAsked + kFloat);
  tests::record_figure("worst_texel", worst);
}

/// A closed room of 4 x 2.5 x 4 m whose walls and ceiling glow, and a box of 1.06 m on its floor that no grid line
/// meets. `is_cut`: the floor is made of the four pieces around the box, laid out as the whole floor is.
Scene room_with_box_on_floor(bool is_cut) {
  constexpr double kLow = 1.53, kHigh = 2.59, kEdge = 4;
  tests::RoomBuilder builder(6);
  const int grey = builder.add_material("grey", {0.5, 0.5, 0.5});
  const int glowing = builder.add_material("glowing", {0.5, 0.5, 0.5}, {1, 1, 1});
  builder.add_box("room", {0, 0, 0}, {kEdge, 2.5, kEdge}, glowing, true);
  builder.add_box("box", {kLow, 0, kLow}, {kHigh, 1, kHigh}, grey, false);
  Scene scene = builder.scene();
  scene.meshes.erase(scene.meshes.begin());  // the floor
  // The upper left quarter of the atlas is the floor's; all else goes to a part of the lower right one.
  for (Mesh& mesh : scene.meshes) {
    for (Vec2& uv : mesh.texcoord1) uv = Vec2{0.55, 0.55} + uv * 0.4;
  }
  const auto add_floor = [&](double x0, double z0, double x1, double z1) {
    Mesh& mesh = scene.meshes.emplace_back();
    mesh.name = "floor";
    mesh.material = grey;
    mesh.positions = {{x0, 0, z0}, {x0, 0, z1}, {x1, 0, z1}, {x1, 0, z0}};
    for (const Vec3 p : mesh.positions) mesh.texcoord1.push_back({p.x / kEdge / 2, p.z / kEdge / 2});
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  };
  if (is_cut) {
    add_floor(0, 0, kEdge, kLow), add_floor(0, kHigh, kEdge, kEdge);
    add_floor(0, kLow, kLow, kHigh), add_floor(kHigh, kLow, kEdge, kHigh);
  } else {
    add_floor(0, 0, kEdge, kEdge);
  }
  return scene;
}

TEST(HardCase30BoxOnTheFloorOfAClosedRoom, LightsTheFloorAsIfItWereCutOut) {
  // Both maps are estimates, and state their standard errors, about 0.2 %: three of their difference are noise, as the
  // worst of two thousand is looked at.
  constexpr double kAsked = 0.01;
  const BakeOptions options{.atlas_size = 96, .rays = 8192};
  const auto whole = tests::baked(room_with_box_on_floor(false), options);
  const auto cut = tests::baked(room_with_box_on_floor(true), options);
  const std::vector<float>&values = whole.layers.at(0).values, &expected = cut.layers.at(0).values;
  double worst = 0;
  int lit = 0, at_contact = 0;
  for (int y = 0; y < options.atlas_size / 2; ++y) {
    for (int x = 0; x < options.atlas_size / 2; ++x) {
      const std::size_t at = 4 * (static_cast<std::size_t>(y) * options.atlas_size + x);
      if (expected[at + 3] == 0) continue;  // wholly under the box
      const double noise = 3 * std::hypot(whole.layers.back().values[at], cut.layers.back().values[at]) / expected[at];
      worst = std::max(worst, std::fabs(values[at] / static_cast<double>(expected[at]) - 1) - noise);
      ++lit;
      at_contact += expected[at + 3] < 0.999;
    }
  }
  EXPECT_GT(lit, 2000);
  EXPECT_GT(at_contact, 30);
  EXPECT_LE(worst, kAsked);
  tests::record_figure("worst_texel", worst);
}

}  // namespace
}  // namespace radbake::radiosity
