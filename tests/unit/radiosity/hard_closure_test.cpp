// Hard cases of whole rows: what leaves a patch arrives somewhere. By the numbers of tests/docs/hard_cases.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "common/base/sequence.h"
#include "server/radiosity/form_factor/hemisphere.h"
#include "server/radiosity/survey/survey.h"
#include "tests/record_figure.h"
#include "tests/scenes/rooms.h"
#include "tests/scenes/solids.h"
#include "tests/unit/radiosity/polygon_pairs.h"

namespace radbake::radiosity {
namespace {

/// The faces of a box that face inwards, each cut into n x n.
std::vector<PolygonCorners> faces_inward(Vec3 o, double size, int n) {
  const Vec3 x{size, 0, 0}, y{0, size, 0}, z{0, 0, size};
  std::vector<PolygonCorners> faces;
  const auto add = [&](Vec3 corner, Vec3 u, Vec3 v) {
    const Vec3 s = u / n, t = v / n;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) faces.push_back(parallelogram(corner + s * i + t * j, s, t));
    }
  };
  add(o, x, y), add(o + z, y, x), add(o, y, z), add(o + x, z, y), add(o, z, x), add(o + y, x, z);
  return faces;
}

/// What stands between two of the polygons: all others from `first` on.
std::vector<PolygonCorners> between(const std::vector<PolygonCorners>& polygons, std::size_t i, std::size_t j,
                                    std::size_t first) {
  std::vector<PolygonCorners> occluders;
  for (std::size_t k = first; k < polygons.size(); ++k) {
    if (k != i && k != j) occluders.push_back(polygons[k]);
  }
  return occluders;
}

/// sum_j F_ij, and what is stated of its error.
double row_sum(const std::vector<PolygonCorners>& polygons, std::size_t i, std::size_t first_in_the_way,
               double tolerance, double& stated) {
  double sum = 0;
  for (std::size_t j = 0; j < polygons.size(); ++j) {
    if (j == i) continue;
    const auto result = measured(polygons[i], polygons[j], between(polygons, i, j, first_in_the_way), tolerance);
    sum += result.form_factor;
    stated += result.stated_error;
  }
  return sum;
}

TEST(HardCase14ClosedScene, HasRowsThatSumToOneBeforeAnyRepair) {
  constexpr double kAsked = 2e-7;
  // A unit room, 2 x 2 patches a face, and a half-size box inside: by symmetry all outer rows are one, all inner too.
  std::vector<PolygonCorners> polygons = faces_inward({0, 0, 0}, 1, 2);
  const std::size_t first_inner = polygons.size();
  for (const PolygonCorners& face : faces_inward({0.25, 0.25, 0.25}, 0.5, 1)) polygons.push_back(turned_over(face));
  double worst = 0;
  for (const std::size_t i : {std::size_t{0}, first_inner}) {
    double stated = 0;
    const double error = std::fabs(row_sum(polygons, i, first_inner, 1e-8, stated) - 1);
    EXPECT_LE(error, kAsked) << i;
    EXPECT_LE(error, stated) << i;
    worst = std::max(worst, error);
  }
  tests::record_figure("raw_row_sum_error", worst);
}

TEST(HardCase15OpenScene, SendsTheRestToTheSky) {
  constexpr double kAsked = 1e-6;
  // A box without a lid: what the five faces leave over passes the opening, a polygon in the lid's place.
  const std::vector<PolygonCorners> faces = faces_inward({0, 0, 0}, 1, 1);
  for (const std::size_t i : {0u, 2u, 3u, 4u, 5u}) {
    double sum = 0;
    for (const std::size_t j : {0u, 2u, 3u, 4u, 5u}) sum += measured(faces[i], faces[j], {}, kAsked).form_factor;
    const double sky = measured(faces[i], faces[1], {}, kAsked).form_factor;
    EXPECT_GT(sky, 0.1);
    EXPECT_NEAR(sum + sky, 1, kAsked);
  }
  EXPECT_EQ(measured(faces[0], faces[0], {}, kAsked).form_factor, 0);  // one plate alone gains nothing
}

/// A scene with one patch a face, or finer.
struct Sampled {
  Scene scene;
  SurveyedScene surveyed;
  std::unique_ptr<Visibility> visibility;
  Patches patches;

  explicit Sampled(Scene s, double edge = 1)
      : scene(std::move(s)),
        surveyed(survey_scene(scene).value()),
        visibility(make_embree_visibility(surveyed.surfaces.corners)),
        patches(make_patches(surveyed.surfaces, *visibility, {edge, 4096})) {}

  RowSample row(std::uint32_t patch, int rays, std::uint64_t seed) const {
    const HemisphereEstimator estimator(surveyed.surfaces, patches, *visibility, rays);
    const SobolPoints points(estimator.num_sites());
    const auto seeds = SobolPoints::seeds_of(mixed_bits(seed));
    std::vector<Site> sites;
    for (int s = 0; s < points.size(); ++s) {
      const SurfacePoint p = patches.sample(patch, points.coordinate(s, 0, seeds), points.coordinate(s, 1, seeds));
      sites.push_back(side_site(surveyed.surfaces, p, patches.normal(patch, p, surveyed.surfaces)));
    }
    HemisphereEstimator::Scratch scratch;
    RowSample sample;
    estimator.sample_row(sites, seed, scratch, sample);
    return sample;
  }
};

Scene open_box() {
  tests::RoomBuilder builder(4);
  builder.add_box("room", {0, 0, 0}, {1, 1, 1}, builder.add_material("grey", {0.5, 0.5, 0.5}, {1, 1, 1}), true);
  Scene scene = builder.scene();
  scene.meshes.erase(scene.meshes.begin() + 1);  // the top
  return scene;
}

TEST(HardCase15OpenScene, LosesByRaysWhatTheOpeningTakes) {
  constexpr int kRays = 1024, kSeeds = 64;
  constexpr double kFourStandardErrors = 4;
  const Sampled box(open_box());
  double mean = 0, squares = 0;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const RowSample row = box.row(0, kRays, static_cast<std::uint64_t>(seed));
    EXPECT_EQ(row.arrivals.size() + row.escaped + row.absorbed, row.counted);
    EXPECT_EQ(row.absorbed, 0u);
    const double share = static_cast<double>(row.escaped) / row.counted;
    mean += share / kSeeds;
    squares += share * share / kSeeds;
  }
  const double standard_error = std::sqrt((squares - mean * mean) / (kSeeds - 1));
  EXPECT_NEAR(mean, parallel_rectangles(1, 1, 1), kFourStandardErrors * standard_error);
  EXPECT_LE(standard_error, 0.001);
}

// Its sides are not planar: each is two triangles, folded inwards so that they stand in each other's way.
TEST(HardCase29TwistedBox, HasRowsThatSumToOneByFormulaAndByRays) {
  constexpr double kAsked = 1e-6;
  const Scene scene = tests::twisted_box(0.35);
  std::vector<PolygonCorners> polygons;
  for (const Mesh& mesh : scene.meshes) {
    for (const auto& t : mesh.triangles) {
      polygons.push_back({mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]});
    }
  }
  ASSERT_EQ(polygons.size(), 12u);
  double worst = 0;
  int num_occluded = 0;
  for (std::size_t i = 0; i < polygons.size(); ++i) {
    double stated = 0;
    const double error = std::fabs(row_sum(polygons, i, 0, 2e-8, stated) - 1);
    EXPECT_LE(error, kAsked) << i;
    EXPECT_LE(error, stated) << i;
    worst = std::max(worst, error);
    for (std::size_t j = 0; j < i; ++j) {
      const auto pair = measured(polygons[i], polygons[j], between(polygons, i, j, 0), 1e-4);
      num_occluded += pair.method == AnalyticMethod::kOccluded;
    }
  }
  tests::record_figure("row_sum_error", worst);
  EXPECT_GT(num_occluded, 0);
  // A quad that is not planar is refused as one polygon, with its deviation.
  const Mesh& side = scene.meshes[2];
  const auto refused = polygon_form_factor(side.positions, polygons[0], {}, kAsked);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("is not planar"), std::string::npos) << refused.error().message;
  // By rays none escapes and none is absorbed, so that the rows sum to 1 exactly.
  const Sampled sampled(scene, 0.25);
  for (std::uint32_t patch = 0; patch < sampled.patches.size(); ++patch) {
    const RowSample row = sampled.row(patch, 1024, patch);
    EXPECT_EQ(row.escaped + row.absorbed, 0u) << patch;
    EXPECT_EQ(row.arrivals.size(), row.counted) << patch;
    EXPECT_GT(row.counted, 0u) << patch;
  }
}

TEST(HardCase22ReversedNormals, AreCountedWhereRaysMeetBacks) {
  // The top of a room turned over: what the floor sends there meets a back.
  Scene scene = tests::furnace_room(0.5);
  scene.meshes.resize(6);
  const Sampled right(scene, 4);
  for (auto& triangle : scene.meshes[1].triangles) std::swap(triangle[1], triangle[2]);
  const Sampled wrong(scene, 4);
  constexpr int kRays = 4096;
  EXPECT_EQ(right.row(0, kRays, 1).absorbed, 0u);
  const RowSample floor = wrong.row(0, kRays, 1), top = wrong.row(1, kRays, 1);
  EXPECT_GT(floor.absorbed, kRays / 10u);
  EXPECT_EQ(floor.arrivals.size() + floor.absorbed, floor.counted);
  EXPECT_EQ(floor.escaped, 0u);
  EXPECT_EQ(top.escaped, top.counted);  // it looks outside
  // Where more than half of a patch's rays meet backs, they count for nothing: it lies inside other geometry.
  Scene inside_out = tests::furnace_room(0.5);
  inside_out.meshes.resize(6);
  for (std::size_t m = 1; m < 6; ++m) {
    for (auto& triangle : inside_out.meshes[m].triangles) std::swap(triangle[1], triangle[2]);
  }
  const RowSample buried = Sampled(inside_out, 4).row(0, kRays, 1);
  EXPECT_EQ(buried.counted, 0u);
  EXPECT_EQ(buried.visible_share, 0);
}

}  // namespace
}  // namespace radbake::radiosity
