#include "server/radiosity/form_factor/analytic_quadrature.h"

#include <array>
#include <cmath>

#include "common/base/check.h"

namespace radbake::radiosity {
namespace {

constexpr int kMostPoints = 20;

std::vector<GaussPoint> make_gauss_legendre(int n) {
  std::vector<GaussPoint> points;
  for (int i = 0; i < n; ++i) {
    // Newton's method from Tricomi's estimate; quadratic, so 8 steps are plenty.
    double x = -std::cos(M_PI * (i + 0.75) / (n + 0.5)), slope = 1;
    for (int step = 0; step < 8; ++step) {
      double p0 = 1, p1 = x;
      for (int k = 2; k <= n; ++k) {
        const double p2 = ((2 * k - 1) * x * p1 - (k - 1) * p0) / k;
        p0 = p1, p1 = p2;
      }
      slope = n * (x * p1 - p0) / (x * x - 1);
      x -= p1 / slope;
    }
    points.push_back({(1 + x) / 2, 1 / ((1 - x * x) * slope * slope)});
  }
  return points;
}

void add_orbit(std::vector<TrianglePoint>& points, double a, double b, double weight) {
  const double c = 1 - a - b;
  points.push_back({a, b, c, weight});
  points.push_back({b, c, a, weight});
  points.push_back({c, a, b, weight});
}

}  // namespace

std::span<const GaussPoint> gauss_legendre(int n) {
  static const auto rules = [] {
    std::array<std::vector<GaussPoint>, kMostPoints + 1> made;
    // The formula of the slope needs n >= 2; one point is the midpoint.
    made[1] = {{0.5, 1}};
    for (int k = 2; k <= kMostPoints; ++k) made[static_cast<std::size_t>(k)] = make_gauss_legendre(k);
    return made;
  }();
  RADBAKE_CHECK_LE(1, n);
  RADBAKE_CHECK_LE(n, kMostPoints);
  return rules[static_cast<std::size_t>(n)];
}

std::span<const TrianglePoint> radon_rule() {
  static const auto points = [] {
    const double root = std::sqrt(15.0), near = (6 - root) / 21, far = (6 + root) / 21;
    std::vector<TrianglePoint> made = {{1. / 3, 1. / 3, 1. / 3, 9. / 40}};
    add_orbit(made, near, near, (155 - root) / 1200);
    add_orbit(made, far, far, (155 + root) / 1200);
    return made;
  }();
  return points;
}

std::span<const TrianglePoint> dunavant_rule() {
  static const auto points = [] {
    std::vector<TrianglePoint> made = {{1. / 3, 1. / 3, 1. / 3, 0.144315607677787}};
    add_orbit(made, 0.459292588292723, 0.459292588292723, 0.095091634267285);
    add_orbit(made, 0.170569307751760, 0.170569307751760, 0.103217370534718);
    add_orbit(made, 0.050547228317031, 0.050547228317031, 0.032458497623198);
    add_orbit(made, 0.263112829634638, 0.728492392955404, 0.027230314174435);
    add_orbit(made, 0.728492392955404, 0.263112829634638, 0.027230314174435);
    return made;
  }();
  return points;
}

}  // namespace radbake::radiosity
