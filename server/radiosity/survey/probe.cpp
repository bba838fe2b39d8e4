#include "server/radiosity/survey/probe.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/base/sequence.h"
#include "server/radiosity/survey/site.h"

namespace radbake::radiosity {
namespace {

constexpr std::uint64_t kProbeSeed = 0x70726f6265;  // "probe"
constexpr double kStandardDeviations = 1.959964;    // of 95 %

/// Half of the interval in which a share lies that was met `num_met` times in `num`.
double half_interval(double num_met, double num) {
  const double p = num_met / num, z2 = kStandardDeviations * kStandardDeviations;
  return kStandardDeviations / (1 + z2 / num) * std::sqrt(p * (1 - p) / num + z2 / (4 * num * num));
}

}  // namespace

void probe_escape(const Surfaces& surfaces, const Visibility& visibility, Survey& survey) {
  std::vector<double> cumulative;
  double area = 0;
  for (const double own : surfaces.areas) cumulative.push_back(area += own);

  // A point by area, and a direction about its normal by Malley's method.
  const SobolPoints points(kNumProbeRays);
  const auto seeds = SobolPoints::seeds_of(kProbeSeed);
  std::vector<Ray> rays;
  for (int i = 0; i < points.size(); ++i) {
    const double wanted = points.coordinate(i, 4, seeds) * area;
    const auto t = static_cast<std::uint32_t>(std::min<std::size_t>(
        std::upper_bound(cumulative.begin(), cumulative.end(), wanted) - cumulative.begin(), surfaces.size() - 1));
    double u = points.coordinate(i, 0, seeds), v = points.coordinate(i, 1, seeds);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const double radius = std::sqrt(points.coordinate(i, 2, seeds));
    const double angle = 2 * std::numbers::pi * points.coordinate(i, 3, seeds);
    const Vec3 normal = surfaces.normals[t];
    const Frame frame(normal);
    const Vec3 direction = frame.s * (radius * std::cos(angle)) + frame.t * (radius * std::sin(angle)) +
                           frame.n * std::sqrt(std::max(0.0, 1 - radius * radius));
    rays.push_back(
        {lifted_origin(surfaces, surfaces.position({t, u, v}), normal, t),
         {static_cast<float>(direction.x), static_cast<float>(direction.y), static_cast<float>(direction.z)}});
  }
  std::vector<Hit> hits(rays.size());
  visibility.trace(rays, hits);

  const auto num_escaped =
      std::count_if(hits.begin(), hits.end(), [](const Hit& hit) { return hit.triangle == kNoHit; });
  survey.num_probe_rays = rays.size();
  survey.escape_share = static_cast<double>(num_escaped) / static_cast<double>(rays.size());
  survey.escape_share_interval = half_interval(static_cast<double>(num_escaped), static_cast<double>(rays.size()));
}

}  // namespace radbake::radiosity
