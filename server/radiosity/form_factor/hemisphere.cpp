#include "server/radiosity/form_factor/hemisphere.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace radbake::radiosity {
namespace {

/// Sites that share a texel's or patch's rays at most; each then has at least eight rays to tell whether it is buried.
constexpr int kMaxSites = 64;
constexpr int kRaysPerSite = 8;

/// Direction of the cosine distribution about +z for a point of the unit square. Concentric, so strata stay compact.
Vec3 cosine_direction(double x, double y) {
  const double a = 2 * x - 1, b = 2 * y - 1;
  if (a == 0 && b == 0) return {0, 0, 1};
  double radius = a, angle = std::numbers::pi / 4 * (b / a);
  if (std::fabs(a) <= std::fabs(b)) {
    radius = b;
    angle = std::numbers::pi / 2 - std::numbers::pi / 4 * (a / b);
  }
  const float phi = static_cast<float>(angle);
  return {radius * std::cos(phi), radius * std::sin(phi), std::sqrt(std::max(0.0, 1 - radius * radius))};
}

}  // namespace

int HemisphereEstimator::num_sites() const {
  int sites = 1;
  while (2 * sites <= kMaxSites && 2 * sites * kRaysPerSite <= rays()) sites *= 2;
  return sites;
}

void HemisphereEstimator::sample_row(std::span<const Site> sites, std::uint64_t seed, Scratch& scratch,
                                     RowSample& row) const {
  row = {std::move(row.arrivals), 0, 0, 0, 0, std::move(row.is_buried), std::move(row.of_site), 1};
  row.arrivals.clear();
  row.is_buried.assign(sites.size(), 0);
  row.of_site.assign(sites.size(), {});
  scratch.rays.clear();
  scratch.site_of_ray.clear();

  // Deal the rays to the sites in runs of the sequence.
  const auto seeds = SobolPoints::seeds_of(seed);
  const auto num_rays = static_cast<std::size_t>(rays());
  for (std::size_t s = 0; s < sites.size(); ++s) {
    const Site& site = sites[s];
    const Frame frame(site.normal);
    const auto origin = lifted_origin(surfaces_, site.position, site.facing, site.point.triangle);
    const std::size_t end = (s + 1) * num_rays / sites.size();
    for (std::size_t k = s * num_rays / sites.size(); k < end; ++k) {
      const int i = static_cast<int>(k);
      const Vec3 direction =
          frame.to_world(cosine_direction(points_.coordinate(i, 0, seeds), points_.coordinate(i, 1, seeds)));
      if (dot(direction, site.facing) <= 0) continue;
      scratch.rays.push_back(
          {origin,
           {static_cast<float>(direction.x), static_cast<float>(direction.y), static_cast<float>(direction.z)}});
      scratch.site_of_ray.push_back(static_cast<std::uint32_t>(s));
    }
  }
  scratch.hits.resize(scratch.rays.size());
  visibility_.trace(scratch.rays, scratch.hits);
  row.traced = static_cast<std::uint32_t>(scratch.rays.size());

  // Read off what each ray met, site by site: a buried site takes its rays back.
  std::size_t num_buried = 0;
  for (std::size_t first = 0; first < scratch.rays.size();) {
    const std::uint32_t s = scratch.site_of_ray[first];
    RowSample::SiteRays own;
    own.first_arrival = static_cast<std::uint32_t>(row.arrivals.size());
    std::uint32_t absorbed = 0;
    std::size_t k = first;
    for (; k < scratch.rays.size() && scratch.site_of_ray[k] == s; ++k) {
      const Hit& hit = scratch.hits[k];
      if (hit.triangle == kNoHit) {
        ++own.escaped;
        continue;
      }
      const auto& d = scratch.rays[k].direction;
      const Vec3 direction{d[0], d[1], d[2]};
      own.backs += dot(surfaces_.normals[hit.triangle], direction) > 0;
      const std::uint32_t patch = patches_.met_by(hit, direction, surfaces_);
      if (patch == kNoPatch) {
        ++absorbed;
      } else {
        row.arrivals.push_back(patch);
      }
    }
    if (2 * std::size_t{absorbed} > k - first) {
      row.is_buried[s] = 1;
      ++num_buried;
      row.arrivals.resize(own.first_arrival);
    } else {
      own.num_arrivals = static_cast<std::uint32_t>(row.arrivals.size()) - own.first_arrival;
      own.counted = static_cast<std::uint32_t>(k - first);
      row.of_site[s] = own;
      row.escaped += own.escaped;
      row.absorbed += absorbed;
      row.counted += own.counted;
    }
    first = k;
  }
  row.visible_share = 1 - static_cast<double>(num_buried) / static_cast<double>(sites.size());
}

}  // namespace radbake::radiosity
