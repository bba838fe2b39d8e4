#include "server/radiosity/lights/rectangle_sampling.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace radbake::radiosity {

SphericalRectangle::SphericalRectangle(Vec3 corner, Vec3 s, Vec3 t, Vec3 viewer) {
  // The rectangle in a frame about the viewer: [x0, x1] x [y0, y1] at z0 < 0.
  const double width = length(s), height = length(t);
  along_x_ = s / width;
  along_y_ = t / height;
  along_z_ = cross(along_x_, along_y_);
  const Vec3 d = corner - viewer;
  z0_ = dot(d, along_z_);
  if (z0_ > 0) {
    z0_ = -z0_;
    along_z_ = -along_z_;
  }
  if (!(z0_ < 0)) return;
  x0_ = dot(d, along_x_);
  y0_ = dot(d, along_y_);
  x1_ = x0_ + width;
  y1_ = y0_ + height;

  // Normals of the planes through the viewer and each edge have one component beside z: n_z of each.
  const auto normal_z = [this](double v) { return v / std::sqrt(z0_ * z0_ + v * v); };
  const double bottom = -normal_z(y0_), right = normal_z(x1_), top = normal_z(y1_), left = -normal_z(x0_);
  const auto angle = [](double a, double b) { return std::acos(std::clamp(-a * b, -1.0, 1.0)); };
  const double g0 = angle(bottom, right), g1 = angle(right, top), g2 = angle(top, left), g3 = angle(left, bottom);
  b0_ = bottom;
  b1_ = top;
  k_ = 2 * std::numbers::pi - g2 - g3;
  solid_angle_ = g0 + g1 - k_;
  if (!(solid_angle_ > kMinSolidAngle)) solid_angle_ = 0;
}

SphericalRectangle::Sample SphericalRectangle::sample(double x, double y) const {
  // Cut a part of x * Omega off along x: cu is the cosine of the cut's angle.
  const double angle = x * solid_angle_ + k_;
  const double fu = (std::cos(angle) * b0_ - b1_) / std::sin(angle);
  const double cu = std::clamp(std::copysign(1 / std::sqrt(fu * fu + b0_ * b0_), fu), -1.0, 1.0);
  const double xu = std::clamp(-(cu * z0_) / std::max(std::sqrt(1 - cu * cu), 1e-12), x0_, x1_);
  // Choose the height on the cut.
  const double d = std::sqrt(xu * xu + z0_ * z0_);
  const double h0 = y0_ / std::sqrt(d * d + y0_ * y0_), h1 = y1_ / std::sqrt(d * d + y1_ * y1_);
  const double hv = h0 + y * (h1 - h0), squared = hv * hv;
  constexpr double kOne = 1 - 1e-12;
  const double yv = std::clamp(squared < kOne ? hv * d / std::sqrt(1 - squared) : y1_, y0_, y1_);
  return {(xu - x0_) / (x1_ - x0_), (yv - y0_) / (y1_ - y0_), along_x_ * xu + along_y_ * yv + along_z_ * z0_};
}

}  // namespace radbake::radiosity
