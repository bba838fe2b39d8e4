// Hard cases of two polygons with something between them, by the numbers of tests/docs/hard_cases.md.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "server/radiosity/form_factor/analytic_quadrature.h"
#include "tests/record_figure.h"
#include "tests/unit/radiosity/polygon_pairs.h"

namespace radbake::radiosity {
namespace {

const PolygonCorners kFloor = parallelogram({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
const PolygonCorners kCeiling = parallelogram({0, 0, 1}, {0, 1, 0}, {1, 0, 0});

/// What passes from a unit square to the one facing it, a unit away, through the rectangle [x0, x1] x [y0, y1] half
/// way.
///
///   F = int_opening F(dA -> ceiling and mirrored floor) dA,   the mirrored floor about (x, y): [2x-1, 2x] x [2y-1, 2y]
///
/// A light path through a point of the opening is a direction that meets the ceiling and, turned round, the floor.
/// The integrand has kinks at 1/2: Gauss rules on each side of them. Another way than the estimator's: no occluder.
double through_opening(double x0, double x1, double y0, double y1) {
  const auto parts = [](double low, double high) {
    std::vector<std::pair<double, double>> halves;
    if (low < 0.5) halves.push_back({low, std::min(high, 0.5)});
    if (high > 0.5) halves.push_back({std::max(low, 0.5), high});
    return halves;
  };
  double sum = 0;
  for (const auto& [xa, xb] : parts(x0, x1)) {
    for (const auto& [ya, yb] : parts(y0, y1)) {
      for (const auto& [s, ws] : gauss_legendre(20)) {
        for (const auto& [t, wt] : gauss_legendre(20)) {
          const double x = xa + (xb - xa) * s, y = ya + (yb - ya) * t;
          const double element =
              point_to_parallel_rectangle(std::max(0.0, 2 * x - 1) - x, std::min(1.0, 2 * x) - x,
                                          std::max(0.0, 2 * y - 1) - y, std::min(1.0, 2 * y) - y, 0.5);
          sum += ws * wt * (xb - xa) * (yb - ya) * element;
        }
      }
    }
  }
  return sum;
}

TEST(OpeningBetweenPlates, AgreesWithTheReferences) {
  constexpr double kTwelveDigits = 1e-11;
  const double whole = parallel_rectangles(1, 1, 1);
  EXPECT_NEAR(through_opening(0, 1, 0, 1), whole, kTwelveDigits);
  EXPECT_NEAR(through_opening(0, 0.5, 0, 0.5), whole / 4, kTwelveDigits);
  EXPECT_NEAR(whole - through_opening(0.25, 0.75, 0.25, 0.75), reference_pairs("occ_center_half").at(0).exact,
              kTwelveDigits);
  EXPECT_NEAR(through_opening(0.5 - 0x1p-7, 0.5 + 0x1p-7, 0, 1), reference_pairs("occ_slit_2-6").at(0).exact,
              kTwelveDigits);
}

TEST(HardCase16ThinWalls, LeakNothing) {
  for (const char* id : {"leak_wall_on_floor", "occ_exact_shaft", "occ_full", "lroom_2_5"}) {
    const PolygonPair pair = reference_pairs(id).at(0);
    for (const double tolerance : {1e-4, 1e-6}) EXPECT_EQ(measured(pair, tolerance).form_factor, 0) << id;
  }
  // A true leak, through a gap of a thousandth, is kept.
  constexpr double kAsked = 1e-7;
  EXPECT_LE(largest_error(reference_pairs("leak_wall_gap_2-10"), kAsked), kAsked);
}

TEST(HardCase17Seams, OfAnOccluderInTwoPartsLetNothingThrough) {
  constexpr double kTolerance = 1e-6;
  const auto split = measured(reference_pairs("occ_split_pair").at(0), kTolerance);
  const auto whole = measured(reference_pairs("occ_center_half").at(0), kTolerance);
  EXPECT_NEAR(split.form_factor, whole.form_factor, split.stated_error + whole.stated_error);
  EXPECT_LE(split.stated_error + whole.stated_error, 2 * kTolerance);
  tests::record_figure("difference", std::fabs(split.form_factor - whole.form_factor));
}

TEST(HardCase18OccluderAlmostOnAPatch, IsNotSkipped) {
  constexpr double kAsked = 1e-6;
  EXPECT_LE(largest_error(reference_pairs("occ_touch_", 3), kAsked), kAsked);
}

TEST(HardCase19TinyOccluders, AreSeenWhateverTheirSize) {
  constexpr double kAsked = 1e-5, kAskedRelative = 0.01;
  const double open = parallel_rectangles(1, 1, 1);
  double worst = 0, worst_share = 0;
  for (int exponent = 3; exponent <= 10; ++exponent) {
    const double edge = std::exp2(-exponent);
    for (const double middle : {0.5, 0.25}) {
      const double low = middle - edge / 2, high = middle + edge / 2;
      // What a tiny plate hides is what an opening in its place lets through.
      const double hidden = through_opening(low, high, low, high);
      const PolygonCorners plate = parallelogram({low, low, 0.5}, {edge, 0, 0}, {0, edge, 0});
      const double tolerance = std::min(kAsked, kAskedRelative * hidden);
      const auto result = measured(kFloor, kCeiling, {plate}, tolerance);
      const double error = std::fabs(result.form_factor - (open - hidden));
      EXPECT_LE(error, kAsked) << edge;
      EXPECT_LE(error, kAskedRelative * hidden) << edge;
      EXPECT_LE(error, result.stated_error) << edge;
      worst = std::max(worst, error);
      worst_share = std::max(worst_share, error / hidden);
    }
  }
  tests::record_figure("error", worst);
  tests::record_figure("share_of_what_is_hidden", worst_share);
}

TEST(HardCase19Slits, AreSeenWhateverTheirWidth) {
  constexpr double kAsked = 1e-5, kAskedRelative = 0.01;
  double worst = 0, worst_relative = 0;
  for (int exponent = 6; exponent <= 14; exponent += 2) {
    const double half = std::exp2(-exponent - 1);
    const double exact = through_opening(0.5 - half, 0.5 + half, 0, 1);
    if (exponent == 10) {
      EXPECT_NEAR(exact, 0.0003233612814, 5e-14);  // published with the reference cases
    }
    const std::vector<PolygonCorners> walls = {parallelogram({-1, -1, 0.5}, {1.5 - half, 0, 0}, {0, 3, 0}),
                                               parallelogram({0.5 + half, -1, 0.5}, {1.5 - half, 0, 0}, {0, 3, 0})};
    const auto result = measured(kFloor, kCeiling, walls, std::min(kAsked, kAskedRelative * exact));
    const double error = std::fabs(result.form_factor - exact);
    EXPECT_LE(error, kAsked) << half;
    EXPECT_LE(error, kAskedRelative * exact) << half;
    EXPECT_LE(error, result.stated_error) << half;
    worst = std::max(worst, error);
    worst_relative = std::max(worst_relative, error / exact);
  }
  tests::record_figure("error", worst);
  tests::record_figure("relative_error", worst_relative);
  EXPECT_LE(largest_error(reference_pairs("occ_slit_2-6"), kAsked), kAsked);
}

TEST(HardCase20PartialOcclusion, IsWeighedByTheKernel) {
  constexpr double kAsked = 1e-5;
  const PolygonPair wall = reference_pairs("occ_perp_lowwall").at(0), corner = reference_pairs("lroom_2_6").at(0);
  EXPECT_LE(largest_error({wall}, kAsked), kAsked);
  EXPECT_LE(largest_error({corner}, kAsked), kAsked);
  EXPECT_LE(largest_error(reference_pairs("lroom_1_5"), kAsked), kAsked);
}

}  // namespace
}  // namespace radbake::radiosity
