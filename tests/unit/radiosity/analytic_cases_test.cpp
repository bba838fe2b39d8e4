#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "server/radiosity/form_factor/analytic.h"

namespace radbake::radiosity {
namespace {

// Asked of unoccluded pairs; weaker ones relative to their value.
constexpr double kUnoccluded = 1e-9, kUnoccludedRelative = 1e-8, kWeak = 1e-6;
// The references have 12 digits or more: below this a stated error cannot be judged.
constexpr double kReference = 1e-12;

struct Case {
  std::string id;
  std::vector<PolygonCorners> polygons;
  std::size_t from = 0, to = 0;
  std::vector<std::size_t> occluders;
  double exact = 0;
};

const std::vector<Case>& all_cases() {
  static const auto cases = [] {
    std::vector<Case> read;
    std::ifstream file(RADBAKE_FORM_FACTOR_CASES);
    for (const auto& c : nlohmann::json::parse(file)) {
      Case made{c.at("id"), {}, c.at("from"), c.at("to"), c.at("occluders"), c.at("exact")};
      for (const auto& polygon : c.at("polygons")) {
        PolygonCorners corners;
        for (const auto& corner : polygon) corners.push_back({corner.at(0), corner.at(1), corner.at(2)});
        made.polygons.push_back(corners);
      }
      read.push_back(made);
    }
    return read;
  }();
  return cases;
}

Result<PolygonFormFactor> measure(const Case& c, double tolerance) {
  std::vector<PolygonCorners> occluders;
  for (const std::size_t k : c.occluders) occluders.push_back(c.polygons[k]);
  return polygon_form_factor(c.polygons[c.from], c.polygons[c.to], occluders, tolerance);
}

/// Whether an error is within what was asked and what was stated.
void expect_accurate(const Case& c, double tolerance) {
  const auto result = measure(c, tolerance);
  ASSERT_TRUE(result.ok()) << c.id << ": " << result.error().message;
  const double error = std::abs(result->form_factor - c.exact);
  const double unoccluded = c.exact < kWeak ? kUnoccludedRelative * c.exact : kUnoccluded;
  EXPECT_LE(error, c.occluders.empty() ? unoccluded : tolerance) << c.id;
  EXPECT_LE(error, std::max(result->stated_error, kReference)) << c.id;
  EXPECT_LE(result->stated_error, 10 * tolerance) << c.id;
  if (c.exact == 0) {
    EXPECT_EQ(result->form_factor, 0) << c.id;
  }
}

/// Rotated and scaled about the centroid of all corners, which goes to `centre`.
Case transformed(const Case& c, std::mt19937_64& random, bool centre_at_origin) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> decades(-3, 3);
  const double w = normal(random), x = normal(random), y = normal(random), z = normal(random);
  const Eigen::Matrix3d rotation =
      Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix() * std::pow(10, decades(random));
  Vec3 centroid;
  double num_corners = 0;
  for (const PolygonCorners& polygon : c.polygons) {
    for (const Vec3& corner : polygon) centroid += corner, ++num_corners;
  }
  centroid = centroid / num_corners;
  Case result = c;
  for (PolygonCorners& polygon : result.polygons) {
    for (Vec3& corner : polygon) {
      const Vec3 d = corner - centroid;
      const Eigen::Vector3d turned = rotation * Eigen::Vector3d(d.x, d.y, d.z);
      corner = Vec3{turned.x(), turned.y(), turned.z()} + (centre_at_origin ? Vec3{} : centroid);
    }
  }
  return result;
}

TEST(FormFactorCases, AreAllWithinTheToleranceAndTheStatedError) {
  ASSERT_EQ(all_cases().size(), 62u);
  for (const Case& c : all_cases()) {
    expect_accurate(c, 1e-4);
    expect_accurate(c, 1e-6);
  }
}

TEST(FormFactorCases, StayAccurateHoweverTheyAreTurnedAndScaled) {
  constexpr int kTurns = 12;
  for (int turn = 1; turn <= kTurns; ++turn) {
    std::mt19937_64 random(static_cast<std::uint64_t>(turn));
    for (const Case& c : all_cases()) {
      expect_accurate(transformed(c, random, true), turn % 4 == 0 ? 1e-6 : 1e-4);
    }
  }
}

TEST(FormFactorCases, StateTheDigitsThatCornersFarFromTheOriginLose) {
  constexpr int kTurns = 12;
  for (int turn = 1; turn <= kTurns; ++turn) {
    std::mt19937_64 random(static_cast<std::uint64_t>(100 + turn));
    for (const Case& c : all_cases()) {
      const Case moved = transformed(c, random, false);
      // A corner at 1e6 is rounded to 1e-10: no result for the rounded corners is nearer to the exact one.
      const bool is_far_from_origin = c.id.starts_with("offset_1e6");
      if (!is_far_from_origin) {
        expect_accurate(moved, 1e-4);
        continue;
      }
      const auto result = measure(moved, 1e-4);
      ASSERT_TRUE(result.ok()) << c.id << ": " << result.error().message;
      EXPECT_LE(std::abs(result->form_factor - c.exact), result->stated_error) << c.id;
      EXPECT_LE(result->stated_error, 1e-3) << c.id;
    }
  }
}

TEST(FormFactorCases, AreReciprocal) {
  for (const Case& c : all_cases()) {
    Case back = c;
    std::swap(back.from, back.to);
    const auto there = measure(c, 1e-6), other = measure(back, 1e-6);
    ASSERT_TRUE(there.ok() && other.ok()) << c.id;
    const auto area = [](const PolygonCorners& corners) {
      Vec3 sum;
      for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
        sum += cross(corners[k] - corners[0], corners[k + 1] - corners[0]);
      }
      return length(sum) / 2;
    };
    const double a = area(c.polygons[c.from]), b = area(c.polygons[c.to]);
    const double slack = a * there->stated_error + b * other->stated_error + kReference * std::min(a, b);
    EXPECT_NEAR(a * there->form_factor, b * other->form_factor, slack) << c.id;
  }
}

TEST(FormFactorCases, KeepTheirBitsUnderAPowerOfTwo) {
  for (const Case& c : all_cases()) {
    Case scaled = c;
    for (PolygonCorners& polygon : scaled.polygons) {
      for (Vec3& corner : polygon) corner = corner * 0x1p-20;
    }
    const auto result = measure(c, 1e-4), small = measure(scaled, 1e-4);
    ASSERT_TRUE(result.ok() && small.ok()) << c.id;
    EXPECT_EQ(result->form_factor, small->form_factor) << c.id;
    EXPECT_EQ(result->stated_error, small->stated_error) << c.id;
  }
}

}  // namespace
}  // namespace radbake::radiosity
