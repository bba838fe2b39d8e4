// What counts as sealed: receivers inside of something closed that next to no light enters.
#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "server/radiosity/gather/receive.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

constexpr int kRays = 1024, kShadowRays = 16;
/// What `dark` is to a gather, over the radiosity outside.
constexpr double kDark = 1e-3;

/// The middle of the floor under a double-sided box without a bottom, in a room whose front sides send 1.
class BoxOnAFloor {
 public:
  BoxOnAFloor() : scene_(make_scene()), surveyed_(survey_scene(scene_).value()) {
    visibility_ = make_embree_visibility(surveyed_.surfaces.corners);
    patches_ = make_patches(surveyed_.surfaces, *visibility_, {0.25, 65536});
    radiosity_.assign(patches_.size(), Vec3{1, 1, 1});
    for (std::uint32_t patch = 0; patch < radiosity_.size(); ++patch) {
      if (patches_.is_back(patch)) radiosity_[patch] = {};
    }
  }

  /// What sites see of the backs around them.
  const std::vector<std::uint32_t>& seen_backs() {
    if (scratch_.row.arrivals.empty()) receive_inside();
    return scratch_.row.arrivals;
  }

  Reception receive_inside() {
    const Surfaces& surfaces = surveyed_.surfaces;
    const HemisphereEstimator rows(surfaces, patches_, *visibility_, kRays);
    const DirectLight direct(surfaces, *visibility_, kShadowRays);
    const std::vector<SentLight> sent = {{radiosity_}};
    const GatherScene scene{surfaces, *visibility_, rows, direct, sent, {}, 1, {}, kDark};
    // The first triangles are the floor's, 4 m a side; the box stands in their middle.
    Receiver receiver{0, [&](double u, double) {
                        return front_site(surfaces, SurfacePoint{0, 0.01, 0.49 + 0.002 * u}, surfaces.normals[0]);
                      }};
    scratch_.sites.clear();
    for (int s = 0; s < rows.num_sites(); ++s) {
      scratch_.sites.push_back(receiver.site_at(static_cast<double>(s) / rows.num_sites(), 0));
    }
    return receive(scene, receiver, 11, 12, scratch_);
  }

  std::vector<Vec3>& radiosity() { return radiosity_; }

 private:
  static Scene make_scene() {
    tests::RoomBuilder builder(4);
    const int grey = builder.add_material("grey", {0.6, 0.6, 0.6}, {}, true);
    const int lamp = builder.add_material("lamp", {0.5, 0.5, 0.5}, {40, 40, 40});
    builder.add_quad("floor", {-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, grey);
    builder.add_quad("lamp", {1.5, 2.9, 1}, {0.2, 0, 0}, {0, 0, 0.2}, lamp);
    builder.add_box("box", {-1, 0, -1}, {1, 1, 1}, grey, false);
    Scene scene = builder.scene();
    // add_box begins with its bottom or its left side: what lies in the floor's plane goes.
    std::erase_if(scene.meshes, [](const Mesh& mesh) {
      bool is_flat = mesh.name != "floor";
      for (const Vec3& p : mesh.positions) is_flat = is_flat && p.y == 0;
      return is_flat;
    });
    return scene;
  }

  Scene scene_;
  SurveyedScene surveyed_;
  std::unique_ptr<Visibility> visibility_;
  Patches patches_;
  std::vector<Vec3> radiosity_;
  ReceiveScratch scratch_;
};

TEST(SealedSites, AreBuriedWhereNoLightEnters) {
  BoxOnAFloor box;
  const Reception reception = box.receive_inside();
  EXPECT_TRUE(reception.is_buried);
  EXPECT_EQ(reception.visible_share, 0);
}

// Of the rows of a whole room one ray slipped along an edge of the box: one back patch inside is lit by it.
TEST(SealedSites, StayBuriedWhereOneRayLetsALittleLightIn) {
  BoxOnAFloor box;
  box.radiosity()[box.seen_backs().front()] = Vec3{1, 1, 1} * (4 * kDark);
  EXPECT_TRUE(box.receive_inside().is_buried);
}

TEST(SealedSites, AreNotBuriedWhereMoreArrives) {
  BoxOnAFloor box;
  for (const std::uint32_t patch : box.seen_backs()) box.radiosity()[patch] = Vec3{1, 1, 1} * (2 * kDark);
  const Reception reception = box.receive_inside();
  EXPECT_FALSE(reception.is_buried);
  EXPECT_NEAR(reception.replicates[0].gathered.y, 2 * kDark, 1e-9);
}

}  // namespace
}  // namespace radbake::radiosity
