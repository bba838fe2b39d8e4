#include "tests/unit/radiosity/polygon_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/record_figure.h"

namespace radbake::radiosity {

std::vector<PolygonPair> reference_pairs(const std::string& prefix, std::size_t count) {
  std::ifstream file(RADBAKE_FORM_FACTOR_CASES);
  std::vector<PolygonPair> pairs;
  for (const auto& c : nlohmann::json::parse(file)) {
    if (!c.at("id").get<std::string>().starts_with(prefix)) continue;
    std::vector<PolygonCorners> polygons;
    for (const auto& polygon : c.at("polygons")) {
      PolygonCorners& corners = polygons.emplace_back();
      for (const auto& corner : polygon) corners.push_back({corner.at(0), corner.at(1), corner.at(2)});
    }
    PolygonPair& pair =
        pairs.emplace_back(PolygonPair{c.at("id"), polygons.at(c.at("from")), polygons.at(c.at("to")), {}, 0});
    for (const std::size_t k : c.at("occluders")) pair.occluders.push_back(polygons.at(k));
    pair.exact = c.at("exact");
  }
  EXPECT_EQ(pairs.size(), count) << prefix;
  return pairs;
}

PolygonFormFactor measured(const PolygonPair& pair, double tolerance) {
  // The references have 12 digits or more: below that a stated error cannot be judged.
  constexpr double kReference = 1e-12;
  const PolygonFormFactor result = measured(pair.from, pair.to, pair.occluders, tolerance);
  EXPECT_LE(std::fabs(result.form_factor - pair.exact), std::max(result.stated_error, kReference)) << pair.id;
  return result;
}

PolygonFormFactor measured(const PolygonCorners& from, const PolygonCorners& to,
                           const std::vector<PolygonCorners>& occluders, double tolerance) {
  const auto result = polygon_form_factor(from, to, occluders, tolerance);
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
  if (!result.ok()) return {NAN, NAN, AnalyticMethod::kZero, 0};
  EXPECT_TRUE(std::isfinite(result->form_factor) && std::isfinite(result->stated_error));
  EXPECT_GE(result->form_factor, 0);
  EXPECT_LE(result->form_factor, 1);
  return *result;
}

double largest_error(const std::vector<PolygonPair>& pairs, double tolerance) {
  double largest = 0;
  for (const PolygonPair& pair : pairs) {
    largest = std::max(largest, std::fabs(measured(pair, tolerance).form_factor - pair.exact));
  }
  tests::record_figure(pairs.empty() ? "none" : pairs.front().id, largest);
  return largest;
}

PolygonCorners parallelogram(Vec3 corner, Vec3 u, Vec3 v) { return {corner, corner + u, corner + u + v, corner + v}; }

PolygonCorners turned_over(const PolygonCorners& corners) { return {corners.rbegin(), corners.rend()}; }

double area_of(const PolygonCorners& corners) {
  Vec3 sum;
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    sum += cross(corners[k] - corners[0], corners[k + 1] - corners[0]);
  }
  return length(sum) / 2;
}

double parallel_rectangles(double a, double b, double c) {
  const double X = a / c, Y = b / c, X2 = X * X, Y2 = Y * Y;
  return 2 / (M_PI * X * Y) *
         (std::log((1 + X2) * (1 + Y2) / (1 + X2 + Y2)) / 2 + X * std::sqrt(1 + Y2) * std::atan(X / std::sqrt(1 + Y2)) +
          Y * std::sqrt(1 + X2) * std::atan(Y / std::sqrt(1 + X2)) - X * std::atan(X) - Y * std::atan(Y));
}

double perpendicular_rectangles(double w, double h, double l) {
  // The terms cancel down to W: 64 bits of mantissa keep 12 digits for strips a millionth as wide as long.
  using Wide = long double;
  const Wide W = Wide(w) / l, H = Wide(h) / l, W2 = W * W, H2 = H * H, s2 = W2 + H2, s = std::sqrt(s2);
  const Wide pi = std::acos(Wide(-1));
  return static_cast<double>(1 / (pi * W) *
                             (W * std::atan(1 / W) + H * std::atan(1 / H) - s * std::atan(1 / s) +
                              (std::log1p(W2 * H2 / (1 + s2)) + W2 * std::log(W2 * (1 + s2) / ((1 + W2) * s2)) +
                               H2 * std::log(H2 * (1 + s2) / ((1 + H2) * s2))) /
                                  4));
}

double point_to_parallel_rectangle(double x0, double x1, double y0, double y1, double c) {
  const auto corner = [c](double x, double y) {
    const double X = x / c, Y = y / c, s = std::sqrt(1 + X * X), t = std::sqrt(1 + Y * Y);
    return (X / s * std::atan(Y / s) + Y / t * std::atan(X / t)) / (2 * M_PI);
  };
  return corner(x1, y1) - corner(x0, y1) - corner(x1, y0) + corner(x0, y0);
}

}  // namespace radbake::radiosity
