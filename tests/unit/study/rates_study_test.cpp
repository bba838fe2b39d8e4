#include "server/study/rates_study.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "server/study/line_fit.h"

namespace radbake::study {
namespace {

/// Squares that face each other, with and without a plate between, and that share an edge; one pair in a plane.
const char kCases[] = R"([
  {"id": "apart", "from": 0, "to": 1,
   "polygons": [[[0,0,0],[1,0,0],[1,1,0],[0,1,0]], [[0,1,1],[1,1,1],[1,0,1],[0,0,1]]]},
  {"id": "edge", "from": 0, "to": 1,
   "polygons": [[[0,0,0],[1,0,0],[1,1,0],[0,1,0]], [[1,0,0],[1,0,1],[1,1,1],[1,1,0]]]},
  {"id": "plate", "from": 0, "to": 1, "occluders": [2],
   "polygons": [[[0,0,0],[1,0,0],[1,1,0],[0,1,0]], [[0,1,1],[1,1,1],[1,0,1],[0,0,1]],
                [[0,0,0.5],[0.5,0,0.5],[0.5,1,0.5],[0,1,0.5]]]},
  {"id": "plane", "from": 0, "to": 1,
   "polygons": [[[0,0,0],[1,0,0],[1,1,0],[0,1,0]], [[2,0,0],[3,0,0],[3,1,0],[2,1,0]]]},
  {"id": "point", "from": 0, "to": 1, "polygons": [[[0,0,0]], [[2,0,0],[3,0,0],[3,1,0],[2,1,0]]]}])";

const RateStudy& small_study() {
  static const RateStudy study = study_rates(nlohmann::ordered_json::parse(kCases), {1 << 14, 64, 32, 16});
  return study;
}

const RateCurve& curve(const std::string& id, RateKind kind) {
  const auto& curves = small_study().curves;
  return *std::find_if(curves.begin(), curves.end(), [&](const RateCurve& c) { return c.id == id && c.kind == kind; });
}

TEST(Rates, GroupCasesByWhatIsHardAboutThem) {
  ASSERT_EQ(small_study().curves.size(), 9U);
  EXPECT_EQ(curve("apart", RateKind::kHemisphere).group, PairGroup::kApart);
  EXPECT_EQ(curve("edge", RateKind::kHemisphere).group, PairGroup::kTouching);
  EXPECT_EQ(curve("plate", RateKind::kHemisphere).group, PairGroup::kOccluded);
}

TEST(Rates, LeaveOutWhatCannotBeMeasuredAndSayWhy) {
  ASSERT_EQ(small_study().left_out.size(), 2U);
  EXPECT_EQ(small_study().left_out[0], "plane: its form factor is 0");
  EXPECT_NE(small_study().left_out[1].find("point: "), std::string::npos);
}

TEST(Rates, OfRaysLieBetweenThoseOfIndependentRaysAndOfNetsInThePlane) {
  // From N^-1/2 to N^-3/4, and the spread of errors that are the root of the mean of 16 squares: 18 % each, over a
  // range of 2^6 in N.
  constexpr double kSpread = 0.1;
  for (const char* id : {"apart", "edge", "plate"}) {
    const double slope = log_log_slope(curve(id, RateKind::kHemisphere).points).value;
    EXPECT_LE(slope, -0.5 + kSpread) << id;
    EXPECT_GE(slope, -0.75 - kSpread) << id;
  }
}

TEST(Rates, OfHemicubesAreOfFirstOrderOrBetter) {
  constexpr double kSpread = 0.15;
  for (const char* id : {"apart", "edge", "plate"}) {
    for (const RateKind kind : {RateKind::kHemicubePlace, RateKind::kHemicubePair}) {
      EXPECT_LE(log_log_slope(curve(id, kind).points).value, -1 + kSpread) << id << " " << rate_kind_name(kind);
    }
  }
}

TEST(Rates, TableAndPlotHoldEveryEstimatorAndReference) {
  const std::string csv = rate_csv(small_study());
  // 3 cases with 6 numbers of rays (16 to 2^14), 5 resolutions at a place and 4 over a polygon.
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 3 * (6 + 5 + 4));
  EXPECT_NE(csv.find("\nedge,touching,0.200043776075,hemicube,32,"), std::string::npos);
  const Plot plot = rate_plot(small_study());
  ASSERT_EQ(plot.panels.size(), 3U);
  for (const Panel& panel : plot.panels) EXPECT_EQ(panel.curves.size(), 3U + 2U) << panel.title;
  EXPECT_NE(rate_table(small_study()).find("theory: -1/2 for independent rays"), std::string::npos);
}

}  // namespace
}  // namespace radbake::study
