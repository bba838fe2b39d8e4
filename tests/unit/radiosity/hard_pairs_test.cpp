// Hard cases of two polygons with nothing between them, by the numbers of tests/docs/hard_cases.md.
#include <gtest/gtest.h>

#include <cmath>

#include "server/radiosity/form_factor/analytic_exchange.h"
#include "tests/record_figure.h"
#include "tests/unit/radiosity/polygon_pairs.h"

namespace radbake::radiosity {
namespace {

// Unoccluded values do not depend on the tolerance: they end near rounding.
constexpr double kTolerance = 1e-4;

PolygonCorners floor_at(double x) { return parallelogram({x, 0, 0}, {1, 0, 0}, {0, 1, 0}); }
PolygonCorners ceiling_at(double z) { return parallelogram({0, 0, z}, {0, 1, 0}, {1, 0, 0}); }
const PolygonCorners kWall = parallelogram({0, 0, 0}, {0, 1, 0}, {0, 0, 1});

TEST(HardCase01SharedEdge, IsExactToTenDigitsAtEveryAngle) {
  constexpr double kAsked = 1e-10;
  EXPECT_LE(largest_error(reference_pairs("perp_unit"), kTolerance), kAsked);
  EXPECT_LE(largest_error(reference_pairs("wedge_", 4), kTolerance), kAsked);
  EXPECT_LE(largest_error(reference_pairs("tri_halves"), kTolerance), kAsked);
}

TEST(HardCase02NearlySharedEdge, IsContinuousInTheGap) {
  constexpr double kAsked = 1e-9;
  EXPECT_LE(largest_error(reference_pairs("perp_gap_", 2), kTolerance), kAsked);
  // F grows steadily as the gap g closes, and the last of it by less than g/2: a strip of width g at the wall sees at
  // most half of its light come from there.
  const double touching = perpendicular_rectangles(1, 1, 1);
  double before = 0;
  for (int exponent = -1; exponent >= -8; --exponent) {
    const double gap = std::pow(10, exponent);
    const double value = measured(floor_at(gap), kWall, {}, kTolerance).form_factor;
    EXPECT_GT(value, before) << gap;
    EXPECT_LT(value, touching) << gap;
    EXPECT_GT(value, touching - gap / 2) << gap;
    before = value;
  }
}

TEST(HardCase03NearlyTouchingPlates, AreExactAtAnyGapAndNeverAboveOne) {
  constexpr double kAsked = 1e-9;
  EXPECT_LE(largest_error(reference_pairs("par_gap_", 5), kTolerance), kAsked);
  double before = 0;
  for (int exponent = -1; exponent >= -12; --exponent) {
    const double gap = std::pow(10, exponent);
    const double value = measured(floor_at(0), ceiling_at(gap), {}, kTolerance).form_factor;
    EXPECT_GT(value, before) << gap;
    EXPECT_LE(value, 1) << gap;
    // C-11 as the gap closes: 1 - 2 g + O(g^2 ln g).
    EXPECT_NEAR(value, 1 - 2 * gap, std::max(kAsked, 4 * gap * gap * (1 - std::log(gap)))) << gap;
    before = value;
  }
}

TEST(HardCase04CoplanarOrCoincident, IsExactlyZeroOrRefusedAndNeverNan) {
  for (const char* id : {"coplanar", "back_to_back"}) {
    const PolygonPair pair = reference_pairs(id).at(0);
    EXPECT_EQ(measured(pair, kTolerance).form_factor, 0) << id;
    EXPECT_EQ(measured(pair, kTolerance).stated_error, 0) << id;
  }
  EXPECT_EQ(measured(floor_at(0), floor_at(0), {}, kTolerance).form_factor, 0);
  EXPECT_EQ(measured(floor_at(0), floor_at(0.5), {}, kTolerance).form_factor, 0);
  // Face to face the limits of both sides differ, 1 and 0: an error that says so instead of a number.
  for (const double shift : {0.0, 0.5, 1 - 1e-9}) {
    const auto refused = polygon_form_factor(floor_at(0), turned_over(floor_at(shift)), {}, kTolerance);
    ASSERT_FALSE(refused.ok()) << shift;
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(refused.error().message.find("coincide"), std::string::npos) << refused.error().message;
  }
}

TEST(HardCase05FarAndTiny, KeepsItsRelativeAccuracyToAMillionSizes) {
  constexpr double kAskedRelative = 1e-8;
  const PolygonPair far = reference_pairs("par_far_1e4").at(0);
  EXPECT_LE(largest_error({far}, kTolerance), kAskedRelative * far.exact);
  const PolygonPair near = reference_pairs("par_far_100").at(0);
  EXPECT_LE(largest_error({near}, kTolerance), kAskedRelative * near.exact);
  // C-11 as a series: F = 1/(pi d^2) (1 - 2/3 d^-2 + 17/30 d^-4 - O(d^-6)); the next term is below 1e-8 from d = 30 on.
  double worst = 0;
  for (double d = 30; d < 1e8; d *= 1.7) {
    const double value = measured(floor_at(0), ceiling_at(d), {}, kTolerance).form_factor;
    const double series = (1 - (2.0 / 3 - 17.0 / 30 / (d * d)) / (d * d)) / (M_PI * d * d);
    EXPECT_GT(value, 0);
    worst = std::max(worst, std::fabs(value / series - 1));
  }
  EXPECT_LE(worst, kAskedRelative);
  tests::record_figure("relative_error_to_1e8_sizes", worst);
}

TEST(HardCase06LambertOfASmallSolidAngle, HoldsTwelveDigitsAMillionSizesAway) {
  constexpr double kAskedRelative = 1e-12;
  // From a plate a thousandth as wide a unit square a million away: 1/(pi d^2) (1 - 2 <rho^2>/d^2), <rho^2> = 1/6.
  const double d = 1e6, expected = (1 - 1 / (3 * d * d)) / (M_PI * d * d);
  EXPECT_NEAR(expected, 3.183098862e-13, 5e-23);  // the value asked for
  const auto element = parallelogram({0.4995, 0.4995, 0}, {1e-3, 0, 0}, {0, 1e-3, 0});
  const double open = measured(element, ceiling_at(d), {}, kTolerance).form_factor;
  EXPECT_NEAR(open / expected, 1, kAskedRelative);
  tests::record_figure("relative_error", std::fabs(open / expected - 1));
  // The same by Lambert's formula.
  const auto piece = [](const PolygonCorners& corners) {
    return Piece{corners, plane_of(corners, 0x1p-52, "plate").value()};
  };
  constexpr long kMost = 1'000'000;
  const Exchange lambert = visible_exchange(piece(element), piece(ceiling_at(d)), {}, 1e-30, kMost);
  EXPECT_NEAR(lambert.value / (1e-6 * expected), 1, kAskedRelative);
  tests::record_figure("relative_error_by_lambert", std::fabs(lambert.value / (1e-6 * expected) - 1));
}

TEST(HardCase07Slivers, AreExactDownToAMillionthOfTheirLength) {
  constexpr double kAsked = 1e-9;
  EXPECT_LE(largest_error(reference_pairs("tri_sliver"), kTolerance), kAsked);
  double worst = 0;
  for (const double width : {1e-2, 1e-4, 1e-6}) {
    const auto lying = parallelogram({0, 0, 0}, {width, 0, 0}, {0, 1, 0});
    const auto standing = parallelogram({0, 0, 0}, {0, 1, 0}, {0, 0, width});
    const double error =
        std::fabs(measured(lying, standing, {}, kTolerance).form_factor - perpendicular_rectangles(width, width, 1));
    EXPECT_LE(error, kAsked) << width;
    worst = std::max(worst, error);
  }
  tests::record_figure("perpendicular_slivers", worst);
  // A needle so thin that its normal comes from a cancelled cross product: a number or a named refusal, never NaN.
  for (const double width : {1e-12, 1e-15, 1e-17, 1e-300, 0.0}) {
    const PolygonCorners needle = {{0.1, 0.2, 0}, {0.9, 0.7, 0}, {0.5, 0.45 + width, 0}};
    const auto result = polygon_form_factor(needle, ceiling_at(1), {}, kTolerance);
    if (result.ok()) {
      EXPECT_TRUE(result->form_factor >= 0 && result->form_factor <= 1) << width;
      EXPECT_TRUE(std::isfinite(result->stated_error)) << width;
    } else {
      EXPECT_FALSE(result.error().message.empty());
    }
  }
}

TEST(HardCase08AreasTwelveDecadesApart, KeepAccuracyAndReciprocity) {
  constexpr double kAsked = 1e-8, kAskedReciprocity = 1e-12;
  const auto pairs = reference_pairs("area_ratio_", 3);
  EXPECT_LE(largest_error(pairs, kTolerance), kAsked);
  double worst = 0;
  for (const PolygonPair& pair : pairs) {
    const double there = area_of(pair.from) * measured(pair.from, pair.to, {}, kTolerance).form_factor;
    const double back = area_of(pair.to) * measured(pair.to, pair.from, {}, kTolerance).form_factor;
    EXPECT_NEAR(there / back, 1, kAskedReciprocity) << pair.id;
    worst = std::max(worst, std::fabs(there / back - 1));
  }
  tests::record_figure("reciprocity", worst);
}

TEST(HardCase09AMillionUnitsFromTheOrigin, ChangesNothing) {
  constexpr double kAsked = 1e-9;
  const Vec3 offset{0x1p20, -0x1p20, 0x1p20};
  for (PolygonPair pair : reference_pairs("offset_1e6_", 2)) {
    EXPECT_LE(largest_error({pair}, kTolerance), kAsked) << pair.id;
    const double there = measured(pair, kTolerance).form_factor;
    for (PolygonCorners* corners : {&pair.from, &pair.to}) {
      for (Vec3& corner : *corners) corner = corner - offset;  // exact: the offsets are powers of two
    }
    EXPECT_NEAR(there, measured(pair, kTolerance).form_factor, kAsked) << pair.id;
  }
}

TEST(HardCase10AnyUnit, GivesTheSameNumber) {
  constexpr double kAsked = 1e-12;
  EXPECT_NEAR(measured(reference_pairs("scale_milli").at(0), kTolerance).form_factor,
              measured(reference_pairs("par_unit").at(0), kTolerance).form_factor, kAsked);
  EXPECT_NEAR(measured(reference_pairs("scale_mega").at(0), kTolerance).form_factor,
              measured(reference_pairs("perp_unit").at(0), kTolerance).form_factor, kAsked);
}

TEST(HardCase21Interpenetrating, IsClippedToWhatFacesEachOther) {
  constexpr double kAsked = 1e-9, kAskedPierced = 1e-5;
  EXPECT_LE(largest_error(reference_pairs("interpenetrating"), kTolerance), kAsked);
  EXPECT_LE(largest_error(reference_pairs("horizon_straddle"), kTolerance), kAsked);
  EXPECT_LE(largest_error(reference_pairs("occ_pierce"), kAskedPierced), kAskedPierced);
}

TEST(HardCase22ReversedNormals, SeeNothing) {
  const PolygonPair pair = reference_pairs("one_side_reversed").at(0);
  EXPECT_EQ(measured(pair, kTolerance).form_factor, 0);
  EXPECT_EQ(measured(pair, kTolerance).stated_error, 0);
}

}  // namespace
}  // namespace radbake::radiosity
