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

}  // namespace
}  // namespace radbake::radiosity
