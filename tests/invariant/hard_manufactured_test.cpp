// A room whose radiosity is known everywhere, baked with its emission as a texture. Rows that merely sum to 1 fail it.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/invariant/bake_support.h"
#include "tests/invariant/seed_statistics.h"
#include "tests/record_figure.h"
#include "tests/scenes/cube_rooms.h"

namespace radbake::tests {
namespace {

struct Method {
  std::string name;
  double reflectance;
  radiosity::BakeOptions options;
};

class ManufacturedRoom : public testing::TestWithParam<Method> {};

using radiosity::FormFactors;
using radiosity::Transport;

// By formula every pair has its price: few patches, which are as exact where B is flat. Hemicubes are left out: they
// see from the middle of a patch alone, an error that no seed shows.
INSTANTIATE_TEST_SUITE_P(
    By, ManufacturedRoom,
    testing::Values(Method{"RaysAtReflectance03", 0.3, {.atlas_size = 64, .rays = 256}},
                    Method{"RaysAtReflectance06", 0.6, {.atlas_size = 64, .rays = 256}},
                    Method{"RaysStreamed",
                           0.6,
                           {.atlas_size = 64, .rays = 256, .max_patches = 256, .transport = Transport::kStreamed}},
                    Method{"Formula",
                           0.6,
                           {.atlas_size = 64, .rays = 256, .max_patches = 128, .form_factors = FormFactors::kAnalytic}},
                    Method{
                        "FormulaForNearPairs",
                        0.6,
                        {.atlas_size = 64, .rays = 256, .max_patches = 256, .form_factors = FormFactors::kAdaptive}}),
    [](const auto& info) { return info.param.name; });

TEST(ManufacturedRoomForm, HasThePublishedFormFactorsOnTheMidLineOfAWall) {
  constexpr double kNineDigits = 2e-10;
  EXPECT_NEAR(wall_to_floor(0.5, 0.1), 0.4225448602, kNineDigits);
  EXPECT_NEAR(wall_to_floor(0.5, 0.5), 0.1901358824, kNineDigits);
  EXPECT_NEAR(wall_to_floor(0.5, 0.9), 0.0856451583, kNineDigits);
}

TEST_P(ManufacturedRoom, IsFlatWithinThreeStandardErrors) {
  const double rho = GetParam().reflectance;
  // Linear between texels: what the texture is off by is confined to half a texel along edges and at corners. There it
  // is at most 3e-4 and 0.03, of which a texel of the map (15 times as wide) sees 2 % and 0.05 %: 2e-5 lx.
  constexpr int kTextureSize = 256;
  constexpr double kTexture = 2e-5;
  const Scene scene = manufactured_room(rho, kTextureSize);
  const SeededBakes bakes = bake_with_seeds(scene, GetParam().options);
  ASSERT_GT(bakes.texels.size(), 1500u);
  EXPECT_EQ(bakes.reports[0].plan.survey.num_emitter_triangles, 0u);  // all light is in the rows

  std::vector<std::vector<double>> values;
  std::vector<double> expected;
  for (const SeededTexel& texel : bakes.texels) {
    values.push_back(texel.values);
    expected.push_back(manufactured_irradiance(scene, texel));
  }
  const Distances off = distances(values, expected, kTexture);
  // Neighbours share the patches' noise, so the share is known to about 0.5 %; noise differs over a face by a factor
  // of 2.
  EXPECT_LE(off.share_above_3, 0.035);
  EXPECT_LE(off.largest_pooled, 6);
  EXPECT_LE(off.pooled_standard_error, 0.002);
  record_figure("texel_standard_error", off.pooled_standard_error);
  record_figure("share_above_3", off.share_above_3);
  record_figure("largest_pooled", off.largest_pooled);

  // The mean over each kind of face, far more precise than its texels. Student, 7 degrees of freedom: 0.27 %
  // beyond 4.53.
  constexpr double kThreeSigmaOfEight = 4.53;
  for (const std::string kind : {"floor", "ceiling", "wall"}) {
    std::vector<double> means(kSeeds, 0);
    double should = 0, area = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const SeededTexel& texel = bakes.texels[i];
      if (scene.meshes[texel.mesh].name != kind) continue;
      const double own = (texel.s1 - texel.s0) * (texel.t1 - texel.t0);
      area += own;
      should += own * expected[i];
      for (std::size_t k = 0; k < means.size(); ++k) means[k] += own * values[i][k];
    }
    for (double& mean : means) mean /= area;
    const Seeded face = seeded(means);
    const double distance = std::fabs(face.mean - should / area) / face.standard_error;
    EXPECT_LE(std::fabs(face.mean - should / area), kThreeSigmaOfEight * face.standard_error + kTexture) << kind;
    record_figure(kind + "_standard_error", face.standard_error);
    record_figure(kind + "_distance", distance);
  }
}

}  // namespace
}  // namespace radbake::tests
