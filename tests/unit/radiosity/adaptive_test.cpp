#include "server/radiosity/form_factor/adaptive.h"

#include <gtest/gtest.h>

#include <cmath>

#include "server/radiosity/form_factor/hemisphere_rows.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"
#include "tests/unit/radiosity/cut_scene.h"

namespace radbake::radiosity {
namespace {

constexpr int kRays = 1024;
// Weights are floats; a row of n of them is rounded by at most 2^-24 of its sum.
constexpr double kRoundingOfWeights = 0x1p-23;

struct Room : CutScene {
  Room(tests::RoomBuilder builder, double edge) : CutScene(std::move(builder.scene()), edge, 4096) {}

  std::vector<Site> sites(const RowEstimator& estimator, std::uint32_t patch, std::uint64_t seed) const {
    const SobolPoints points(estimator.num_sites());
    const auto seeds = SobolPoints::seeds_of(seed_of(seed, 2, patch));
    std::vector<Site> all;
    for (int s = 0; s < points.size(); ++s) {
      const SurfacePoint p = patches.sample(patch, points.coordinate(s, 0, seeds), points.coordinate(s, 1, seeds));
      all.push_back(side_site(surveyed.surfaces, p, patches.normal(patch, p, surveyed.surfaces)));
    }
    return all;
  }
  FormFactorRow row(const RowEstimator& estimator, std::uint32_t patch, std::uint64_t seed) const {
    FormFactorRow result;
    std::vector<std::uint8_t> buried;
    const auto scratch = estimator.make_scratch();
    estimator.estimate(patch, sites(estimator, patch, seed), seed_of(seed, 3, patch), *scratch, {}, result, buried);
    return result;
  }
};

/// A unit room with a box in a corner of the floor: its sides touch patches of the floor and of two walls.
Room room_with_box() {
  tests::RoomBuilder builder(8);
  const int wall = builder.add_material("wall", {0.5, 0.5, 0.5}, {1, 1, 1});
  builder.add_box("room", {0, 0, 0}, {1, 1, 1}, wall, true);
  builder.add_box("box", {0.5, 0.25, 0}, {0.75, 0.5, 0.5}, wall, false);
  return {std::move(builder), 0.125};
}

/// Sum over some rows and all patches of A_i (F_ij - exact)^2, and over the pairs that the formula finds.
struct SquaredError {
  double all = 0, near = 0;
};
SquaredError squared_error(const Room& room, const RowEstimator& estimator, const RowEstimator& exact) {
  SquaredError sum;
  for (std::uint32_t i = 0; i < room.patches.size(); i += 5) {
    const FormFactorRow known = room.row(exact, i, 0);
    if (known.counted == 0) continue;
    std::vector<double> difference(room.patches.size(), 0);
    for (const auto& [patch, weight] : known.entries) difference[patch] -= weight / known.counted;
    const FormFactorRow row = room.row(estimator, i, 1);
    for (const auto& [patch, weight] : row.entries) difference[patch] += weight / row.counted;
    for (std::uint32_t j = 0; j < difference.size(); ++j) {
      const double square = room.patches.area(i) * difference[j] * difference[j];
      sum.all += square;
      if (length(room.sites(exact, i, 0)[0].position - room.sites(exact, j, 0)[0].position) < 0.125) sum.near += square;
    }
  }
  return sum;
}

TEST(AdaptiveRows, HaveLessErrorThanTheSameRaysAlone) {
  const Room room = room_with_box();
  const auto& surfaces = room.surveyed.surfaces;
  const AnalyticEstimator exact(surfaces, room.patches, *room.visibility);
  const HemisphereRows rays(surfaces, room.patches, *room.visibility, kRays);
  const AdaptiveEstimator adaptive(surfaces, room.patches, *room.visibility, kRays);
  const SquaredError by_rays = squared_error(room, rays, exact), mixed = squared_error(room, adaptive, exact);
  RecordProperty("rms_by_rays", std::to_string(std::sqrt(by_rays.all)));
  RecordProperty("rms_adaptive", std::to_string(std::sqrt(mixed.all)));
  EXPECT_LT(mixed.all, by_rays.all);
  // Near pairs have the formula's error, which is nothing beside that of rays.
  EXPECT_LT(mixed.near, 1e-4 * by_rays.near);
}

TEST(AdaptiveRows, SumToOneInAClosedRoomAndStayReciprocalWhereTheFormulaSpeaks) {
  const Room room = room_with_box();
  const auto& surfaces = room.surveyed.surfaces;
  const AdaptiveEstimator adaptive(surfaces, room.patches, *room.visibility, kRays);
  std::vector<FormFactorRow> rows;
  for (std::uint32_t i = 0; i < room.patches.size(); ++i) {
    rows.push_back(room.row(adaptive, i, 1));
    const FormFactorRow& row = rows.back();
    if (row.counted == 0) continue;
    double sum = row.escaped + row.absorbed;
    for (const auto& [patch, weight] : row.entries) sum += weight;
    EXPECT_NEAR(sum / row.counted, 1, kRoundingOfWeights) << i;
    EXPECT_EQ(row.clipped, 0);
  }
  // Floor and wall patches at the edge that they share.
  std::size_t num_pairs = 0;
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    for (const auto& [j, weight] : rows[i].entries) {
      const Vec3 a = room.sites(adaptive, i, 1)[0].position, b = room.sites(adaptive, j, 1)[0].position;
      if (j < i || length(a - b) > 0.09) continue;
      const auto found =
          std::find_if(rows[j].entries.begin(), rows[j].entries.end(), [&](const auto& e) { return e.patch == i; });
      ASSERT_NE(found, rows[j].entries.end());
      EXPECT_NEAR(
          room.patches.area(i) * weight / rows[i].counted / (room.patches.area(j) * found->weight / rows[j].counted), 1,
          kRoundingOfWeights);
      ++num_pairs;
    }
  }
  EXPECT_GT(num_pairs, 20u);
}

TEST(AdaptiveRows, ChooseTheFormulaForBothDirectionsOrNone) {
  const PatchExtent small{{0, 0, 0.3}, 0.07, 0.01}, large{{0, 0, 0}, 0.7, 1}, far{{0, 0, 5}, 0.07, 0.01};
  EXPECT_TRUE(is_near_or_large(small, large));
  EXPECT_TRUE(is_near_or_large(large, small));
  EXPECT_FALSE(is_near_or_large(far, large));
  EXPECT_FALSE(is_near_or_large(large, far));
}

TEST(AdaptiveRows, GiveTheFormulaAllWhereNoRayIsLeft) {
  // Two plates so close that all rays meet the other one, or escape at the rim.
  tests::RoomBuilder builder(4);
  const int material = builder.add_material("plate", {0.5, 0.5, 0.5}, {1, 1, 1});
  builder.add_quad("floor", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, material);
  builder.add_quad("ceiling", {0, 0, 1e-5}, {0, 1, 0}, {1, 0, 0}, material);
  const Room room(std::move(builder), 2);
  ASSERT_EQ(room.patches.size(), 2u);
  const AdaptiveEstimator adaptive(room.surveyed.surfaces, room.patches, *room.visibility, 64);
  const FormFactorRow row = room.row(adaptive, 0, 1);
  ASSERT_EQ(row.entries.size(), 1u);
  EXPECT_NEAR(row.entries[0].weight + row.escaped + row.absorbed, row.counted, kRoundingOfWeights * row.counted);
  EXPECT_NEAR(row.entries[0].weight / row.counted, 1 - 2e-5, 1e-4);  // C-11 as the gap c closes: 1 - 2 c
}

}  // namespace
}  // namespace radbake::radiosity
