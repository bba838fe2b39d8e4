#include "tests/invariant/cube_reference.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "common/base/check.h"
#include "tests/scenes/cube_rooms.h"

namespace radbake::tests {
namespace {

using Range = std::array<double, 2>;

/// sum over both ends of four ranges of (-1)^(i+j+k+l) G.
template <typename Term>
double alternating_sum(const Range& a, const Range& b, const Range& c, const Range& d, const Term& term) {
  double sum = 0;
  for (int k = 0; k < 16; ++k) {
    const int i = k & 1, j = k >> 1 & 1, l = k >> 2 & 1, m = k >> 3 & 1;
    sum += ((i + j + l + m) % 2 == 0 ? 1 : -1) * term(a[i], b[j], c[l], d[m]);
  }
  return sum;
}

/// C-13: A F of rectangles in parallel planes at distance z.
double parallel_exchange(const Range& x, const Range& y, const Range& xi, const Range& eta, double z) {
  return alternating_sum(x, xi, y, eta, [z](double a, double b, double c, double d) {
    const double dx = a - b, dy = c - d, u = std::hypot(dx, z), v = std::hypot(dy, z);
    return (dy * u * std::atan(dy / u) + dx * v * std::atan(dx / v) - z * z / 2 * std::log(dx * dx + dy * dy + z * z)) /
           (2 * std::numbers::pi);
  });
}

/// C-15: A F of rectangles in perpendicular planes; x and xi from the line where the planes meet, y and eta along it.
double perpendicular_exchange(const Range& x, const Range& y, const Range& xi, const Range& eta) {
  return alternating_sum(x, xi, y, eta, [](double a, double b, double c, double e) {
    const double k2 = a * a + b * b, k = std::sqrt(k2), d = c - e, d2 = d * d;
    const double angle = k > 0 ? d * k * std::atan(d / k) : 0;
    return (angle - (k2 + d2 > 0 ? (k2 - d2) / 4 * std::log(k2 + d2) : 0)) / (2 * std::numbers::pi);
  });
}

/// From a point to rectangles, as the sum over their corners.
double point_to_parallel(const Range& x, const Range& y) {
  const auto corner = [](double a, double b) {
    const double s = std::sqrt(1 + a * a), t = std::sqrt(1 + b * b);
    return (a / s * std::atan(b / s) + b / t * std::atan(a / t)) / (2 * std::numbers::pi);
  };
  return corner(x[1], y[1]) - corner(x[0], y[1]) - corner(x[1], y[0]) + corner(x[0], y[0]);
}
double point_to_perpendicular(double height, const Range& depth, const Range& along) {
  const auto corner = [height](double a, double b) {
    const double s = std::hypot(a, height);
    return (std::atan2(b, height) - height / s * std::atan(b / s)) / (2 * std::numbers::pi);
  };
  return corner(depth[1], along[1]) - corner(depth[0], along[1]) - corner(depth[1], along[0]) +
         corner(depth[0], along[0]);
}

/// A range along an axis as distances from one of the cube's faces there.
Range from_face(double low, double high, bool is_high) { return is_high ? Range{1 - high, 1 - low} : Range{low, high}; }

}  // namespace

CubeReference::CubeReference(int n) {
  RADBAKE_CHECK(n > 0 && n % 7 == 0);
  std::map<std::array<int, 3>, std::size_t> orbits;
  for (const CubeFace& face : kCubeFaces) {
    const int s = (face.axis + 1) % 3, t = (face.axis + 2) % 3;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        Patch patch{face, {}, {}};
        patch.low[face.axis] = patch.high[face.axis] = face.is_high ? 1 : 0;
        patch.low[s] = static_cast<double>(i) / n, patch.high[s] = static_cast<double>(i + 1) / n;
        patch.low[t] = static_cast<double>(j) / n, patch.high[t] = static_cast<double>(j + 1) / n;
        // Floor and ceiling: distances from the nearest walls, in any order. Walls: height, distance from a corner.
        std::array<int, 3> key;
        if (face.axis == 1) {
          const int a = std::min(i, n - 1 - i), b = std::min(j, n - 1 - j);
          key = {face.is_high ? 1 : 0, std::min(a, b), std::max(a, b)};
        } else {
          const int height = s == 1 ? i : j, across = s == 1 ? j : i;
          key = {2, height, std::min(across, n - 1 - across)};
        }
        const auto [at, is_new] = orbits.try_emplace(key, orbits.size());
        orbit_of_.push_back(at->second);
        if (is_new) {
          representatives_.push_back(patches_.size());
          const auto is_lit = [n](int k) { return 7 * k >= 3 * n && 7 * k < 4 * n; };
          emission_.push_back(face.axis == 1 && face.is_high && is_lit(i) && is_lit(j) ? kLampExitance : 0);
        }
        patches_.push_back(patch);
      }
    }
  }
  for (const std::size_t i : representatives_) {
    std::vector<double>& row = factors_.emplace_back(orbits.size(), 0);
    for (std::size_t j = 0; j < patches_.size(); ++j) row[orbit_of_[j]] += form_factor(patches_[i], patches_[j]);
  }
}

double CubeReference::form_factor(const Patch& from, const Patch& to) const {
  const int a = from.face.axis, b = to.face.axis;
  const auto range = [](const Patch& patch, int axis) { return Range{patch.low[axis], patch.high[axis]}; };
  const auto area = [&](const Patch& patch) {
    const int s = (patch.face.axis + 1) % 3, t = (patch.face.axis + 2) % 3;
    return (patch.high[s] - patch.low[s]) * (patch.high[t] - patch.low[t]);
  };
  if (a == b) {
    if (from.face.is_high == to.face.is_high) return 0;
    const int s = (a + 1) % 3, t = (a + 2) % 3;
    return parallel_exchange(range(from, s), range(from, t), range(to, s), range(to, t), 1) / area(from);
  }
  const int c = 3 - a - b;
  return perpendicular_exchange(from_face(from.low[b], from.high[b], to.face.is_high), range(from, c),
                                from_face(to.low[a], to.high[a], from.face.is_high), range(to, c)) /
         area(from);
}

double CubeReference::row_sum(std::size_t patch) const {
  double sum = 0;
  for (const double f : factors_[orbit_of_[patch]]) sum += f;
  return sum;
}

std::vector<double> CubeReference::radiosity(double reflectance) const {
  const auto n = static_cast<Eigen::Index>(representatives_.size());
  Eigen::MatrixXd system = Eigen::MatrixXd::Identity(n, n);
  Eigen::VectorXd emission(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    emission(i) = emission_[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; j < n; ++j) {
      system(i, j) -= reflectance * factors_[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
    }
  }
  const Eigen::VectorXd solution = system.partialPivLu().solve(emission);
  std::vector<double> all;
  for (const std::size_t orbit : orbit_of_) all.push_back(solution(static_cast<Eigen::Index>(orbit)));
  return all;
}

std::vector<double> CubeReference::form_factors_from(CubeFace face, const std::array<double, 3>& point) const {
  const int a = face.axis;
  std::vector<double> factors;
  for (const Patch& to : patches_) {
    const int b = to.face.axis;
    const auto relative = [&](int axis) { return Range{to.low[axis] - point[axis], to.high[axis] - point[axis]}; };
    if (a == b) {
      const bool is_same = face.is_high == to.face.is_high;
      factors.push_back(is_same ? 0 : point_to_parallel(relative((a + 1) % 3), relative((a + 2) % 3)));
    } else {
      const double height = to.face.is_high ? 1 - point[b] : point[b];
      factors.push_back(
          point_to_perpendicular(height, from_face(to.low[a], to.high[a], face.is_high), relative(3 - a - b)));
    }
  }
  return factors;
}

}  // namespace radbake::tests
