#include <algorithm>
#include <tuple>
#include <utility>
#include <vector>

#include "common/base/check.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {
namespace {

Vec3 to_double(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

class BruteForceVisibility final : public Visibility {
 public:
  BruteForceVisibility(std::span<const Corners> triangles, const Opacity* opacity, int channel)
      : triangles_(triangles.begin(), triangles.end()), opacity_(opacity), channel_(channel) {
    if (opacity == nullptr || channel > 0) return;
    for (int c = 1; c < 3; ++c) others_[c - 1] = std::make_unique<BruteForceVisibility>(triangles, opacity, c);
  }

  void trace(std::span<const Ray> rays, std::span<Hit> hits) const override {
    RADBAKE_CHECK_EQ(rays.size(), hits.size());
    const Chances chances(rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      hits[i] = {};
      bool differs = false;
      for (const Hit& hit : crossings(rays[i])) {
        const Vec3 opacity = opacity_of(hit);
        differs = differs || opacity.x != opacity.y || opacity.y != opacity.z;
        if (hit.distance < hits[i].distance && chances.of(i, hit.triangle) < opacity[channel_]) hits[i] = hit;
      }
      hits[i].differs_by_channel = differs;
    }
  }

  void transmitted(std::span<const Ray> segments, std::span<Vec3> shares) const override {
    RADBAKE_CHECK_EQ(segments.size(), shares.size());
    for (std::size_t i = 0; i < segments.size(); ++i) {
      shares[i] = {1, 1, 1};
      for (const Hit& hit : crossings(segments[i])) shares[i] = scaled_by(shares[i], Vec3{1, 1, 1} - opacity_of(hit));
    }
  }

  bool is_see_through() const override { return opacity_ != nullptr; }
  const Visibility& channel(int c) const override { return c == 0 || !others_[c - 1] ? *this : *others_[c - 1]; }

  void blocked(std::span<const Ray> segments, std::span<std::uint8_t> blocked) const override {
    RADBAKE_CHECK_EQ(segments.size(), blocked.size());
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const std::vector<Hit> hits = crossings(segments[i]);
      blocked[i] =
          std::any_of(hits.begin(), hits.end(), [&](const Hit& hit) { return max_component(opacity_of(hit)) > 0; });
    }
  }

  void triangles_near(Vec3 point, double distance, std::vector<std::uint32_t>& triangles) const override {
    triangles.clear();
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      // By bounding boxes: a superset is asked for.
      const auto [low, high] = bounds(triangles_[i]);
      double squared = 0;
      for (int axis = 0; axis < 3; ++axis) {
        const double outside = std::max({low[axis] - point[axis], point[axis] - high[axis], 0.0});
        squared += outside * outside;
      }
      if (squared <= distance * distance) triangles.push_back(i);
    }
  }

  void triangles_in(const Shaft& shaft, std::vector<std::uint32_t>& triangles) const override {
    triangles.clear();
    for (std::uint32_t i = 0; i < triangles_.size(); ++i) {
      const auto [low, high] = bounds(triangles_[i]);
      bool is_near = true;
      for (int axis = 0; axis < 3; ++axis) {
        const auto [first, last] = std::minmax({shaft.begin[axis], shaft.end[axis]});
        is_near = is_near && low[axis] <= last + shaft.radius && high[axis] >= first - shaft.radius;
      }
      if (is_near && shaft.may_hold(triangles_[i], 0)) triangles.push_back(i);
    }
  }

  std::string instruction_set() const override { return "double"; }

 private:
  static std::pair<Vec3, Vec3> bounds(const Corners& corners) {
    Vec3 low, high;
    for (int axis = 0; axis < 3; ++axis) {
      std::tie(low[axis], high[axis]) = std::minmax({corners[0][axis], corners[1][axis], corners[2][axis]});
    }
    return {low, high};
  }

  Vec3 opacity_of(const Hit& hit) const {
    if (opacity_ == nullptr || !opacity_->is_see_through(hit.triangle)) return {1, 1, 1};
    return opacity_->opacity(hit.triangle, hit.u, hit.v);
  }

  /// All that a ray crosses, by triangle.
  std::vector<Hit> crossings(const Ray& ray) const {
    const Vec3 origin = to_double(ray.origin), direction = to_double(ray.direction);
    std::vector<Hit> hits;
    for (std::size_t i = 0; i < triangles_.size(); ++i) {
      // Solve origin + t d = a + u (b - a) + v (c - a) by Cramer's rule.
      const auto& [a, b, c] = triangles_[i];
      const Vec3 e1 = b - a, e2 = c - a, p = cross(direction, e2);
      const double determinant = dot(e1, p);
      if (determinant == 0) continue;
      const Vec3 s = origin - a, q = cross(s, e1);
      const double u = dot(s, p) / determinant, v = dot(direction, q) / determinant, t = dot(e2, q) / determinant;
      if (u < 0 || v < 0 || u + v > 1 || t < 0 || t >= ray.max_distance) continue;
      hits.push_back(
          {static_cast<std::uint32_t>(i), static_cast<float>(u), static_cast<float>(v), static_cast<float>(t)});
    }
    return hits;
  }

  std::vector<Corners> triangles_;
  const Opacity* opacity_;
  int channel_;
  std::array<std::unique_ptr<BruteForceVisibility>, 2> others_;
};

}  // namespace

std::unique_ptr<Visibility> make_brute_force_visibility(std::span<const Corners> triangles, const Opacity* opacity) {
  return std::make_unique<BruteForceVisibility>(triangles, opacity, 0);
}

}  // namespace radbake::radiosity
