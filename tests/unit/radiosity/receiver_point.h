#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "server/radiosity/gather/receive.h"
#include "server/radiosity/survey/surface_opacity.h"
#include "server/radiosity/survey/survey.h"

namespace radbake::radiosity {

/// The light at a point of the first quad of a scene, as a texel there receives it; nothing is reflected.
class ReceiverPoint {
 public:
  explicit ReceiverPoint(Scene scene)
      : scene_(std::move(scene)), surveyed_(survey_scene(scene_).value()), opacity_(surveyed_.surfaces) {
    visibility_ = make_embree_visibility(surveyed_.surfaces.corners, {}, &opacity_);
    patches_ = make_patches(surveyed_.surfaces, *visibility_, {1, 1024});
  }

  /// Shapes: one value a channel. `at`: metres, on the first quad.
  Vec3 irradiance(Vec3 at, int rays, int light_samples, std::uint64_t seed) const {
    const Surfaces& surfaces = surveyed_.surfaces;
    const Vec3 p = (at - surfaces.centre) / surfaces.metres_per_unit;
    for (std::uint32_t t = 0; t < 2; ++t) {
      const auto& c = surfaces.corners[t];
      const Vec3 e1 = c[1] - c[0], e2 = c[2] - c[0], n = cross(e1, e2), d = p - c[0];
      const double u = dot(cross(d, e2), n) / dot(n, n), v = dot(cross(e1, d), n) / dot(n, n);
      if (u < 0 || v < 0 || u + v > 1) continue;
      return receive_at(front_site(surfaces, {t, u, v}, surfaces.normals[t]), rays, light_samples, seed);
    }
    ADD_FAILURE() << "the point is not on the first quad";
    return {};
  }

  /// Mean over seeds, and its standard error (of the first channel).
  struct Estimate {
    Vec3 mean;
    double standard_error = 0;
  };
  Estimate estimate(Vec3 at, int rays, int light_samples, int num_seeds) const {
    Estimate out;
    double squares = 0;
    for (int seed = 0; seed < num_seeds; ++seed) {
      const Vec3 h = irradiance(at, rays, light_samples, static_cast<std::uint64_t>(seed) + 1);
      out.mean += h / num_seeds;
      squares += h.x * h.x / num_seeds;
    }
    out.standard_error = std::sqrt(std::max(0.0, squares - out.mean.x * out.mean.x) / (num_seeds - 1));
    return out;
  }

 private:
  Vec3 receive_at(const Site& site, int rays, int light_samples, std::uint64_t seed) const {
    const Surfaces& surfaces = surveyed_.surfaces;
    const HemisphereEstimator rows(surfaces, patches_, *visibility_, rays);
    const DirectLight direct(surfaces, *visibility_, light_samples, Environment::Part::kBright);
    const std::vector<Vec3> radiosity(patches_.size());
    const SentLight sent{radiosity};
    const GatherScene scene{surfaces, *visibility_, rows, direct, std::span(&sent, 1), surfaces.sky, seed};
    ReceiveScratch scratch;
    scratch.sites.assign(static_cast<std::size_t>(rows.num_sites()), site);
    Receiver receiver{0, [&](double, double) { return site; }};
    const Reception reception = receive(scene, receiver, mixed_bits(seed), mixed_bits(seed + 1000), scratch);
    EXPECT_FALSE(reception.is_buried);
    return reception.replicates[0].irradiance();
  }

  Scene scene_;
  SurveyedScene surveyed_;
  SurfaceOpacity opacity_;
  std::unique_ptr<Visibility> visibility_;
  Patches patches_;
};

}  // namespace radbake::radiosity
