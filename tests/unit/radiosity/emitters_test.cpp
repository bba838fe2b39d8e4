// How emitters are cut out of a scene, chosen and sampled.
#include "server/radiosity/lights/emitters.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/radiosity/lights/emitter_tree.h"
#include "server/radiosity/lights/light_columns.h"
#include "server/radiosity/lights/rectangle_sampling.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"
#include "tests/scenes/solids.h"

namespace radbake::radiosity {
namespace {

/// A large dark floor, so that what glows is small and bright.
tests::RoomBuilder dark_floor() {
  tests::RoomBuilder builder(4);
  builder.add_quad("floor", {-20, 0, -20}, {0, 0, 40}, {40, 0, 0}, builder.add_material("grey", {0.5, 0.5, 0.5}));
  return builder;
}

std::vector<Emitter> emitters_of(const SurveyedScene& surveyed) { return make_emitters(surveyed.surfaces); }

TEST(Emitters, MergeTheTwoTrianglesOfARectangle) {
  tests::RoomBuilder builder = dark_floor();
  const int lamp = builder.add_material("lamp", {0, 0, 0}, {100, 100, 100});
  builder.add_quad("turned", {0.3, 2, 0.1}, {0.7, 0.2, 0.1}, cross({0.7, 0.2, 0.1}, {0.1, 1, 0.3}), lamp);
  const Scene scene = builder.scene();
  const SurveyedScene surveyed = survey_scene(scene).value();
  const auto emitters = emitters_of(surveyed);
  ASSERT_EQ(emitters.size(), 1u);
  EXPECT_TRUE(emitters[0].is_rectangle());
  const double area = length(cross(emitters[0].s, emitters[0].t));
  constexpr double kSinglePrecision = 1e-6;  // of the scene's corners
  EXPECT_NEAR(emitters[0].area / area, 1, kSinglePrecision);
  EXPECT_NEAR(dot(normalized(cross(emitters[0].s, emitters[0].t)), emitters[0].normal), 1, kSinglePrecision);
}

TEST(Emitters, KeepTrianglesThatAreNoRectangleApart) {
  tests::RoomBuilder builder = dark_floor();
  const int lamp = builder.add_material("lamp", {0, 0, 0}, {100, 100, 100});
  builder.add_quad("slanted", {0, 2, 0}, {1, 0, 0}, {0.5, 0, 1}, lamp);
  builder.add_quad("left", {3, 2, 0}, {1, 0, 0}, {0, 0, 1}, lamp);
  builder.scene().meshes.back().triangles.pop_back();
  builder.add_quad("right", {3, 2, 0}, {1, 0, 0}, {0, 0, 1}, lamp);  // another mesh
  builder.scene().meshes.back().triangles.erase(builder.scene().meshes.back().triangles.begin());
  const Scene scene = builder.scene();
  const SurveyedScene surveyed = survey_scene(scene).value();
  const auto emitters = emitters_of(surveyed);
  ASSERT_EQ(emitters.size(), 4u);
  for (const Emitter& emitter : emitters) EXPECT_FALSE(emitter.is_rectangle());
}

TEST(Emitters, FindThePlaceOfAPointInTheirTriangles) {
  tests::RoomBuilder builder = dark_floor();
  const int lamp = builder.add_material("lamp", {0, 0, 0}, {100, 100, 100});
  builder.add_quad("lamp", {0.3, 2, 0.1}, {0, 0.7, 0}, {0.5, 0, 0}, lamp);
  const Scene scene = builder.scene();
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Emitter emitter = emitters_of(surveyed).at(0);
  for (const Vec2 at : {Vec2{0.1, 0.2}, Vec2{0.9, 0.05}, Vec2{0.8, 0.9}, Vec2{0.3, 0.7}, Vec2{1, 1}, Vec2{0, 0}}) {
    const SurfacePoint p = point_on(emitter, surveyed.surfaces, at.x, at.y);
    const Vec3 exact = emitter.corner + emitter.s * at.x + emitter.t * at.y;
    constexpr double kRounding = 1e-12;
    EXPECT_LT(length(surveyed.surfaces.position(p) - exact), kRounding) << at.x << ' ' << at.y;
  }
}

// The solid angle of a rectangle a x b seen from distance c over its corner: atan(ab / (c sqrt(a2 + b2 + c2))).
TEST(RectangleSampling, KnowsTheSolidAngle) {
  for (const double c : {0.01, 0.3, 1.0, 4.0}) {
    const SphericalRectangle seen({0, 0, c}, {2, 0, 0}, {0, 0.5, 0}, {0, 0, 0});
    constexpr double kRounding = 1e-12;
    EXPECT_NEAR(seen.solid_angle(), std::atan(2 * 0.5 / (c * std::sqrt(4 + 0.25 + c * c))), kRounding) << c;
  }
}

// As many samples fall in each quarter of the rectangle as its share of the solid angle says.
TEST(RectangleSampling, IsUniformOverTheSolidAngle) {
  const Vec3 viewer{0.3, -0.2, 0}, corner{-0.5, -0.4, 0.3}, s{1.3, 0, 0}, t{0, 0.9, 0};
  const SphericalRectangle whole(corner, s, t, viewer);
  constexpr int kSide = 256;
  std::array<int, 4> count{};
  for (int i = 0; i < kSide * kSide; ++i) {
    const auto sample = whole.sample((i % kSide + 0.5) / kSide, (i / kSide + 0.5) / kSide);
    ASSERT_GE(sample.a, 0);
    ASSERT_LE(sample.b, 1);
    EXPECT_LT(length(viewer + sample.direction - (corner + s * sample.a + t * sample.b)), 1e-9);
    ++count[static_cast<std::size_t>((sample.a >= 0.5) + 2 * (sample.b >= 0.5))];
  }
  for (int quarter = 0; quarter < 4; ++quarter) {
    const SphericalRectangle part(corner + s * (0.5 * (quarter % 2)) + t * (0.5 * (quarter / 2)), s * 0.5, t * 0.5,
                                  viewer);
    // A line crosses up to two cells a row of the grid.
    constexpr double kFirstOrderInTheGrid = 2.0 / kSide;
    EXPECT_NEAR(static_cast<double>(count[static_cast<std::size_t>(quarter)]) / (kSide * kSide),
                part.solid_angle() / whole.solid_angle(), kFirstOrderInTheGrid);
  }
}

/// Spheres and panels, some of them below the floor or turned away from it.
Scene many_emitters() {
  tests::RoomBuilder builder = dark_floor();
  const int bright = builder.add_material("bright", {0, 0, 0}, {1000, 900, 800});
  const int both = builder.add_material("both", {0, 0, 0}, {300, 300, 300}, true);
  for (int k = 0; k < 6; ++k) {
    Mesh sphere = tests::make_sphere(5);
    sphere.material = bright;
    sphere.normals.clear();
    for (Vec3& p : sphere.positions) p = p * 0.2 + Vec3{2.0 * k - 5, k == 2 ? -1.0 : 1.0 + 0.3 * k, 0.5 * k};
    builder.scene().meshes.push_back(sphere);
  }
  builder.add_quad("up", {1, 0.5, 3}, {0, 0, 0.3}, {0.3, 0, 0}, bright);
  builder.add_quad("leaf", {-2, 0.5, 3}, {0, 0.3, 0}, {0.3, 0, 0}, both);
  for (Mesh& mesh : builder.scene().meshes) mesh.texcoord1.clear();
  return builder.scene();
}

// For each emitter the mean of [chosen] / probability over u is 1, or 0 where it certainly brings nothing.
TEST(EmitterTree, ChoosesWithTheProbabilityThatItStates) {
  const Scene scene = many_emitters();
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Surfaces& surfaces = surveyed.surfaces;
  const std::vector<Emitter> emitters = make_emitters(surfaces);
  ASSERT_GT(emitters.size(), 200u);
  const EmitterTree tree(emitters);
  constexpr std::size_t kMostInCut = 16;
  EmitterTree::Cut cut;
  for (const SurfacePoint at : {SurfacePoint{0, 0.49, 0.5}, SurfacePoint{1, 0.4, 0.2}}) {
    const std::vector<Site> sites = {front_site(surfaces, at, surfaces.normals[at.triangle])};
    const std::vector<std::uint32_t> open = {0};
    ReceiverColumns receiver;
    receiver.fill(sites, open, surfaces);
    tree.cut(receiver, kMostInCut, cut);
    ASSERT_FALSE(cut.parts.empty());
    EXPECT_LE(cut.parts.size(), kMostInCut);
    std::vector<double> means(emitters.size(), 0);
    constexpr int kPoints = 1 << 20;
    double least = 1;
    for (int k = 0; k < kPoints; ++k) {
      const auto choice = tree.choose(receiver, cut, (k + 0.5) / kPoints);
      if (choice.emitter < 0) continue;
      means[static_cast<std::size_t>(choice.emitter)] += 1 / (choice.probability * kPoints);
      least = std::min(least, choice.probability);
    }
    for (std::size_t e = 0; e < emitters.size(); ++e) {
      const Emitter& emitter = emitters[e];
      const bool faces = emitter.is_two_sided || dot(sites[0].position - emitter.corner, emitter.normal) > 0;
      const double over = std::max({dot(emitter.corner - sites[0].position, sites[0].facing),
                                    dot(emitter.corner + emitter.s - sites[0].position, sites[0].facing),
                                    dot(emitter.corner + emitter.t - sites[0].position, sites[0].facing)});
      if (!faces || over <= 0) continue;
      // Each choice is an interval of u: the grid misses less than a step at each of its ends.
      const double steps = 2 / (least * kPoints);
      EXPECT_NEAR(means[e], 1, steps) << e;
    }
    EXPECT_LT(2 / (least * kPoints), 0.2) << "the grid says little";
  }
}

}  // namespace
}  // namespace radbake::radiosity
