#include "server/radiosity/form_factor/analytic_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>
#include <utility>

#include "server/radiosity/form_factor/hemisphere.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"
#include "tests/unit/radiosity/cut_scene.h"

namespace radbake::radiosity {
namespace {

// Weights are floats, so a row of n entries is rounded by at most 2^-24 of its sum.
constexpr double kRoundingOfWeights = 0x1p-24;
// Asked of rows before any repair.
constexpr double kAskedClosure = 2e-7;

/// Quads in metres; the patches' edge is `edge`.
struct Room : CutScene {
  Room(tests::RoomBuilder builder, double edge) : CutScene(std::move(builder.scene()), edge, 4096) {}

  FormFactorRow row(const AnalyticEstimator& estimator, std::uint32_t patch, bool* is_buried = nullptr) const {
    FormFactorRow result;
    std::vector<std::uint8_t> buried;
    const auto scratch = estimator.make_scratch();
    const SurfacePoint p = patches.sample(patch, 0.5, 0.5);
    const Site site = side_site(surveyed.surfaces, p, patches.normal(patch, p, surveyed.surfaces));
    estimator.estimate(patch, std::span(&site, 1), 0, *scratch, {}, result, buried);
    if (is_buried != nullptr) *is_buried = buried.at(0) != 0;
    return result;
  }
  std::vector<FormFactorRow> rows(const AnalyticEstimator& estimator) const {
    std::vector<FormFactorRow> all;
    for (std::uint32_t i = 0; i < patches.size(); ++i) all.push_back(row(estimator, i));
    return all;
  }
};

tests::RoomBuilder unit_room(double size = 1) {
  tests::RoomBuilder builder(8);
  builder.add_box("room", {0, 0, 0}, {size, size, size}, builder.add_material("wall", {0.5, 0.5, 0.5}, {1, 1, 1}),
                  true);
  return builder;
}

Room room_with_box(Vec3 low, Vec3 high) {
  tests::RoomBuilder builder = unit_room();
  builder.add_box("box", low, high, builder.add_material("box", {0.5, 0.5, 0.5}), false);
  return {std::move(builder), 0.25};
}

Room room_with_sheet() {
  tests::RoomBuilder builder = unit_room();
  const int sheet = builder.add_material("sheet", {0.5, 0.5, 0.5}, {}, true);
  builder.add_quad("sheet", {0.3, 0.2, 0.3}, {0.5, 0.1, 0}, {0, 0.1, 0.4}, sheet);
  return {std::move(builder), 0.25};
}

double row_sum(const FormFactorRow& row) {
  double sum = 0;
  for (const FormFactorRow::Entry& entry : row.entries) sum += entry.weight;
  return sum / row.counted;
}

void expect_closed(const Room& room, std::size_t expected_buried, std::size_t expected_outside = 0) {
  const AnalyticEstimator estimator(room.surveyed.surfaces, room.patches, *room.visibility);
  std::size_t num_buried = 0, num_outside = 0;
  double worst = 0;
  for (std::uint32_t i = 0; i < room.patches.size(); ++i) {
    bool is_buried = false;
    const FormFactorRow row = room.row(estimator, i, &is_buried);
    num_buried += is_buried;
    EXPECT_EQ(is_buried, row.counted == 0);
    if (is_buried) continue;
    if (row.entries.empty()) {
      EXPECT_EQ(row.escaped, row.counted) << i;
      ++num_outside;
      continue;
    }
    const double missing = std::abs(row_sum(row) - 1);
    EXPECT_LE(missing, row.stated_error + kRoundingOfWeights) << i;
    EXPECT_EQ(row.escaped, 0) << i;
    EXPECT_LE(row.absorbed / row.counted, row.stated_error) << i;
    worst = std::max(worst, missing);
  }
  EXPECT_EQ(num_buried, expected_buried);
  EXPECT_EQ(num_outside, expected_outside);
  EXPECT_LE(worst, kAskedClosure);
}

TEST(AnalyticRows, SumToOneInARoomWithABoxInTheAir) {
  expect_closed(room_with_box({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75}), 0);
}

TEST(AnalyticRows, SumToOneInARoomWithABoxThatMatchesNoGridLine) {
  expect_closed(room_with_box({0.21, 0.33, 0.17}, {0.58, 0.71, 0.83}), 0);
}

TEST(AnalyticRows, SumToOneInARoomWithADoubleSidedSheet) { expect_closed(room_with_sheet(), 0); }

TEST(AnalyticRows, SumToOneAroundABoxThatStandsOnTheFloorAndBuryWhatItCovers) {
  const Room room = room_with_box({0.25, 0.25, 0}, {0.75, 0.75, 0.5});
  // The box covers 4 patches of the floor, which see the backs of its sides; its own bottom of 4 looks out of the room.
  expect_closed(room, 4, 4);
}

TEST(AnalyticRows, AreReciprocalToTheRoundingOfTheirWeights) {
  const Room room = room_with_sheet();
  const AnalyticEstimator estimator(room.surveyed.surfaces, room.patches, *room.visibility);
  const std::vector<FormFactorRow> rows = room.rows(estimator);
  std::size_t num_pairs = 0;
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    for (const FormFactorRow::Entry& entry : rows[i].entries) {
      const auto& back = rows[entry.patch].entries;
      const auto found = std::find_if(back.begin(), back.end(), [&](const auto& e) { return e.patch == i; });
      ASSERT_NE(found, back.end()) << i << " " << entry.patch;
      const double there = room.patches.area(i) * entry.weight, here = room.patches.area(entry.patch) * found->weight;
      EXPECT_NEAR(there / here, 1, 2 * kRoundingOfWeights);
      ++num_pairs;
    }
  }
  EXPECT_GT(num_pairs, 1000u);
}

TEST(AnalyticRows, AreTheSameWithATableOfExchangesAndWithoutAndFromSeveralThreads) {
  const Room room = room_with_box({0.21, 0.33, 0.17}, {0.58, 0.71, 0.83});
  const auto& surfaces = room.surveyed.surfaces;
  const AnalyticEstimator kept(surfaces, room.patches, *room.visibility),
      unkept(surfaces, room.patches, *room.visibility, AnalyticEstimator::kTolerance, false),
      shared(surfaces, room.patches, *room.visibility);
  std::vector<FormFactorRow> from_threads(room.patches.size());
  std::vector<std::thread> threads;
  for (std::uint32_t first = 0; first < 3; ++first) {
    threads.emplace_back([&, first] {
      for (std::uint32_t i = first; i < room.patches.size(); i += 3) from_threads[i] = room.row(shared, i);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::uint32_t i = 0; i < room.patches.size(); ++i) {
    const FormFactorRow a = room.row(kept, i), b = room.row(unkept, i);
    for (const FormFactorRow* other : {&b, &std::as_const(from_threads[i])}) {
      ASSERT_EQ(a.entries.size(), other->entries.size()) << i;
      EXPECT_EQ(a.stated_error, other->stated_error);
      for (std::size_t k = 0; k < a.entries.size(); ++k) {
        EXPECT_EQ(a.entries[k].patch, other->entries[k].patch);
        EXPECT_EQ(a.entries[k].weight, other->entries[k].weight);
      }
    }
  }
}

// 4 standard errors: of 2000 entries 0.13 are expected beyond by chance, were they independent; 3 allow for it.
TEST(AnalyticRows, AgreeWithRaysWithinFourStandardErrors) {
  constexpr int kRays = 4096, kStrays = 3;
  const Room room = room_with_sheet();
  const auto& surfaces = room.surveyed.surfaces;
  const AnalyticEstimator estimator(surfaces, room.patches, *room.visibility);
  const HemisphereEstimator rays(surfaces, room.patches, *room.visibility, kRays);
  const SobolPoints points(rays.num_sites());
  HemisphereEstimator::Scratch scratch;
  int num_strays = 0, num_entries = 0;
  for (std::uint32_t i = 0; i < room.patches.size(); i += 7) {
    const auto seeds = SobolPoints::seeds_of(seed_of(1, 2, i));
    std::vector<Site> sites;
    for (int s = 0; s < points.size(); ++s) {
      const SurfacePoint p = room.patches.sample(i, points.coordinate(s, 0, seeds), points.coordinate(s, 1, seeds));
      sites.push_back(side_site(surfaces, p, room.patches.normal(i, p, surfaces)));
    }
    RowSample sample;
    rays.sample_row(sites, seed_of(1, 3, i), scratch, sample);
    std::vector<double> hits(room.patches.size(), 0), exact(room.patches.size(), 0);
    for (const std::uint32_t patch : sample.arrivals) hits[patch] += 1.0 / sample.counted;
    const FormFactorRow row = room.row(estimator, i);
    for (const FormFactorRow::Entry& entry : row.entries) exact[entry.patch] = entry.weight / row.counted;
    for (std::size_t j = 0; j < hits.size(); ++j) {
      // A patch that few rays can meet has no normal distribution: one ray more is allowed.
      const double spread = std::sqrt(exact[j] * (1 - exact[j]) / kRays);
      num_strays += std::abs(hits[j] - exact[j]) > 4 * spread + 1.0 / kRays;
      num_entries += exact[j] > 0;
    }
  }
  EXPECT_GT(num_entries, 1000);
  EXPECT_LE(num_strays, kStrays);
}

TEST(AnalyticRows, LeaveWhatAnOpenPlateDoesNotSeeToTheSky) {
  tests::RoomBuilder builder(4);
  const int material = builder.add_material("plate", {0.5, 0.5, 0.5}, {1, 1, 1});
  builder.add_quad("floor", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, material);
  builder.add_quad("ceiling", {0, 0, 1}, {0, 1, 0}, {1, 0, 0}, material);
  const Room room(std::move(builder), 2);
  ASSERT_EQ(room.patches.size(), 2u);
  const AnalyticEstimator estimator(room.surveyed.surfaces, room.patches, *room.visibility);
  const FormFactorRow row = room.row(estimator, 0);
  constexpr double kParallelSquares = 0.19982489569838756;  // C-11 of unit squares at distance 1
  ASSERT_EQ(row.entries.size(), 1u);
  EXPECT_NEAR(row.entries[0].weight / row.counted, kParallelSquares, kRoundingOfWeights);
  EXPECT_NEAR(row.escaped / row.counted, 1 - kParallelSquares, 1e-12);
}

TEST(AnalyticRows, StopWhereTheyAre) {
  const Room room = room_with_box({0.25, 0.25, 0.25}, {0.75, 0.75, 0.75});
  const AnalyticEstimator estimator(room.surveyed.surfaces, room.patches, *room.visibility);
  const auto scratch = estimator.make_scratch();
  std::stop_source stop;
  stop.request_stop();
  FormFactorRow row;
  std::vector<std::uint8_t> buried;
  estimator.estimate(0, {}, 0, *scratch, stop.get_token(), row, buried);
  EXPECT_TRUE(row.entries.empty());
}

TEST(PatchPolygons, AreOnePolygonForEachCellOfAFlatWallAndOneBodyForABox) {
  const Room room = room_with_box({0.21, 0.33, 0.17}, {0.58, 0.71, 0.83});
  const PatchPolygons polygons(room.surveyed.surfaces, room.patches);
  for (std::uint32_t i = 0; i < room.patches.size(); ++i) {
    ASSERT_EQ(polygons.of(i).size(), 1u) << i;
    EXPECT_EQ(polygons.of(i)[0].corners.size(), 4u);
    EXPECT_NEAR(polygon_area(polygons.of(i)[0].corners) / room.patches.area(i), 1, 1e-12);
  }
  const Occluders& occluders = polygons.occluders();
  ASSERT_EQ(occluders.pieces().size(), 12u);
  for (std::uint32_t t = 0; t < room.surveyed.surfaces.size(); ++t) {
    const std::uint32_t body = occluders.body_of(polygons.occluder_of(t));
    ASSERT_NE(body, kNoBody);
    EXPECT_EQ(occluders.faces(body).size(), 6u);
  }
}

}  // namespace
}  // namespace radbake::radiosity
