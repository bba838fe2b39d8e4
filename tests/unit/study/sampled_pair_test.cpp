#include "server/study/sampled_pair.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "server/study/form_factor_study.h"

namespace radbake::study {
namespace {

using radiosity::PolygonCorners;

// Fast here; the whole of tests/reference takes minutes at 1e-4.
constexpr double kTolerance = 2e-3;
constexpr int kFewRays = 1 << 16;

PolygonCorners square(double z, bool faces_up, double low = 0, double high = 1) {
  if (faces_up) return {{low, low, z}, {high, low, z}, {high, high, z}, {low, high, z}};
  return {{low, high, z}, {high, high, z}, {high, low, z}, {low, low, z}};
}

struct Known {
  const char* name;
  PolygonCase pair;
  double exact;
};

/// Exact by closed forms: parallel and perpendicular squares (Howell C-11, C-14), the half-plane rule, and 0.
std::vector<Known> known_pairs() {
  const PolygonCorners floor = square(0, true), ceiling = square(1, false);
  const PolygonCorners wall = {{1, 0, 0}, {1, 0, 1}, {1, 1, 1}, {1, 1, 0}};
  const auto half = [](double z) { return PolygonCorners{{0, 0, z}, {0.5, 0, z}, {0.5, 1, z}, {0, 1, z}}; };
  constexpr double kParallel = 0.19982489569838738;
  return {{"parallel", {floor, ceiling, {}}, kParallel},
          {"perpendicular", {floor, wall, {}}, 0.20004377607540316},
          {"near", {floor, square(1e-3, false), {}}, 0.9980056319075797},
          {"half hidden", {floor, ceiling, {half(0.5)}}, kParallel / 2},
          {"half hidden by what lies on the receiver", {floor, ceiling, {half(1)}}, kParallel / 2},
          {"half hidden by what lies on the sender", {floor, ceiling, {half(0)}}, kParallel / 2},
          {"half hidden by what nearly touches the receiver", {floor, ceiling, {half(1 - 1e-6)}}, kParallel / 2},
          {"all hidden", {floor, ceiling, {square(0.5, true)}}, 0}};
}

/// Turned about (1, 2, 3), scaled and moved far away.
PolygonCase moved(const PolygonCase& pair) {
  const Vec3 axis = normalized({1, 2, 3});
  const auto move = [&](PolygonCorners corners) {
    for (Vec3& p : corners) {
      const double c = std::cos(0.7), s = std::sin(0.7);
      p = p * c + cross(axis, p) * s + axis * (dot(axis, p) * (1 - c));
      p = p * 40.0 + Vec3{1e4, -2e4, 3e4};
    }
    return corners;
  };
  PolygonCase out = {move(pair.from), move(pair.to), {}};
  for (const PolygonCorners& occluder : pair.occluders) out.occluders.push_back(move(occluder));
  return out;
}

TEST(SampledPair, ByRaysIsWithinItsStatedError) {
  const SobolPoints points(kFewRays);
  for (const Known& known : known_pairs()) {
    for (const PolygonCase& pair : {known.pair, moved(known.pair)}) {
      const SampledFormFactor found = sampled_by_rays(PolygonPair::make(pair).value(), points, kTolerance);
      EXPECT_LE(std::fabs(found.form_factor - known.exact), found.stated_error) << known.name;
      EXPECT_LE(found.stated_error, kTolerance) << known.name;
    }
  }
}

TEST(SampledPair, ByHemicubesIsWithinItsStatedError) {
  const SobolPoints points(kMaxSitesOfReplicate);
  for (const Known& known : known_pairs()) {
    for (const PolygonCase& pair : {known.pair, moved(known.pair)}) {
      // A looser tolerance, which needs no more than 32 pixels a side.
      const SampledFormFactor found = sampled_by_hemicubes(PolygonPair::make(pair).value(), points, 5 * kTolerance);
      EXPECT_LE(std::fabs(found.form_factor - known.exact), found.stated_error) << known.name;
      EXPECT_LE(found.stated_error, 5 * kTolerance) << known.name;
    }
  }
}

TEST(SampledPair, StatesAnErrorWhereNoRayMeetsTheOther) {
  // Squares a hundred sides apart: 3e-5, and 16384 rays may all miss.
  const PolygonPair pair = PolygonPair::make({square(0, true), square(100, false), {}}).value();
  const SampledFormFactor found = sampled_by_rays(pair, SobolPoints(kFewRays), kTolerance);
  EXPECT_EQ(found.form_factor, 0);
  EXPECT_GE(found.stated_error, 3.18288667328292e-05);
}

TEST(SampledPair, TakesMoreRaysForASmallerTolerance) {
  const PolygonPair pair = PolygonPair::make(known_pairs()[0].pair).value();
  const SobolPoints points(kFewRays);
  const SampledFormFactor coarse = sampled_by_rays(pair, points, 1e-2), fine = sampled_by_rays(pair, points, 1e-3);
  EXPECT_LT(coarse.rays, fine.rays);
  EXPECT_LE(fine.stated_error, 1e-3);
}

TEST(SampledPair, RefusesWhatTheFormulaRefuses) {
  const PolygonCorners floor = square(0, true);
  EXPECT_FALSE(PolygonPair::make({floor, square(0, false), {}}).ok());  // face to face
  PolygonCorners bent = square(1, false);
  bent[2].z = 1.1;
  EXPECT_NE(PolygonPair::make({floor, bent, {}}).error().message.find("not planar"), std::string::npos);
  EXPECT_NE(PolygonPair::make({floor, square(1, false), {bent}}).error().message.find("occluder 0"), std::string::npos);
}

TEST(FormFactorStudy, NamesTheEstimatorsThatThereAre) {
  EXPECT_EQ(pair_estimator_by_name("hemicube").value(), PairEstimator::kHemicube);
  const std::string message = pair_estimator_by_name("radar").error().message;
  for (const char* name : {"radar", "analytic", "hemicube", "hemisphere", "adaptive"}) {
    EXPECT_NE(message.find(name), std::string::npos) << name;
  }
}

TEST(FormFactorStudy, AdaptiveTakesTheFormulaForNearAndLargePairsAndRaysForOthers) {
  // Unit squares: edge to edge; a side apart; 4 sides apart, where one holds 1 / (16 pi) of the other's sky.
  const auto cases = nlohmann::ordered_json::parse(R"([
    {"id": "touching", "from": 0, "to": 1, "exact": 0.20004377607540316,
     "polygons": [[[0,0,0],[1,0,0],[1,1,0],[0,1,0]], [[1,0,0],[1,0,1],[1,1,1],[1,1,0]]]},
    {"id": "large", "from": 0, "to": 1, "exact": 0.19982489569838738,
     "polygons": [[[0,0,0],[1,0,0],[1,1,0],[0,1,0]], [[0,1,1],[1,1,1],[1,0,1],[0,0,1]]]},
    {"id": "far", "from": 0, "to": 1,
     "polygons": [[[0,0,0],[1,0,0],[1,1,0],[0,1,0]], [[0,1,4],[1,1,4],[1,0,4],[0,0,4]]]}])");
  const auto found = study_form_factors(cases, PairEstimator::kAdaptive, kTolerance)["cases"];
  EXPECT_EQ(found[0]["method"], "contour");
  EXPECT_EQ(found[1]["method"], "contour");
  EXPECT_TRUE(found[0]["pass"].get<bool>());
  EXPECT_TRUE(found[1]["pass"].get<bool>());
  EXPECT_EQ(found[2]["method"], "hemisphere");
  const auto exact = study_form_factors(cases, PairEstimator::kAnalytic, kTolerance)["cases"][2];
  EXPECT_LE(std::fabs(found[2]["form_factor"].get<double>() - exact["form_factor"].get<double>()),
            found[2]["stated_error"].get<double>());
}

TEST(FormFactorStudy, JudgesSampledCasesByTheSameRule) {
  auto cases = nlohmann::ordered_json::parse(R"([{"id": "far", "from": 0, "to": 1, "exact": 0.0000318288667328292,
    "polygons": [[[0,0,0],[1,0,0],[1,1,0],[0,1,0]], [[0,1,100],[1,1,100],[1,0,100],[0,0,100]]]}])");
  for (const PairEstimator estimator : {PairEstimator::kHemicube, PairEstimator::kHemisphere}) {
    const auto found = study_form_factors(cases, estimator, kTolerance)["cases"][0];
    EXPECT_TRUE(found["pass"].get<bool>());
    EXPECT_EQ(found["method"], estimator == PairEstimator::kHemicube ? "hemicube" : "hemisphere");
  }
  cases[0]["exact"] = 0.1;
  EXPECT_FALSE(study_form_factors(cases, PairEstimator::kHemisphere, kTolerance)["cases"][0]["pass"].get<bool>());
}

}  // namespace
}  // namespace radbake::study
