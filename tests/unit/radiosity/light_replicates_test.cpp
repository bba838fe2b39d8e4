// Error bars of direct light rest on the spread of its replicates: it has to agree with the true spread of estimates.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>

#include "server/radiosity/lights/direct_light.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"
#include "tests/scenes/solids.h"

namespace radbake::radiosity {
namespace {

constexpr int kSeeds = 3000, kReplicates = 4, kSamples = 16;
/// Standard errors of both variances, from fourth moments; one in 16,000 honest comparisons is farther off. Seeds are
/// fixed.
constexpr double kFourSigma = 4;
/// The comparison tells replicates that share anything: the variance of their mean would be off by more.
constexpr double kSharp = 0.15;

/// A receiver on the floor: a square of 0.2 m, whose sites each seed spreads anew and independently.
struct Receiver {
  const char* name;
  Vec3 middle;
};

struct LitFloor {
  const char* name;
  std::function<void(tests::RoomBuilder&)> add_lights;
  std::vector<Receiver> receivers;
};

void add_block(tests::RoomBuilder& builder) { builder.add_box("block", {-0.5, 0.4, -0.5}, {0.5, 0.8, 0.5}, 0, false); }

TexturePlane bright_patch() {
  TexturePlane image{.name = "sky", .width = 32, .height = 16, .channels = 3, .values = {}};
  for (int row = 0; row < 16; ++row) {
    for (int column = 0; column < 32; ++column) {
      const bool is_bright = row >= 2 && row < 5 && column >= 6 && column < 12;
      image.values.insert(image.values.end(), 3, is_bright ? 500.0f : 0.5f);
    }
  }
  return image;
}

std::vector<LitFloor> lit_floors() {
  const auto lamp = [](tests::RoomBuilder& builder) {
    return builder.add_material("lamp", {0, 0, 0}, {900, 700, 500});
  };
  const std::vector<Receiver> all = {{"lit", {2, 0, 0}}, {"penumbra", {0.75, 0, 0.1}}, {"dark", {0.45, 0, 0.1}}};
  return {
      {"rectangle",
       [lamp](auto& builder) {
         builder.add_quad("lamp", {-0.5, 2, -0.5}, {1, 0, 0}, {0, 0, 1}, lamp(builder));
       },
       all},
      {"near_rectangle",
       [lamp](auto& builder) {
         builder.add_quad("lamp", {-2, 1, -2}, {4, 0, 0}, {0, 0, 4}, lamp(builder));
       },
       all},
      {"windows",
       [lamp](auto& builder) {
         const int material = lamp(builder);
         for (int k = 0; k < 5; ++k) {
           builder.add_quad("window", {-3.0 + 1.2 * k, 0.6, -3}, {0.8, 0, 0}, {0, 1 + 0.1 * k, 0}, material);
         }
       },
       {{"lit", {2, 0, 0}}, {"penumbra", {0, 0, 1.3}}, {"dark", {0, 0, 0}}}},
      {"many_triangles",
       [lamp](auto& builder) {
         Mesh sphere = tests::make_sphere(6);
         sphere.material = lamp(builder);
         sphere.normals.clear();
         for (Vec3& p : sphere.positions) p = p * 0.4 + Vec3{0, 2, 0};
         builder.scene().meshes.push_back(sphere);
       },
       {{"lit", {2, 0, 0}}, {"penumbra", {0.75, 0, 0.1}}}},
      {"point_lamp",
       [](auto& builder) {
         builder.scene().lights.push_back({"lamp", PointLight{{0, 2, 0}, {100, 90, 80}}});
       },
       {{"lit", {2, 0, 0}}, {"edge", {0.8333, 0, 0.1}}}},
      {"spot",
       [](auto& builder) {
         builder.scene().lights.push_back({"spot", SpotLight{{0, 2, 0}, {0, -1, 0}, {100, 90, 80}, 0.3, 0.6}});
       },
       {{"ramp", {1, 0, 0}}, {"edge", {0.8333, 0, 0.1}}}},
      {"sun_with_disc",
       [](auto& builder) {
         builder.scene().lights.push_back({"sun", DirectionalLight{{0, -1, 0}, {1000, 900, 800}, 0.3}});
       },
       {{"penumbra", {0.5, 0, 0.1}}}},
      {"directional",
       [](auto& builder) {
         builder.scene().lights.push_back({"sun", DirectionalLight{{0, -1, 0}, {1000, 900, 800}}});
       },
       {{"edge", {0.47, 0, 0.1}}}},
      {"environment",
       [](auto& builder) { builder.scene().environment = bright_patch(); },
       {{"lit", {2, 0, 0}}, {"shaded", {0.3, 0, 0.1}}}},
  };
}

struct Moments {
  double mean = 0, variance = 0, error_of_variance = 0;
};
/// The standard error of the variance is that of a mean of squares.
Moments moments_of(const std::vector<double>& values) {
  Moments moments;
  const auto n = static_cast<double>(values.size());
  for (const double v : values) moments.mean += v / n;
  double fourth = 0;
  for (const double v : values) {
    const double d = v - moments.mean;
    moments.variance += d * d / (n - 1);
    fourth += d * d * d * d / n;
  }
  moments.error_of_variance = std::sqrt(std::max(0.0, fourth - moments.variance * moments.variance) / n);
  return moments;
}

class Replicates : public ::testing::TestWithParam<LitFloor> {};
void PrintTo(const LitFloor& lit, std::ostream* out) { *out << lit.name; }

TEST_P(Replicates, SpreadAsTheirMeanDoesOverSeeds) {
  tests::RoomBuilder builder(5);
  builder.add_quad("floor", {-5, 0, -5}, {0, 0, 10}, {10, 0, 0}, builder.add_material("grey", {0.5, 0.5, 0.5}));
  add_block(builder);
  GetParam().add_lights(builder);
  const Scene scene = builder.scene();
  const SurveyedScene surveyed = survey_scene(scene).value();
  const Surfaces& surfaces = surveyed.surfaces;
  const auto visibility = make_embree_visibility(surfaces.corners);
  const DirectLight direct(surfaces, *visibility, kSamples, Environment::Part::kBright);
  DirectLight::Scratch scratch;

  for (const Receiver& receiver : GetParam().receivers) {
    std::vector<double> means, squared_errors;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      std::vector<Site> sites;
      for (std::uint64_t s = 0; s < kSamples; ++s) {
        const std::uint64_t bits = mixed_bits(mixed_bits(seed) + s);
        const double x = static_cast<double>(bits >> 32) * 0x1p-32,
                     z = static_cast<double>(bits & 0xffffffff) * 0x1p-32;
        const Vec3 at = receiver.middle + Vec3{0.2 * (x - 0.5), 0, 0.2 * (z - 0.5)};
        // The floor's triangles are corners (0, 1, 2) and (0, 2, 3) of a square: z along the first edge, x the second.
        const double along_z = (at.z + 5) / 10, along_x = (at.x + 5) / 10;
        const SurfacePoint p = along_z > along_x ? SurfacePoint{0, along_z - along_x, along_x}
                                                 : SurfacePoint{1, along_z, along_x - along_z};
        sites.push_back(front_site(surfaces, p, surfaces.normals[p.triangle]));
      }
      const std::vector<std::uint8_t> none(sites.size(), 0);
      std::array<Vec3, kReplicates> replicates;
      direct.estimate(sites, none, seed_of(seed, 1, 1), scratch, replicates);
      double mean = 0, squares = 0;
      for (const Vec3 replicate : replicates) mean += replicate.x / kReplicates;
      for (const Vec3 replicate : replicates) squares += (replicate.x - mean) * (replicate.x - mean);
      means.push_back(mean);
      squared_errors.push_back(squares / (kReplicates * (kReplicates - 1)));
    }
    const Moments of_means = moments_of(means), stated = moments_of(squared_errors);
    const double error_of_stated = std::sqrt(stated.variance / kSeeds);
    const double error = std::hypot(of_means.error_of_variance, error_of_stated);
    EXPECT_GT(of_means.variance, 0) << receiver.name;
    EXPECT_NEAR(stated.mean, of_means.variance, kFourSigma * error) << receiver.name;
    EXPECT_LT(error, kSharp * of_means.variance) << receiver.name << ": the comparison says little";
  }
}

INSTANTIATE_TEST_SUITE_P(EveryKindOfLight, Replicates, ::testing::ValuesIn(lit_floors()),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace radbake::radiosity
