#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "server/radiosity/lights/direct_light.h"
#include "server/radiosity/lights/triangle_sampling.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

/// Direct light on one point of a floor that faces +y, at the origin.
class FloorPoint {
 public:
  explicit FloorPoint(Scene scene) : scene_(std::move(scene)), surveyed_(survey_scene(scene_).value()) {
    visibility_ = make_embree_visibility(surveyed_.surfaces.corners);
  }

  Vec3 irradiance(int samples, std::uint64_t seed, Vec3 at) const {
    const Surfaces& surfaces = surveyed_.surfaces;
    const DirectLight direct(surfaces, *visibility_, samples);
    // The floor is the first quad: find its triangle and weights by the plane's axes.
    const Vec3 p = (at - surfaces.centre) / surfaces.metres_per_unit;
    for (std::uint32_t t = 0; t < 2; ++t) {
      const auto& c = surfaces.corners[t];
      const Vec3 e1 = c[1] - c[0], e2 = c[2] - c[0], n = cross(e1, e2), d = p - c[0];
      const double u = dot(cross(d, e2), n) / dot(n, n), v = dot(cross(e1, d), n) / dot(n, n);
      if (u < 0 || v < 0 || u + v > 1) continue;
      const std::vector<Site> sites = {front_site(surfaces, {t, u, v}, surfaces.normals[t])};
      const std::vector<std::uint8_t> buried = {0};
      DirectLight::Scratch scratch;
      Vec3 estimate;
      direct.estimate(sites, buried, seed, scratch, std::span(&estimate, 1));
      return estimate;
    }
    ADD_FAILURE() << "the point is not on the floor";
    return {};
  }

 private:
  Scene scene_;
  SurveyedScene surveyed_;
  std::unique_ptr<Visibility> visibility_;
};

/// A floor of 10 x 10 m around the origin, facing up.
tests::RoomBuilder floor_scene() {
  tests::RoomBuilder builder(4);
  builder.add_quad("floor", {-5, 0, -5}, {0, 0, 10}, {10, 0, 0}, builder.add_material("grey", {0.5, 0.5, 0.5}));
  return builder;
}

constexpr double kSinglePrecision = 1e-5;  // rays start 2^-20 of the scene above the floor

// I = I0 cos^2 at every 2.5 degrees from 0 to 90: linear between them, it is at most 1e-3 I0 too low.
TEST(Luminaire, LightsAsItsTableSays) {
  constexpr double kTable = 0.005, kIntensity = 300, kHeight = 2;
  tests::RoomBuilder builder = floor_scene();
  ProfileLight light;
  light.position = {0, kHeight, 0};
  light.direction = {0, -1, 0};
  light.zero_side = {1, 0, 0};
  light.tint = {1, 2, 0.5};
  LightProfile profile;
  profile.horizontal_degrees = {0, 90, 180, 270, 360};
  for (int k = 0; k <= 36; ++k) profile.vertical_degrees.push_back(2.5 * k);
  // Towards +x as it is, towards -z (90 degrees from it, as seen from above) half of it, behind a quarter.
  for (const double share : {1.0, 0.5, 0.25, 0.5, 1.0}) {
    for (const double v : profile.vertical_degrees) {
      const double cosine = std::cos(v * std::numbers::pi / 180);
      profile.candela.push_back(static_cast<float>(kIntensity * share * cosine * cosine));
    }
  }
  light.profile = std::make_shared<const LightProfile>(std::move(profile));
  builder.scene().lights.push_back({"luminaire", light});
  const FloorPoint floor(builder.scene());
  const auto expect = [&](Vec3 at, double share) {
    // H = I cos / r^2 = I0 cos^3 / r^2.
    const double squared = dot(at, at) + kHeight * kHeight, cosine = kHeight / std::sqrt(squared);
    const double exact = share * kIntensity * cosine * cosine * cosine / squared;
    const Vec3 h = floor.irradiance(16, 1, at);
    EXPECT_NEAR(h.x, exact, kTable * exact) << at.x << ", " << at.z;
    EXPECT_NEAR(h.y, 2 * exact, kTable * 2 * exact);
    EXPECT_NEAR(h.z, exact / 2, kTable * exact / 2);
  };
  for (const double distance : {0.3, 1.1, 2.7, 4.0}) {
    expect({distance, 0, 0}, 1);
    expect({-distance, 0, 0}, 0.25);
    expect({0, 0, -distance}, 0.5);
    const double aslant = distance / std::sqrt(2.0);
    expect({aslant, 0, -aslant}, 0.75);
    expect({-aslant, 0, -aslant}, 0.375);
  }
}

// 100 cd straight down; at right angles to the zero side 200 cd one way, 20 cd the other.
TEST(Luminaire, OfAMirroredNodeIsItsMirrorImage) {
  ProfileLight light;
  light.position = {0, 2, 0};
  light.direction = {0, -1, 0};
  light.zero_side = {1, 0, 0};
  light.profile = std::make_shared<const LightProfile>(
      LightProfile{{0, 45}, {0, 90, 180, 270, 360}, {100, 100, 100, 200, 100, 100, 100, 20, 100, 100}});
  const auto at = [&](bool is_mirrored, Vec3 place) {
    tests::RoomBuilder builder = floor_scene();
    light.is_mirrored = is_mirrored;
    builder.scene().lights.push_back({"luminaire", light});
    return FloorPoint(builder.scene()).irradiance(4, 1, place).x;
  };
  // r^2 = 8 m^2, the cosine sqrt(1/2). Just within 45 degrees: beyond there is no light.
  constexpr double kAside = 2 - 1e-3, kTable = 0.005;
  const double geometry = std::sqrt(0.5) / 8;
  for (const bool is_mirrored : {false, true}) {
    const double z = is_mirrored ? kAside : -kAside;
    EXPECT_NEAR(at(is_mirrored, {0, 0, z}), 200 * geometry, 200 * geometry * kTable) << is_mirrored;
    EXPECT_NEAR(at(is_mirrored, {0, 0, -z}), 20 * geometry, 200 * geometry * kTable) << is_mirrored;
    EXPECT_NEAR(at(is_mirrored, {kAside, 0, 0}), 100 * geometry, 100 * geometry * kTable) << is_mirrored;
  }
}

TEST(PointLight, FallsOffWithSquaredDistanceAndCosine) {
  tests::RoomBuilder builder = floor_scene();
  builder.scene().lights.push_back({"lamp", PointLight{{0, 2, 0}, {100, 200, 300}}});
  const FloorPoint floor(builder.scene());
  EXPECT_NEAR(floor.irradiance(4, 1, {0, 0, 0}).x, 100.0 / 4, 25 * kSinglePrecision);
  // At 1.5 m aside: r = 2.5, cos = 0.8.
  const Vec3 aside = floor.irradiance(4, 1, {1.5, 0, 0});
  EXPECT_NEAR(aside.y, 200 * 0.8 / 6.25, 26 * kSinglePrecision);
  EXPECT_NEAR(aside.z, 300 * 0.8 / 6.25, 40 * kSinglePrecision);
}

TEST(SpotLight, IsFullInsideAndDarkOutsideItsCones) {
  tests::RoomBuilder builder = floor_scene();
  SpotLight spot{{0, 2, 0}, {0, -1, 0}, {100, 100, 100}, 0.3, 0.6};
  builder.scene().lights.push_back({"spot", spot});
  const FloorPoint floor(builder.scene());
  const auto exact = [&](double x) {
    const double r = std::hypot(x, 2.0), cosine = 2 / r;
    const double ramp = std::clamp((cosine - std::cos(0.6)) / (std::cos(0.3) - std::cos(0.6)), 0.0, 1.0);
    return 100 * ramp * ramp * cosine / (r * r);
  };
  for (const double x : {0.0, 0.5, 0.8, 1.0, 1.2, 1.5}) {
    EXPECT_NEAR(floor.irradiance(4, 1, {x, 0, 0}).x, exact(x), 25 * kSinglePrecision) << x;
  }
  EXPECT_EQ(floor.irradiance(4, 1, {1.5, 0, 0}).x, 0);
}

TEST(Sun, GivesItsIlluminanceTimesTheCosine) {
  tests::RoomBuilder builder = floor_scene();
  builder.scene().lights.push_back({"sun", DirectionalLight{normalized({3, -4, 0}), {1000, 1000, 1000}}});
  EXPECT_NEAR(FloorPoint(builder.scene()).irradiance(4, 1, {1, 0, 1}).x, 800, 800 * kSinglePrecision);
}

TEST(Sun, IsBlockedByWhatStandsInItsWay) {
  tests::RoomBuilder builder = floor_scene();
  builder.scene().lights.push_back({"sun", DirectionalLight{{0, -1, 0}, {1000, 1000, 1000}}});
  builder.add_quad("roof", {-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, 0);
  const FloorPoint floor(builder.scene());
  EXPECT_EQ(floor.irradiance(4, 1, {0.5, 0, 0.5}).x, 0);
  EXPECT_NEAR(floor.irradiance(4, 1, {1.5, 0, 0.5}).x, 1000, 1000 * kSinglePrecision);
}

// Of 64 sites that are a net, 16 samples take 16 that are one too: a straight edge cuts off their share to 1/16 a side.
TEST(Sun, IsSeenFromSitesSpreadOverTheReceiverByFewSamples) {
  tests::RoomBuilder builder = floor_scene();
  builder.scene().lights.push_back({"sun", DirectionalLight{{0, -1, 0}, {1000, 1000, 1000}}});
  builder.add_quad("roof", {-5, 1, -5}, {5, 0, 0}, {0, 0, 10}, 0);  // over x < 0
  const Scene scene = builder.scene();
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Surfaces& surfaces = surveyed.surfaces;
  const auto visibility = make_embree_visibility(surfaces.corners);
  constexpr int kSites = 64, kSamples = 16;
  const DirectLight direct(surfaces, *visibility, kSamples);
  const SobolPoints points(kSites);
  DirectLight::Scratch scratch;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const auto seeds = SobolPoints::seeds_of(seed);
    std::vector<Site> sites;
    for (int s = 0; s < kSites; ++s) {
      // A square of 0.1 m on the first triangle of the floor.
      const double x = 0.1 * (points.coordinate(s, 0, seeds) - 0.5), z = 2 + 0.1 * points.coordinate(s, 1, seeds);
      const SurfacePoint p{0, (z - x) / 10, (x + 5) / 10};
      sites.push_back(front_site(surfaces, p, surfaces.normals[0]));
    }
    const std::vector<std::uint8_t> none(sites.size(), 0);
    Vec3 estimate;
    direct.estimate(sites, none, seed, scratch, std::span(&estimate, 1));
    EXPECT_NEAR(estimate.x, 500, 1000.0 / kSamples + 1000 * kSinglePrecision) << seed;
  }
}

// An element under the corner of a parallel rectangle a x b at distance c, X = a/c, Y = b/c:
// F = 1/(2 pi) [X/sqrt(1+X2) atan(Y/sqrt(1+X2)) + Y/sqrt(1+Y2) atan(X/sqrt(1+Y2))].
TEST(AreaLight, MatchesTheClosedFormOverAnElement) {
  for (const double height : {0.05, 0.5, 2.0, 4.0}) {
    tests::RoomBuilder builder = floor_scene();
    const int lamp = builder.add_material("lamp", {0, 0, 0}, {1000, 1000, 1000});
    builder.add_quad("lamp", {0, height, 0}, {1, 0, 0}, {0, 0, 1}, lamp);  // faces down
    const FloorPoint floor(builder.scene());
    const double x = 1 / height, root = std::sqrt(1 + x * x);
    const double form_factor = 2 * x / root * std::atan(x / root) / (2 * std::numbers::pi);
    double sum = 0, squares = 0;
    constexpr int kSeeds = 64;
    for (int seed = 0; seed < kSeeds; ++seed) {
      const double h = floor.irradiance(256, static_cast<std::uint64_t>(seed), {0, 0, 0}).x;
      sum += h;
      squares += h * h;
    }
    const double mean = sum / kSeeds;
    const double standard_error = std::sqrt((squares / kSeeds - mean * mean) / (kSeeds - 1));
    EXPECT_NEAR(mean, 1000 * form_factor, 4 * standard_error + 1000 * kSinglePrecision) << "height " << height;
    EXPECT_LT(standard_error, 0.005 * mean) << "height " << height;
  }
}

// The mean of the density over its own samples is the solid angle: sum of both ways to sample agrees with the exact
// one.
TEST(TriangleSampling, IsUniformOverTheSolidAngle) {
  const std::array<Vec3, 3> corners = {Vec3{-1, 1, -1}, Vec3{2, 1, 0}, Vec3{0, 1.5, 2}};
  const Vec3 normal = normalized(cross(corners[1] - corners[0], corners[2] - corners[0]));
  const double area = length(cross(corners[1] - corners[0], corners[2] - corners[0])) / 2;
  // Projected on the tangent plane, the solid angle's samples give the form factor; compare with uniform area samples.
  constexpr int kSide = 200;
  double by_angle = 0, by_area = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const double x = (i % kSide + 0.5) / kSide, y = (i / kSide + 0.5) / kSide;
    const TriangleSample near = sampled_triangle(corners, normal, area, {0, 0, 0}, x, y);
    const Vec3 unit = normalized(near.direction);
    by_angle += near.solid_angle * unit.y / (kSide * kSide);
    const double root = std::sqrt(x);
    const Vec3 p = corners[0] * (1 - root) + corners[1] * (root * (1 - y)) + corners[2] * (root * y);
    const double r2 = dot(p, p);
    by_area += std::fabs(dot(p, normal)) * area / (r2 * std::sqrt(r2)) * (p.y / std::sqrt(r2)) / (kSide * kSide);
  }
  constexpr double kSecondOrderInTheGrid = 1e-4;
  EXPECT_NEAR(by_angle / by_area, 1, kSecondOrderInTheGrid);
}

}  // namespace
}  // namespace radbake::radiosity
