#include "server/radiosity/lights/triangle_sampling.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace radbake::radiosity {
namespace {

/// Triangles of less area than this over the squared distance are sampled by area: cos and r vary little over them, and
/// the spherical excess of very small ones loses digits.
constexpr double kNarrow = 0.1;

double clamped_acos(double x) { return std::acos(std::clamp(x, -1.0, 1.0)); }

TriangleSample by_area(const std::array<Vec3, 3>& corners, Vec3 normal, double area, Vec3 viewer, double x, double y) {
  const double root = std::sqrt(x);
  TriangleSample sample;
  sample.u = root * (1 - y);
  sample.v = root * y;
  sample.direction = corners[0] * (1 - root) + corners[1] * sample.u + corners[2] * sample.v - viewer;
  const double squared = dot(sample.direction, sample.direction);
  if (squared > 0)
    sample.solid_angle = std::fabs(dot(sample.direction, normal)) * area / (squared * std::sqrt(squared));
  return sample;
}

/// Tangent at a towards b: the part of b orthogonal to a, unit length.
Vec3 tangent(Vec3 a, Vec3 b) {
  const Vec3 t = b - a * dot(a, b);
  const double size = length(t);
  return size > 0 ? t / size : Vec3{};
}

}  // namespace

TriangleSample sampled_triangle(const std::array<Vec3, 3>& corners, Vec3 normal, double area, Vec3 viewer, double x,
                                double y) {
  const Vec3 to_middle = (corners[0] + corners[1] + corners[2]) / 3 - viewer;
  if (area < kNarrow * dot(to_middle, to_middle)) return by_area(corners, normal, area, viewer, x, y);
  std::array<Vec3, 3> d;
  for (int k = 0; k < 3; ++k) {
    d[k] = corners[k] - viewer;
    const double size = length(d[k]);
    if (size <= 0) return by_area(corners, normal, area, viewer, x, y);
    d[k] = d[k] / size;
  }
  // Solid angle: tan(Omega/2) = |a.(b x c)| / (1 + a.b + b.c + c.a). Source: Van Oosterom & Strackee 1983.
  const double triple = std::fabs(dot(d[0], cross(d[1], d[2])));
  const double omega = 2 * std::atan2(triple, 1 + dot(d[0], d[1]) + dot(d[1], d[2]) + dot(d[2], d[0]));
  constexpr double kMinSolidAngle = 1e-6;  // seen from the side
  if (omega < kMinSolidAngle) return by_area(corners, normal, area, viewer, x, y);

  // Cut a sub-triangle of area x * Omega off at the corner a: its third corner c' lies on the arc from a to c.
  const Vec3 a = d[0], b = d[1], c = d[2];
  const double alpha = clamped_acos(dot(tangent(a, b), tangent(a, c)));
  const double cos_c = dot(a, b);
  const double part = x * omega;
  const double s = std::sin(part - alpha), t = std::cos(part - alpha);
  const double u = t - std::cos(alpha), v = s + std::sin(alpha) * cos_c;
  const double denominator = (v * s + u * t) * std::sin(alpha);
  const double q =
      denominator != 0 ? std::clamp(((v * t - u * s) * std::cos(alpha) - v) / denominator, -1.0, 1.0) : 1.0;
  const Vec3 c_part = a * q + tangent(a, c) * std::sqrt(std::max(0.0, 1 - q * q));
  // Choose the point on the arc from b to c'.
  const double z = 1 - y * (1 - dot(c_part, b));
  const Vec3 direction = b * z + tangent(b, c_part) * std::sqrt(std::max(0.0, 1 - z * z));

  // Where that direction meets the triangle: t = distance to plane, (u, v) by Cramer's rule.
  const Vec3 e1 = corners[1] - corners[0], e2 = corners[2] - corners[0], p = cross(direction, e2);
  const double determinant = dot(e1, p);
  if (determinant == 0) return by_area(corners, normal, area, viewer, x, y);
  const Vec3 from = viewer - corners[0], w = cross(from, e1);
  TriangleSample sample;
  sample.u = std::clamp(dot(from, p) / determinant, 0.0, 1.0);
  sample.v = std::clamp(dot(direction, w) / determinant, 0.0, 1.0 - sample.u);
  sample.direction = corners[0] + e1 * sample.u + e2 * sample.v - viewer;
  sample.solid_angle = omega;
  return sample;
}

}  // namespace radbake::radiosity
