#include <gtest/gtest.h>

#include <cmath>

#include "server/radiosity/form_factor/hemisphere.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

/// A closed unit cube, one patch a face; floor 0, ceiling 1.
class UnitCube {
 public:
  UnitCube() {
    tests::RoomBuilder builder(4);
    builder.add_box("room", {0, 0, 0}, {1, 1, 1}, builder.add_material("grey", {0.5, 0.5, 0.5}, {1, 1, 1}), true);
    scene_ = builder.scene();
    surveyed_ = survey_scene(scene_).value();
    visibility_ = make_embree_visibility(surveyed_.surfaces.corners);
    patches_ = make_patches(surveyed_.surfaces, *visibility_, {1.0, 64});
  }

  /// Share of a face's rays that meet each face.
  std::vector<double> row(std::uint32_t patch, int rays, std::uint64_t seed) const {
    const HemisphereEstimator estimator(surveyed_.surfaces, patches_, *visibility_, rays);
    const SobolPoints site_points(estimator.num_sites());
    const auto seeds = SobolPoints::seeds_of(mixed_bits(seed));
    std::vector<Site> sites;
    for (int s = 0; s < site_points.size(); ++s) {
      const SurfacePoint p =
          patches_.sample(patch, site_points.coordinate(s, 0, seeds), site_points.coordinate(s, 1, seeds));
      sites.push_back(side_site(surveyed_.surfaces, p, patches_.normal(patch, p, surveyed_.surfaces)));
    }
    HemisphereEstimator::Scratch scratch;
    RowSample sample;
    estimator.sample_row(sites, seed, scratch, sample);
    EXPECT_EQ(sample.arrivals.size() + sample.escaped + sample.absorbed, sample.counted);
    EXPECT_EQ(sample.escaped, 0u);
    std::vector<double> shares(patches_.size(), 0);
    for (const std::uint32_t j : sample.arrivals) shares[j] += 1.0 / sample.counted;
    return shares;
  }

  std::size_t num_patches() const { return patches_.size(); }

 private:
  Scene scene_;
  SurveyedScene surveyed_;
  std::unique_ptr<Visibility> visibility_;
  Patches patches_;
};

// Closed forms of the unit cube: opposite faces 0.1998248957, neighbours 0.2000437761 (Howell C-11, C-14).
TEST(HemisphereRow, OfTheUnitCubeMatchesTheClosedForms) {
  const UnitCube cube;
  ASSERT_EQ(cube.num_patches(), 6u);
  constexpr int kRays = 1024, kSeeds = 64;
  std::vector<double> mean(6, 0), squares(6, 0);
  for (int seed = 0; seed < kSeeds; ++seed) {
    const std::vector<double> shares = cube.row(0, kRays, static_cast<std::uint64_t>(seed));
    for (int j = 0; j < 6; ++j) {
      mean[j] += shares[j] / kSeeds;
      squares[j] += shares[j] * shares[j] / kSeeds;
    }
  }
  // Four standard errors of the mean of 64 independent rows: a chance of 6e-5 a face to fail by luck.
  for (int j = 0; j < 6; ++j) {
    const double exact = j == 0 ? 0 : j == 1 ? 0.1998248957 : 0.2000437761;
    const double standard_error = std::sqrt((squares[j] - mean[j] * mean[j]) / (kSeeds - 1));
    EXPECT_NEAR(mean[j], exact, 4 * standard_error) << "face " << j;
    EXPECT_LE(standard_error, 0.001);
  }
}

TEST(HemisphereRow, IsTheSameForTheSameSeedAndAnotherForAnother) {
  const UnitCube cube;
  EXPECT_EQ(cube.row(2, 256, 7), cube.row(2, 256, 7));
  EXPECT_NE(cube.row(2, 256, 7), cube.row(2, 256, 8));
}

TEST(CosineDirections, AreOfUnitLengthAndOfTheCosineDistribution) {
  for (const int n : {8, 256, 4096}) {
    const CosineDirections directions(n);
    CosineDirections::Row row;
    constexpr int kRows = 4000;
    double x = 0, y = 0, z = 0, xy = 0, z_squared = 0, error = 0;
    for (int seed = 0; seed < kRows; ++seed) {
      directions.fill(static_cast<std::uint64_t>(seed), row);
      ASSERT_EQ(row.x.size(), static_cast<std::size_t>(n));
      for (int k = 0; k < n; ++k) {
        const double a = row.x[k], b = row.y[k], c = row.z[k];
        error = std::max(error, std::fabs(a * a + b * b + c * c - 1));
        x += a, y += b, z += c, xy += a * b, z_squared += c * c;
      }
    }
    constexpr double kSinglePrecision = 1e-6;
    EXPECT_LE(error, kSinglePrecision);
    // E x = E y = E xy = 0, E z = 2/3, E z^2 = 1/2. Four standard errors of independent directions, which rows of a
    // net are well below; half of it for z, whose variance is 1/18.
    const double num = static_cast<double>(kRows) * n, tolerance = 4 * std::sqrt(0.25 / num);
    EXPECT_NEAR(x / num, 0, tolerance);
    EXPECT_NEAR(y / num, 0, tolerance);
    EXPECT_NEAR(xy / num, 0, tolerance);
    EXPECT_NEAR(z / num, 2.0 / 3, tolerance / 2);
    EXPECT_NEAR(z_squared / num, 0.5, tolerance);
  }
}

// Runs of 16 are nets: each of 16 equal parts of the hemisphere, seen from above as a ring or a wedge, has one. By z^2,
// which is uniform: one direction in each sixteenth of the square's larger coordinate's square is more than rays by
// chance would give, so the spread of the mean of z^2 over 16 is far below that of 16 independent ones.
TEST(CosineDirections, AreSpreadEvenlyWithinRuns) {
  const CosineDirections directions(256);
  CosineDirections::Row row;
  double square = 0;
  int runs = 0;
  for (int seed = 0; seed < 500; ++seed) {
    directions.fill(static_cast<std::uint64_t>(seed), row);
    for (int first = 0; first < 256; first += 16, ++runs) {
      double sum = 0;
      for (int k = first; k < first + 16; ++k) sum += row.z[k] * row.z[k] - 0.5;
      square += sum / 16 * (sum / 16);
    }
  }
  const double independent = 1.0 / 12 / 16;
  EXPECT_LE(square / runs, independent / 5);
}

}  // namespace
}  // namespace radbake::radiosity
