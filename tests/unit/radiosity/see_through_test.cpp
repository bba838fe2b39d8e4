// What light passes: masks, partial coverage and tinted sheets, in rays and in rows.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "server/radiosity/visibility/visibility.h"
#include "tests/scenes/rooms.h"
#include "tests/unit/radiosity/receiver_point.h"

namespace radbake::radiosity {
namespace {

/// Every other triangle stops light by its place: a mask where u > v, a grey share, a colour.
class TestOpacity final : public Opacity {
 public:
  bool is_see_through(std::uint32_t triangle) const override { return triangle % 2 == 1; }
  Vec3 opacity(std::uint32_t triangle, double u, double v) const override {
    if (triangle % 3 == 0) return u > v ? Vec3{1, 1, 1} : Vec3{};
    return triangle % 3 == 1 ? Vec3{0.25, 0.25, 0.25} : Vec3{0.9, 0.5, 0};
  }
};

std::vector<Corners> random_triangles(int n) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> place(-1, 1), size(-0.4, 0.4);
  const auto any = [&](auto& of) { return Vec3{of(random), of(random), of(random)}; };
  std::vector<Corners> triangles;
  for (int i = 0; i < n; ++i) {
    const Vec3 a = any(place);
    triangles.push_back({a, a + any(size), a + any(size)});
  }
  return triangles;
}

std::vector<Ray> random_segments(int n) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<float> any(-1, 1);
  std::vector<Ray> rays;
  for (int i = 0; i < n; ++i) {
    rays.push_back({{any(random), any(random), any(random)}, {any(random), any(random), any(random)}, 1.0f});
  }
  return rays;
}

// Single and double precision may disagree on rays that graze an edge (of a triangle or of a mask): few in 20000.
TEST(SeeThrough, VisibilityOfEmbreeAgreesWithBruteForceInEveryChannel) {
  constexpr int kRays = 20000, kGrazing = 10;
  const auto triangles = random_triangles(200);
  const TestOpacity opacity;
  const auto embree = make_embree_visibility(triangles, {}, &opacity);
  const auto slow = make_brute_force_visibility(triangles, &opacity);
  const std::vector<Ray> rays = random_segments(kRays);
  for (int channel = 0; channel < 3; ++channel) {
    std::vector<Hit> fast_hits(kRays), slow_hits(kRays);
    embree->channel(channel).trace(rays, fast_hits);
    slow->channel(channel).trace(rays, slow_hits);
    int different = 0, hits_of_sheets = 0;
    for (int i = 0; i < kRays; ++i) {
      different += fast_hits[i].triangle != slow_hits[i].triangle;
      hits_of_sheets += slow_hits[i].triangle != kNoHit && slow_hits[i].triangle % 2 == 1;
    }
    EXPECT_LE(different, kGrazing) << channel;
    EXPECT_GT(hits_of_sheets, kRays / 50) << channel;
  }
  std::vector<Vec3> fast_shares(kRays), slow_shares(kRays);
  std::vector<std::uint8_t> fast_blocked(kRays), slow_blocked(kRays);
  embree->transmitted(rays, fast_shares);
  slow->transmitted(rays, slow_shares);
  embree->blocked(rays, fast_blocked);
  slow->blocked(rays, slow_blocked);
  int different = 0, partial = 0;
  for (int i = 0; i < kRays; ++i) {
    different += length(fast_shares[i] - slow_shares[i]) > 1e-12 || fast_blocked[i] != slow_blocked[i];
    partial += slow_shares[i].x > 0 && slow_shares[i].x < 1;
  }
  EXPECT_LE(different, 2 * kGrazing);
  EXPECT_GT(partial, kRays / 20);
}

// A sheet of opacity q stops a share q of many rays: 4 standard errors of a binomial.
TEST(SeeThrough, StopsTheShareOfRaysThatItsOpacitySays) {
  const std::vector<Corners> triangles = {
      {Vec3{5, 5, 5}, Vec3{6, 5, 5}, Vec3{5, 6, 5}}, {Vec3{-9, -9, 0}, Vec3{9, -9, 0}, Vec3{0, 18, 0}},
      {Vec3{5, 5, 6}, Vec3{6, 5, 6}, Vec3{5, 6, 6}}, {Vec3{5, 5, 7}, Vec3{6, 5, 7}, Vec3{5, 6, 7}},
      {Vec3{5, 5, 8}, Vec3{6, 5, 8}, Vec3{5, 6, 8}}, {Vec3{-9, -9, 0.5}, Vec3{9, -9, 0.5}, Vec3{0, 18, 0.5}}};
  const TestOpacity opacity;  // triangle 1: a quarter; triangle 5: 0.9, 0.5, 0
  const auto embree = make_embree_visibility(triangles, {}, &opacity);
  constexpr int kRays = 40000;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<float> any(-0.3f, 0.3f);
  std::vector<Ray> rays;
  for (int i = 0; i < kRays; ++i) rays.push_back({{any(random), any(random), -1}, {any(random), any(random), 1}});
  for (int channel = 0; channel < 3; ++channel) {
    std::vector<Hit> hits(kRays);
    embree->channel(channel).trace(rays, hits);
    int first = 0, second = 0;
    for (const Hit& hit : hits) {
      first += hit.triangle == 1;
      second += hit.triangle == 5;
    }
    const double stopped = Vec3{0.9, 0.5, 0}[channel];
    EXPECT_NEAR(first, 0.25 * kRays, 4 * std::sqrt(0.25 * 0.75 * kRays));
    EXPECT_NEAR(second, 0.75 * stopped * kRays, 4 * std::sqrt(0.25 * kRays));
    if (stopped == 0) {
      EXPECT_EQ(second, 0);
    }
  }
}

/// A black floor of 10 x 10 m, and a black sheet of the same size 2 m above it.
struct Sheet {
  tests::RoomBuilder builder{4};
  Material* material = nullptr;

  Sheet() {
    builder.add_quad("floor", {-5, 0, -5}, {0, 0, 10}, {10, 0, 0}, builder.add_material("black", {0, 0, 0}));
    const int sheet = builder.add_material("sheet", {0, 0, 0});
    builder.add_quad("sheet", {-50, 2, -50}, {0, 0, 100}, {100, 0, 0}, sheet);
    material = &builder.scene().materials[static_cast<std::size_t>(sheet)];
  }
};

constexpr int kRays = 1024, kLightSamples = 128, kSeeds = 16;
constexpr double kOnePercent = 0.01;

TEST(SeeThrough, ATintedSheetColoursTheSun) {
  Sheet scene;
  scene.material->transmittance = {0.8, 0.5, 0.2};
  scene.builder.scene().lights.push_back({"sun", DirectionalLight{{0, -1, 0}, {1000, 1000, 1000}}});
  const Vec3 h = ReceiverPoint(scene.builder.scene()).irradiance({1, 0, 2}, 256, kLightSamples, 1);
  EXPECT_NEAR(h.x, 800, 1e-9 * 800);
  EXPECT_NEAR(h.y, 500, 1e-9 * 500);
  EXPECT_NEAR(h.z, 200, 1e-9 * 200);
}

TEST(SeeThrough, PartialCoverageLetsItsShareOfTheSkyThrough) {
  Sheet scene;
  scene.material->alpha_mode = AlphaMode::kBlend;
  scene.material->alpha = 0.3;
  scene.builder.scene().sky = {1, 1, 1};
  // What the sheet of 100 x 100 m leaves of the horizon: below 1e-3 of the lobe.
  const auto estimate = ReceiverPoint(scene.builder.scene()).estimate({1, 0, 1}, kRays, kLightSamples, kSeeds);
  EXPECT_NEAR(estimate.mean.x / std::numbers::pi, 0.7, 0.7 * kOnePercent);
}

}  // namespace
}  // namespace radbake::radiosity
