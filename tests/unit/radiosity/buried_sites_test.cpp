// Which sites are inside of something, and which are only under it.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "server/radiosity/form_factor/hemisphere.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

constexpr int kRays = 1024;

/// Rows of square receivers of 0.1 m on a floor of 10 x 10 m at y = 0 around the origin.
class Floor {
 public:
  explicit Floor(Scene scene) : scene_(std::move(scene)), surveyed_(survey_scene(scene_).value()) {
    visibility_ = make_embree_visibility(surveyed_.surfaces.corners);
    patches_ = make_patches(surveyed_.surfaces, *visibility_, {1, 1024});
  }

  RowSample row(double x, double z, std::uint64_t seed) const {
    const Surfaces& surfaces = surveyed_.surfaces;
    const HemisphereEstimator estimator(surfaces, patches_, *visibility_, kRays);
    const SobolPoints points(estimator.num_sites());
    const auto seeds = SobolPoints::seeds_of(seed);
    std::vector<Site> sites;
    for (int s = 0; s < points.size(); ++s) {
      const double along_x = (x + 0.1 * (points.coordinate(s, 0, seeds) - 0.5) + 5) / 10;
      const double along_z = (z + 0.1 * (points.coordinate(s, 1, seeds) - 0.5) + 5) / 10;
      const SurfacePoint p =
          along_z > along_x ? SurfacePoint{0, along_z - along_x, along_x} : SurfacePoint{1, along_z, along_x - along_z};
      sites.push_back(front_site(surfaces, p, surfaces.normals[p.triangle]));
    }
    HemisphereEstimator::Scratch scratch;
    RowSample row;
    estimator.sample_row(sites, mixed_bits(seed), scratch, row);
    return row;
  }

 private:
  Scene scene_;
  SurveyedScene surveyed_;
  std::unique_ptr<Visibility> visibility_;
  Patches patches_;
};

tests::RoomBuilder floor_under_sky() {
  tests::RoomBuilder builder(5);
  builder.add_quad("floor", {-5, 0, -5}, {0, 0, 10}, {10, 0, 0}, builder.add_material("grey", {0.5, 0.5, 0.5}));
  builder.scene().sky = {1, 1, 1};
  return builder;
}

/// Form factor from an element to a parallel rectangle x0..x1 by z0..z1 at height c, by its four corners.
double to_rectangle(double x0, double x1, double z0, double z1, double c) {
  const auto corner = [c](double a, double b) {
    const double x = a / c, y = b / c, rx = std::sqrt(1 + x * x), ry = std::sqrt(1 + y * y);
    return (x / rx * std::atan(y / rx) + y / ry * std::atan(x / ry)) / (2 * std::numbers::pi);
  };
  return corner(x1, z1) - corner(x0, z1) - corner(x1, z0) + corner(x0, z0);
}

// Half of a site's rays or more meet the back of a table top that is no more than a sheet: they are absorbed there, and
// the others still bring what is around.
TEST(SitesUnderASheet, AreNotBuriedAtAnyHeight) {
  for (const double height : {0.2, 0.5, 1.0, 2.0}) {
    tests::RoomBuilder builder = floor_under_sky();
    builder.add_quad("table", {-1, height, -1}, {0, 0, 2}, {2, 0, 0}, 0);  // faces up
    const Floor floor(builder.scene());
    for (const double x : {0.0, 0.6, 0.9, 1.0, 1.1}) {
      const RowSample row = floor.row(x, 0.1, 1);
      EXPECT_EQ(row.visible_share, 1) << height << ' ' << x;
      ASSERT_EQ(row.counted, static_cast<std::uint32_t>(kRays));
      const double exact = to_rectangle(-1 - x, 1 - x, -1.1, 0.9, height);
      // At most as wide as independent rays spread; the receiver's width adds its second order.
      const double four_sigma = 4 * std::sqrt(exact * (1 - exact) / kRays), width = 0.005 / height;
      EXPECT_NEAR(static_cast<double>(row.absorbed) / kRays, exact, four_sigma + width) << height << ' ' << x;
    }
  }
}

TEST(SitesInABox, AreBuriedWhetherItHasABottomOrNot) {
  for (const bool has_bottom : {true, false}) {
    tests::RoomBuilder builder = floor_under_sky();
    builder.add_box("box", {-0.5, 0, -0.5}, {0.5, 1, 0.5}, 0, false);
    if (!has_bottom) builder.scene().meshes.erase(builder.scene().meshes.begin() + 1);
    const Floor floor(builder.scene());
    for (const double x : {0.0, 0.3, 0.44}) EXPECT_EQ(floor.row(x, 0.1, 1).visible_share, 0) << x;
    for (const double x : {0.56, 0.7, 2.0}) EXPECT_EQ(floor.row(x, 0.1, 1).visible_share, 1) << x;
    // Across the wall: those inside of it, by a net over the receiver.
    constexpr double kNet = 2.0 / 64;
    EXPECT_NEAR(floor.row(0.52, 0.1, 1).visible_share, 0.7, kNet);
  }
}

TEST(SitesInABox, AreBuriedWhereTwoBoxesCross) {
  tests::RoomBuilder builder = floor_under_sky();
  builder.add_box("one", {-1, -0.2, -0.5}, {0.5, 1, 0.5}, 0, false);
  builder.add_box("other", {-0.5, -0.1, -0.3}, {1, 0.6, 0.3}, 0, false);
  const Floor floor(builder.scene());
  for (const double x : {-0.3, 0.0, 0.4, 0.8}) EXPECT_EQ(floor.row(x, 0.1, 1).visible_share, 0) << x;
  EXPECT_EQ(floor.row(1.1, 0.1, 1).visible_share, 1);
}

// A box that stands beside and under a table: those inside of it are buried, those beside it are not.
TEST(SitesInABox, AreBuriedUnderASheetToo) {
  tests::RoomBuilder builder = floor_under_sky();
  builder.add_quad("table", {-1, 0.8, -1}, {0, 0, 2}, {2, 0, 0}, 0);
  builder.add_box("box", {-0.5, 0, -0.5}, {0.5, 0.5, 0.5}, 0, false);
  const Floor floor(builder.scene());
  EXPECT_EQ(floor.row(0.0, 0.1, 1).visible_share, 0);
  EXPECT_EQ(floor.row(0.6, 0.1, 1).visible_share, 1);
}

TEST(SitesBesideAThinWall, AreNotBuried) {
  for (const bool is_double_sided : {false, true}) {
    tests::RoomBuilder builder = floor_under_sky();
    const int material = builder.add_material("wall", {0.5, 0.5, 0.5}, {}, is_double_sided);
    builder.add_quad("wall", {0, 0, -4}, {0, 2, 0}, {0, 0, 8}, material);
    const Floor floor(builder.scene());
    for (const double x : {-0.5, -0.06, 0.0, 0.06, 0.5}) EXPECT_EQ(floor.row(x, 0.1, 1).visible_share, 1) << x;
  }
}

}  // namespace
}  // namespace radbake::radiosity
