// Receivers that something stands across: which part counts does not depend on the seed, the pass or the rays.
#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "common/base/sequence.h"
#include "server/radiosity/gather/receive.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

constexpr int kReplicates = 4, kShadowRays = 16, kSeeds = 64;
/// Side of the receivers, m.
constexpr double kSide = 0.1;

/// A floor of 4 m a side, a lamp over its right half (x > 0), and what stands at x <= 0. Only the lamp sends light.
class DividedFloor {
 public:
  explicit DividedFloor(Scene scene) : scene_(std::move(scene)), surveyed_(survey_scene(scene_).value()) {
    visibility_ = make_embree_visibility(surveyed_.surfaces.corners);
    patches_ = make_patches(surveyed_.surfaces, *visibility_, {0.5, 65536});
    radiosity_.assign(patches_.size(), Vec3{});
  }

  /// What a receiver gets of which a share lies left of x = 0. Shape: [kSeeds].
  std::vector<Reception> receive_across(double left_share, int rays) const {
    const Surfaces& surfaces = surveyed_.surfaces;
    const HemisphereEstimator rows(surfaces, patches_, *visibility_, rays, 0, kReplicates);
    const DirectLight direct(surfaces, *visibility_, kShadowRays);
    const std::vector<SentLight> sent(kReplicates, {radiosity_});
    const GatherScene scene{surfaces, *visibility_, rows, direct, sent, {}};
    const auto site_at = [&](double u, double v) {
      // Corner 0 of the floor's first triangle is (-2, -2), weight 1 leads along z and weight 2 to the far corner.
      const double x = 2 + (u - left_share) * kSide, z = 2.3 + v * kSide;
      return front_site(surfaces, SurfacePoint{0, (z - x) / 4, x / 4});
    };
    std::vector<Reception> out;
    ReceiveScratch scratch;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      Receiver receiver{7, site_at};
      scratch.sites.clear();
      for (int s = 0; s < rows.num_sites(); ++s) {
        const std::uint64_t bits = mixed_bits(100 * seed + static_cast<std::uint64_t>(s));
        scratch.sites.push_back(
            site_at(static_cast<double>(bits >> 32) * 0x1p-32, static_cast<double>(bits & 0xffffffffu) * 0x1p-32));
      }
      out.push_back(receive(scene, receiver, mixed_bits(seed), mixed_bits(seed + 1000), scratch));
    }
    return out;
  }

 private:
  Scene scene_;
  SurveyedScene surveyed_;
  std::unique_ptr<Visibility> visibility_;
  Patches patches_;
  std::vector<Vec3> radiosity_;
};

tests::RoomBuilder lit_floor() {
  tests::RoomBuilder builder(4);
  const int grey = builder.add_material("grey", {0.6, 0.6, 0.6});
  const int lamp = builder.add_material("lamp", {0, 0, 0}, {400, 400, 400});
  builder.add_quad("floor", {-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, grey);
  builder.add_quad("lamp", {0.5, 2.5, 0}, {1, 0, 0}, {0, 0, 1}, lamp);
  return builder;
}

DividedFloor floor_with_thin_wall() {
  tests::RoomBuilder builder = lit_floor();
  const int wall = builder.add_material("wall", {0.6, 0.6, 0.6}, {}, true);
  builder.add_quad("wall", {0, 0, -2}, {0, 0, 4}, {0, 3, 0}, wall);
  return DividedFloor(builder.scene());
}

double light_of(const Reception& reception) { return reception.mean(kReplicates).irradiance().y; }

// Four sites would miss a quarter of a receiver once in three times.
TEST(ReceiverParts, AreDarkWhereAnEighthLiesBehindAThinWall) {
  const DividedFloor floor = floor_with_thin_wall();
  for (const double share : {0.16, 0.25, 0.5, 0.8}) {
    for (const Reception& reception : floor.receive_across(share, 32)) {
      ASSERT_FALSE(reception.is_buried);
      ASSERT_EQ(light_of(reception), 0) << share;
    }
  }
}

TEST(ReceiverParts, AreLitWhereLessLiesBehind) {
  const DividedFloor floor = floor_with_thin_wall();
  double whole = 0;
  for (const Reception& reception : floor.receive_across(0, 512)) whole += light_of(reception) / kSeeds;
  for (const double share : {0.03, 0.09}) {
    for (const int rays : {32, 512}) {
      double mean = 0;
      for (const Reception& reception : floor.receive_across(share, rays)) mean += light_of(reception) / kSeeds;
      // The lamp is 2.5 m away and as seen from any place of the receiver within 1 % of the same; kSeeds x kShadowRays
      // samples of it spread by less.
      EXPECT_NEAR(mean, whole, 0.01 * whole) << share;
    }
  }
}

// A shaft of single-sided walls that is open above: one ray in fifty gets out, so that its inside is not closed. Nobody
// sees it all the same: a dark receiver beside it would be a dark spot in the picture.
TEST(ReceiverParts, DoNotCountBehindTheScenes) {
  tests::RoomBuilder builder = lit_floor();
  const int wall = builder.add_material("wall", {0.6, 0.6, 0.6});
  builder.add_box("shaft", {-1, 0, -0.2}, {0, 4, 0.8}, wall, false);
  Scene scene = builder.scene();
  std::erase_if(scene.meshes, [](const Mesh& mesh) {
    bool is_top = true, is_bottom = mesh.name != "floor";
    for (const Vec3& p : mesh.positions) is_top = is_top && p.y == 4, is_bottom = is_bottom && p.y == 0;
    return is_top || is_bottom;
  });
  const DividedFloor floor(scene);
  for (const double share : {0.2, 0.5, 0.8}) {
    for (const int rays : {32, 512}) {
      for (const Reception& reception : floor.receive_across(share, rays)) {
        ASSERT_FALSE(reception.is_buried);
        ASSERT_GT(light_of(reception), 0) << share << ", " << rays;
      }
    }
  }
}

}  // namespace
}  // namespace radbake::radiosity
