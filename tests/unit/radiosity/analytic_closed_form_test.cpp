#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "server/radiosity/form_factor/analytic.h"
#include "server/radiosity/form_factor/analytic_quadrature.h"
#include "tests/unit/radiosity/polygon_pairs.h"

namespace radbake::radiosity {
namespace {

// Unoccluded form factors end near rounding: a few hundred terms of a few ulp.
constexpr double kRounding = 1e-12;
// Asked of the occluded integrals here.
constexpr double kTolerance = 1e-6;

PolygonFormFactor form_factor(const PolygonCorners& from, const PolygonCorners& to,
                              const std::vector<PolygonCorners>& occluders = {}, double tolerance = kTolerance) {
  const auto result = polygon_form_factor(from, to, occluders, tolerance);
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
  return result.ok() ? *result : PolygonFormFactor{NAN, NAN, AnalyticMethod::kZero, 0};
}

/// The faces of a box that face inwards: floor, ceiling, x = 0, x = size, y = 0, y = size.
std::array<PolygonCorners, 6> faces_inward(Vec3 o, double size) {
  const Vec3 x{size, 0, 0}, y{0, size, 0}, z{0, 0, size};
  return {parallelogram(o, x, y),     parallelogram(o + z, y, x), parallelogram(o, y, z),
          parallelogram(o + x, z, y), parallelogram(o, z, x),     parallelogram(o + y, x, z)};
}

TEST(PolygonFormFactor, MatchesTheClosedFormOfParallelRectangles) {
  for (const auto& [a, b, c] : {std::array{1.0, 1.0, 1.0}, {2.0, 1.0, 1.0}, {1.0, 1.0, 0.5}, {3.0, 0.2, 0.7}}) {
    const auto result =
        form_factor(parallelogram({0, 0, 0}, {a, 0, 0}, {0, b, 0}), parallelogram({0, 0, c}, {0, b, 0}, {a, 0, 0}));
    EXPECT_NEAR(result.form_factor, parallel_rectangles(a, b, c), kRounding);
  }
  // Published: EES manual, example of F3D_14, in four digits.
  EXPECT_NEAR(parallel_rectangles(1, 1, 0.5), 0.4153, 5e-5);
}

TEST(PolygonFormFactor, MatchesTheClosedFormOfPerpendicularRectanglesThatShareAnEdge) {
  for (const auto& [w, h, l] : {std::array{1.0, 1.0, 1.0}, {1.0, 3.0, 2.0}, {0.1, 5.0, 0.7}}) {
    const auto result =
        form_factor(parallelogram({0, 0, 0}, {w, 0, 0}, {0, l, 0}), parallelogram({0, 0, 0}, {0, l, 0}, {0, 0, h}));
    EXPECT_NEAR(result.form_factor, perpendicular_rectangles(w, h, l), kRounding);
  }
}

TEST(PolygonFormFactor, SharesATetrahedronEqually) {
  const Vec3 a{1, 1, 1}, b{-1, -1, 1}, c{-1, 1, -1}, d{1, -1, -1};
  const std::array<PolygonCorners, 4> faces = {PolygonCorners{b, c, a}, PolygonCorners{a, d, b},
                                               PolygonCorners{a, c, d}, PolygonCorners{b, d, c}};
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      EXPECT_NEAR(form_factor(faces[i], faces[j]).form_factor, i == j ? 0.0 : 1.0 / 3, kRounding) << i << " " << j;
    }
  }
}

TEST(PolygonFormFactor, KeepsRelativeAccuracyFarAway) {
  // Far away F = A'/(pi d^2) (1 - 2/3 (a^2 + b^2)/d^2 ...) for unit squares; the next term is below 2e-15 at 1e4.
  for (const double d : {1e4, 1e5, 1e6}) {
    const auto result =
        form_factor(parallelogram({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), parallelogram({0, 0, d}, {0, 1, 0}, {1, 0, 0}));
    const double expected = (1 - 2.0 / 3 / (d * d)) / (M_PI * d * d);
    EXPECT_NEAR(result.form_factor / expected, 1, kRounding);
    EXPECT_EQ(result.method, AnalyticMethod::kKernel);
  }
}

TEST(PolygonFormFactor, GrowsSteadilyAsTwoPlatesCloseUp) {
  double before = 0;
  for (const double gap : {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
    const auto result =
        form_factor(parallelogram({0, 0, 0}, {1, 0, 0}, {0, 1, 0}), parallelogram({0, 0, gap}, {0, 1, 0}, {1, 0, 0}));
    EXPECT_GT(result.form_factor, before) << gap;
    EXPECT_LE(result.form_factor, 1) << gap;
    // C-11 as the gap c closes: 1 - 2 c + O(c^2 ln c).
    EXPECT_NEAR(result.form_factor, 1 - 2 * gap, 4 * gap * gap * (1 - std::log(gap))) << gap;
    before = result.form_factor;
  }
}

TEST(PolygonFormFactor, AddsUpOverAPatchThatIsNotConvex) {
  const PolygonCorners whole = {{0, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1, 1, 0}, {1, 3, 0}, {0, 3, 0}};
  const PolygonCorners low = parallelogram({0, 0, 0}, {2, 0, 0}, {0, 1, 0}),
                       high = parallelogram({0, 1, 0}, {1, 0, 0}, {0, 2, 0});
  const PolygonCorners wall =
      parallelogram({0.5, -1, -1}, {0, 3, 0}, {0, 0, 2});  // through it, so that clipping takes part
  const PolygonCorners ceiling = parallelogram({0, 0, 1.5}, {0, 2, 0}, {2, 0, 0});
  for (const PolygonCorners& other : {wall, ceiling}) {
    EXPECT_NEAR(form_factor(other, whole).form_factor,
                form_factor(other, low).form_factor + form_factor(other, high).form_factor, kRounding);
    EXPECT_NEAR(4 * form_factor(whole, other).form_factor,
                2 * form_factor(low, other).form_factor + 2 * form_factor(high, other).form_factor, kRounding);
  }
}

TEST(PolygonFormFactor, KeepsReciprocityForAreasTwelveDecadesApart) {
  const PolygonCorners small = parallelogram({0.3, 0.4, 0.01}, {0, 1e-6, 0}, {1e-6, 0, 0});
  const PolygonCorners large = parallelogram({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const double from_small = form_factor(small, large).form_factor, from_large = form_factor(large, small).form_factor;
  EXPECT_GT(from_small, 0.99);
  EXPECT_NEAR(from_large / (from_small * 1e-12), 1, 1e-9);  // the small patch's sides have 10 digits at 0.3
}

TEST(PolygonFormFactor, ClosesAndPairsNestedBoxes) {
  const auto outer = faces_inward({0, 0, 0}, 1);
  std::array<PolygonCorners, 6> inner = faces_inward({0.25, 0.25, 0.25}, 0.5);
  for (PolygonCorners& face : inner) face = turned_over(face);
  const std::vector<PolygonCorners> box(inner.begin(), inner.end());
  double sum = 0, to_inner = 0, stated = 0;
  for (std::size_t j = 0; j < 6; ++j) {
    const auto past = form_factor(outer[0], outer[j], box);
    sum += past.form_factor;
    stated += past.stated_error;
    std::vector<PolygonCorners> others = box;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(j));
    const auto onto = form_factor(outer[0], inner[j], others);
    sum += onto.form_factor;
    to_inner += onto.form_factor;
    stated += onto.stated_error;
    const auto back = form_factor(inner[j], outer[0], others);
    EXPECT_NEAR(onto.form_factor, 0.25 * back.form_factor, onto.stated_error + 0.25 * back.stated_error);
  }
  EXPECT_LE(stated, 12 * kTolerance);
  EXPECT_NEAR(sum, 1, stated);
  // The inner box sees outer faces only, so what reaches it is A_in/A_out.
  EXPECT_NEAR(to_inner, 0.25, stated);
}

TEST(PolygonFormFactor, MatchesOccludedPairsThatSymmetrySolves) {
  const PolygonCorners floor = parallelogram({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const PolygonCorners ceiling = parallelogram({0, 0, 1}, {0, 1, 0}, {1, 0, 0});
  const double whole = parallel_rectangles(1, 1, 1);
  // Half a plate at any height hides half: the points where rays cross it are mirrored.
  for (const double z : {1e-6, 0.1, 0.3, 0.5, 0.9, 1 - 1e-6}) {
    const auto half = form_factor(floor, ceiling, {parallelogram({0, 0, z}, {0.5, 0, 0}, {0, 1, 0})});
    EXPECT_NEAR(half.form_factor, whole / 2, half.stated_error) << z;
    EXPECT_LE(half.stated_error, kTolerance * 2) << z;
  }
  // A quarter at half height hides a quarter.
  const auto quarter = form_factor(floor, ceiling, {parallelogram({0, 0, 0.5}, {0.5, 0, 0}, {0, 0.5, 0})});
  EXPECT_NEAR(quarter.form_factor, whole * 3 / 4, quarter.stated_error);
  // A fin from plate to plate, and one that pierces both, leaves two sealed halves.
  for (const double beyond : {0.0, 0.5}) {
    const auto septum = form_factor(
        floor, ceiling, {parallelogram({0.5, -beyond, -beyond}, {0, 1 + 2 * beyond, 0}, {0, 0, 1 + 2 * beyond})});
    EXPECT_NEAR(septum.form_factor, parallel_rectangles(0.5, 1, 1), septum.stated_error) << beyond;
  }
}

TEST(PolygonFormFactor, AgreesFromBothSidesBehindRandomTriangles) {
  // The two sides are integrated over different patches, so their events and cells differ.
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  const PolygonCorners floor = parallelogram({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  const PolygonCorners wall = parallelogram({0, 0, 0.2}, {0, 1, 0}, {0, 0, 1.5});
  int num_partly_hidden = 0;
  for (int trial = 0; trial < 10; ++trial) {
    std::vector<PolygonCorners> occluders;
    for (int k = 0; k <= trial % 4; ++k) {
      PolygonCorners triangle;
      for (int i = 0; i < 3; ++i) triangle.push_back({unit(random), unit(random), unit(random)});
      occluders.push_back(triangle);
    }
    const double open = form_factor(floor, wall).form_factor;
    const auto there = form_factor(floor, wall, occluders, 1e-5), back = form_factor(wall, floor, occluders, 1e-5);
    EXPECT_NEAR(there.form_factor, 1.5 * back.form_factor, there.stated_error + 1.5 * back.stated_error) << trial;
    EXPECT_LE(there.stated_error, 1e-4) << trial;
    // A run to a tenth of the tolerance must agree within what both state.
    const auto finer = form_factor(floor, wall, occluders, 1e-6);
    EXPECT_NEAR(there.form_factor, finer.form_factor, there.stated_error + finer.stated_error) << trial;
    if (there.form_factor < open - 1e-3 && there.form_factor > 0) ++num_partly_hidden;
  }
  EXPECT_GE(num_partly_hidden, 5);
}

TEST(TriangleRules, IntegrateTheirDegreesExactly) {
  // int a^i b^j over the triangle of area 1 is 2 i! j! / (i + j + 2)!
  const auto check = [](std::span<const TrianglePoint> rule, int degree) {
    for (int i = 0; i <= degree; ++i) {
      for (int j = 0; i + j <= degree; ++j) {
        double sum = 0;
        for (const auto& point : rule) sum += point.weight * std::pow(point.a, i) * std::pow(point.b, j);
        EXPECT_NEAR(sum, 2 * std::tgamma(i + 1) * std::tgamma(j + 1) / std::tgamma(i + j + 3), 1e-14) << i << " " << j;
      }
    }
  };
  check(radon_rule(), 5);
  check(dunavant_rule(), 8);
}

TEST(GaussLegendre, IntegratesPolynomialsExactly) {
  for (int n = 1; n <= 20; ++n) {
    for (int degree = 0; degree < 2 * n; ++degree) {
      double sum = 0;
      for (const auto& [node, weight] : gauss_legendre(n)) sum += weight * std::pow(node, degree);
      EXPECT_NEAR(sum, 1.0 / (degree + 1), 1e-14) << n << " points, degree " << degree;
    }
  }
}

}  // namespace
}  // namespace radbake::radiosity
