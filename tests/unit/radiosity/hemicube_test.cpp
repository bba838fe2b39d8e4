#include "server/radiosity/form_factor/hemicube.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "server/radiosity/form_factor/hemicube_rows.h"
#include "server/radiosity/survey/survey.h"
#include "tests/scenes/rooms.h"
#include "tests/unit/radiosity/cut_scene.h"

namespace radbake::radiosity {
namespace {

/// A scene, its patches and what stands in the way.
struct Room : CutScene {
  Room(Scene s, double edge_metres) : CutScene(std::move(s), edge_metres, 4096) {}

  FormFactorRow row(std::uint32_t patch, int resolution, std::uint64_t seed) const {
    const HemicubeEstimator estimator(surveyed.surfaces, patches, *visibility, resolution);
    const auto scratch = estimator.make_scratch();
    return row(estimator, patch, seed, *scratch);
  }

  FormFactorRow row(const HemicubeEstimator& estimator, std::uint32_t patch, std::uint64_t seed,
                    RowScratch& scratch) const {
    const SobolPoints points(estimator.num_sites());
    const auto seeds = SobolPoints::seeds_of(patch);
    std::vector<Site> sites;
    for (int s = 0; s < points.size(); ++s) {
      const SurfacePoint p = patches.sample(patch, points.coordinate(s, 0, seeds), points.coordinate(s, 1, seeds));
      sites.push_back(side_site(surveyed.surfaces, p, patches.normal(patch, p, surveyed.surfaces)));
    }
    FormFactorRow row;
    std::vector<std::uint8_t> is_buried;
    estimator.estimate(patch, sites, seed, scratch, {}, row, is_buried);
    EXPECT_EQ(is_buried.size(), sites.size());
    return row;
  }
};

double share(const FormFactorRow& row, std::uint32_t patch) {
  for (const FormFactorRow::Entry& entry : row.entries) {
    if (entry.patch == patch) return entry.weight / row.counted;
  }
  return 0;
}

double sum_of(const FormFactorRow& row) {
  double sum = row.escaped + row.absorbed;
  for (const FormFactorRow::Entry& entry : row.entries) sum += entry.weight;
  return sum / row.counted;
}

/// A closed unit cube, one patch a face; floor 0, ceiling 1.
Room unit_cube() {
  tests::RoomBuilder builder(4);
  builder.add_box("room", {0, 0, 0}, {1, 1, 1}, builder.add_material("grey", {0.5, 0.5, 0.5}, {1, 1, 1}), true);
  return Room(builder.scene(), 1.0);
}

/// Weights are floats.
constexpr double kFloatRounding = 1e-6;

TEST(Hemicube, DeltaFormFactorsSumToOne) {
  // 4 additions of corners below 1/4 a pixel, which cancel but for their rounding.
  constexpr double kRoundingPerPixel = 4 * 0x1p-54;
  for (const int resolution : {2, 4, 32, 50, 512}) {
    const Hemicube hemicube(resolution);
    ASSERT_EQ(hemicube.pixels().size(), 3u * resolution * resolution);
    double sum = 0, smallest = 1;
    for (const Hemicube::Pixel& pixel : hemicube.pixels()) {
      sum += pixel.form_factor;
      smallest = std::min(smallest, pixel.form_factor);
    }
    EXPECT_NEAR(sum, 1, kRoundingPerPixel * static_cast<double>(hemicube.pixels().size())) << resolution;
    EXPECT_GT(smallest, 0) << resolution;
  }
}

TEST(Hemicube, DeltaFormFactorsAreThoseOfTheirPixels) {
  // Against area x cos cos' / (pi d^2) at the centre, the classic formula, which is wrong by O(1/r^2) of the pixel.
  constexpr int kResolution = 64;
  constexpr double kSecondOrderInPixel = 8.0 / (kResolution * kResolution);
  const Hemicube hemicube(kResolution);
  constexpr double kArea = 4.0 / (kResolution * kResolution);
  for (const Hemicube::Pixel& pixel : hemicube.pixels()) {
    const Vec3 d = pixel.direction;
    const double reach = std::max({std::fabs(d.x), std::fabs(d.y), d.z});  // cos at the pixel's face = 1 / distance
    const double classic = kArea * d.z * reach * reach * reach / std::numbers::pi;
    ASSERT_NEAR(pixel.form_factor / classic, 1, kSecondOrderInPixel);
  }
}

TEST(Hemicube, TopFaceHoldsTheClosedFormOfASquareOverAnElement) {
  constexpr double kQuarter = 0.1385316060;  // Howell C-11 of an element, X = Y = 1
  constexpr double kPrinted = 1e-9;
  const Hemicube hemicube(16);
  double sum = 0;
  for (const Hemicube::Pixel& pixel : hemicube.pixels()) {
    if (pixel.direction.z > std::max(std::fabs(pixel.direction.x), std::fabs(pixel.direction.y))) {
      sum += pixel.form_factor;
    }
  }
  EXPECT_NEAR(sum, 4 * kQuarter, kPrinted);
}

// From the centre of the floor: the ceiling by the corner formula with X = Y = 1/2, and the walls share the rest.
TEST(HemicubeRow, OfTheUnitCubeConvergesToTheClosedFormsAtFirstOrder) {
  const Room cube = unit_cube();
  ASSERT_EQ(cube.patches.size(), 6u);
  const double u = std::sqrt(1.25);
  const double ceiling = 4 * (2 * 0.5 / u * std::atan(0.5 / u)) / (2 * std::numbers::pi);
  constexpr int kSeeds = 16;
  double rms_of_coarse = 0, rms_of_fine = 0;
  for (const int resolution : {16, 32, 64, 128, 256}) {
    // The outlines of ceiling and walls are at most 4.5 long on the cube's faces, in at most 6 straight parts, so they
    // cross at most 4.5 sqrt(2) r/2 + 12 pixels, each of at most (2/r)^2 / pi.
    const double num_crossed = 4.5 * std::numbers::sqrt2 * resolution / 2 + 12;
    const double first_order = num_crossed * 4 / (std::numbers::pi * resolution * resolution);
    double squares = 0;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
      const FormFactorRow row = cube.row(0, resolution, seed);
      EXPECT_NEAR(share(row, 1), ceiling, first_order) << resolution;
      for (std::uint32_t wall = 2; wall < 6; ++wall) {
        EXPECT_NEAR(share(row, wall), (1 - ceiling) / 4, first_order) << resolution;
      }
      EXPECT_EQ(share(row, 0), 0);
      squares += (share(row, 1) - ceiling) * (share(row, 1) - ceiling) / kSeeds;
    }
    if (resolution == 16) rms_of_coarse = std::sqrt(squares);
    if (resolution == 256) rms_of_fine = std::sqrt(squares);
  }
  // 16 times as many pixels a side: an error that falls at first order is at most a sixteenth, and a half more for
  // luck.
  EXPECT_LE(rms_of_fine, 1.5 * rms_of_coarse / 16);
}

TEST(HemicubeRow, OfAClosedRoomSumsToOne) {
  const Room room(tests::furnace_room(0.5), 0.5);
  const HemicubeEstimator estimator(room.surveyed.surfaces, room.patches, *room.visibility, 16);
  const auto scratch = estimator.make_scratch();
  for (std::uint32_t i = 0; i < room.patches.size(); ++i) {
    const FormFactorRow row = room.row(estimator, i, i, *scratch);
    EXPECT_EQ(row.escaped, 0);
    EXPECT_EQ(row.absorbed, 0);
    EXPECT_NEAR(sum_of(row), 1, kFloatRounding);
  }
}

TEST(HemicubeRow, DependsOnPatchAndSeedAlone) {
  const Room room(tests::furnace_room(0.5), 1.0);
  const HemicubeEstimator estimator(room.surveyed.surfaces, room.patches, *room.visibility);
  const auto used = estimator.make_scratch();
  room.row(estimator, 5, 3, *used);
  const FormFactorRow again = room.row(estimator, 2, 7, *used), first = room.row(2, kHemicubeResolution, 7);
  const FormFactorRow turned = room.row(2, kHemicubeResolution, 8);
  ASSERT_EQ(again.entries.size(), first.entries.size());
  bool differs = turned.entries.size() != first.entries.size();
  for (std::size_t k = 0; k < first.entries.size(); ++k) {
    EXPECT_EQ(again.entries[k].patch, first.entries[k].patch);
    EXPECT_EQ(again.entries[k].weight, first.entries[k].weight);
    differs = differs || turned.entries[k].weight != first.entries[k].weight;
  }
  EXPECT_TRUE(differs);
}

TEST(HemicubeRow, OfAnOpenPlateEscapes) {
  tests::RoomBuilder builder(2);
  builder.add_quad("plate", {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, builder.add_material("grey", {0.5, 0.5, 0.5}, {1, 1, 1}));
  const Room plate(builder.scene(), 1.0);
  const FormFactorRow row = plate.row(0, 8, 1);
  EXPECT_TRUE(row.entries.empty());
  EXPECT_NEAR(row.escaped / row.counted, 1, kFloatRounding);
}

TEST(HemicubeRow, OfAPatchInsideABlockIsBuried) {
  // A block sunk into the floor: the floor's patches below it see backs only.
  tests::RoomBuilder builder(8);
  const int grey = builder.add_material("grey", {0.5, 0.5, 0.5}, {1, 1, 1});
  builder.add_box("room", {0, 0, 0}, {4, 4, 4}, grey, true);
  builder.add_box("block", {1, 1, -1}, {3, 3, 1}, grey, false);
  const Room room(builder.scene(), 0.5);
  int num_buried = 0;
  double buried_area = 0;
  for (std::uint32_t i = 0; i < room.patches.size(); ++i) {
    if (room.row(i, 8, i).counted > 0) continue;
    ++num_buried;
    buried_area += room.patches.area(i);
  }
  // 4 m2 of floor; the block's own bottom and the foot of its sides lie outside the room and see no back.
  EXPECT_GT(num_buried, 0);
  constexpr double kRounding = 1e-9;
  EXPECT_NEAR(buried_area * room.surveyed.surfaces.metres_per_unit * room.surveyed.surfaces.metres_per_unit, 4,
              kRounding);
}

}  // namespace
}  // namespace radbake::radiosity
