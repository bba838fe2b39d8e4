#include "server/radiosity/form_factor/hemisphere.h"

#include <array>

namespace radbake::radiosity {
namespace {

/// Sites that share a texel's or patch's rays at most; each then has at least eight rays to tell whether it is buried.
constexpr int kMaxSites = 64;
constexpr int kRaysPerSite = 8;

}  // namespace

int HemisphereEstimator::num_sites() const {
  int sites = replicates_;
  while (2 * sites <= kMaxSites && 2 * sites * kRaysPerSite <= rays()) sites *= 2;
  return sites;
}

void HemisphereEstimator::deal_rays(std::span<const Site> sites, std::uint64_t seed, Scratch& scratch) const {
  const auto num_replicates = static_cast<std::size_t>(replicates_);
  const std::size_t num_rays = static_cast<std::size_t>(rays()) / num_replicates;
  const std::size_t num_sites = sites.size() / num_replicates;
  scratch.rays.resize(num_rays * num_replicates);
  scratch.end_of_site.clear();
  Ray* ray = scratch.rays.data();
  for (std::size_t s = 0; s < sites.size(); ++s) {
    const std::size_t own = s % num_sites;  // within its replicate
    if (own == 0) directions_.fill(replicates_ == 1 ? seed : mixed_bits(seed + s / num_sites), scratch.directions);
    const float *x = scratch.directions.x.data(), *y = scratch.directions.y.data(), *z = scratch.directions.z.data();
    const Site& site = sites[s];
    const Frame frame(site.normal);
    const auto origin = lifted_origin(surfaces_, site.position, site.facing, site.point.triangle);
    const auto in_float = [](Vec3 v) {
      return std::array<float, 3>{static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
    };
    const auto along_x = in_float(frame.s), along_y = in_float(frame.t), along_z = in_float(frame.n);
    const auto facing = in_float(site.facing);
    const std::size_t end = (own + 1) * num_rays / num_sites;
    for (std::size_t k = own * num_rays / num_sites; k < end; ++k) {
      ray->origin = origin;
      for (int axis = 0; axis < 3; ++axis) {
        ray->direction[axis] = along_x[axis] * x[k] + along_y[axis] * y[k] + along_z[axis] * z[k];
      }
      // What leaves below the surface is written over.
      const auto& d = ray->direction;
      ray += d[0] * facing[0] + d[1] * facing[1] + d[2] * facing[2] > 0;
    }
    scratch.end_of_site.push_back(static_cast<std::size_t>(ray - scratch.rays.data()));
  }
  scratch.rays.resize(scratch.end_of_site.back());
}

void HemisphereEstimator::sample_row(std::span<const Site> sites, std::uint64_t seed, Scratch& scratch,
                                     RowSample& row) const {
  deal_rays(sites, seed, scratch);
  scratch.hits.resize(scratch.rays.size());
  visibility_.trace(scratch.rays, scratch.hits);
  read_off(sites, scratch, scratch.hits, row);
  row.traced = static_cast<std::uint32_t>(scratch.rays.size());
}

void HemisphereEstimator::sample_again(std::span<const Site> sites, Scratch& scratch, RowSample& row) const {
  scratch.hits_again = scratch.hits;
  scratch.wanted.resize(scratch.hits.size());
  std::uint32_t traced = 0;
  for (std::size_t k = 0; k < scratch.hits.size(); ++k) {
    scratch.wanted[k] = scratch.hits[k].differs_by_channel;
    traced += scratch.wanted[k];
  }
  if (traced > 0) visibility_.trace_again(scratch.rays, scratch.wanted, scratch.hits_again);
  read_off(sites, scratch, scratch.hits_again, row);
  row.traced = traced;
}

void HemisphereEstimator::read_off(std::span<const Site> sites, const Scratch& scratch, std::span<const Hit> hits,
                                   RowSample& row) const {
  row = {std::move(row.arrivals),  std::move(row.escapes), 0, 0, 0, 0,
         std::move(row.is_buried), std::move(row.of_site), 1};
  row.escapes.clear();
  row.is_buried.assign(sites.size(), 0);
  row.of_site.assign(sites.size(), {});

  // Read off what each ray met, site by site: a buried site takes its rays back.
  row.arrivals.resize(scratch.rays.size());
  std::uint32_t num_arrivals = 0;
  std::size_t num_buried = 0, k = 0;
  constexpr std::size_t kAhead = 16;  // a large scene's triangles are not in the cache
  for (std::size_t s = 0; s < sites.size(); ++s) {
    RowSample::SiteRays own;
    own.first_arrival = num_arrivals;
    own.first_escape = static_cast<std::uint32_t>(row.escapes.size());
    own.counted = static_cast<std::uint32_t>(scratch.end_of_site[s] - k);
    std::uint32_t absorbed = 0, enclosing = 0;
    for (; k < scratch.end_of_site[s]; ++k) {
      const Hit& hit = hits[k];
      if (k + kAhead < hits.size() && hits[k + kAhead].triangle != kNoHit) {
        patches_.expect(hits[k + kAhead].triangle);
      }
      if (hit.triangle == kNoHit) {
        ++own.escaped;
        row.escapes.push_back(static_cast<std::uint32_t>(k));
        continue;
      }
      own.near += hit.distance < near_distance_;
      const Patches::Meeting met = patches_.meet(hit, scratch.rays[k].direction, surfaces_);
      own.backs += met.is_back;
      if (met.patch == kNoPatch) {
        ++absorbed;
        // Who is under a sheet that light passes is not inside of anything.
        enclosing += !surfaces_.is_see_through(hit.triangle);
      }
      row.arrivals[num_arrivals] = met.patch;
      num_arrivals += met.patch != kNoPatch;
    }
    if (2 * enclosing > own.counted) {
      row.is_buried[s] = 1;
      ++num_buried;
      num_arrivals = own.first_arrival;
      row.escapes.resize(own.first_escape);
      continue;
    }
    own.num_arrivals = num_arrivals - own.first_arrival;
    row.of_site[s] = own;
    row.escaped += own.escaped;
    row.absorbed += absorbed;
    row.counted += own.counted;
  }
  row.arrivals.resize(num_arrivals);
  row.visible_share = 1 - static_cast<double>(num_buried) / static_cast<double>(sites.size());
}

}  // namespace radbake::radiosity
