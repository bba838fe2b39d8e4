#include "server/radiosity/form_factor/hemisphere.h"

#include <algorithm>
#include <array>

namespace radbake::radiosity {
namespace {

/// Sites that share a texel's or patch's rays at most; each then has at least eight rays to tell whether it is buried.
constexpr int kMaxSites = 64;
constexpr int kRaysPerSite = 8;

/// Inside of something closed up to one ray in so many gets out: where surfaces cross or do not meet.
constexpr std::uint64_t kLeak = 64;
/// Surfaces of which is looked whether they are inside too.
constexpr std::size_t kMostLooks = 32;

/// Closes the gaps that the rays of buried sites leave.
void take_back_buried(RowSample& row) {
  std::uint32_t num_arrivals = 0, num_escapes = 0;
  for (std::size_t s = 0; s < row.of_site.size(); ++s) {
    RowSample::SiteRays& own = row.of_site[s];
    if (row.is_buried[s]) {
      own = {};
      continue;
    }
    std::copy_n(row.arrivals.begin() + own.first_arrival, own.num_arrivals, row.arrivals.begin() + num_arrivals);
    std::copy_n(row.escapes.begin() + own.first_escape, own.escaped, row.escapes.begin() + num_escapes);
    own.first_arrival = num_arrivals;
    own.first_escape = num_escapes;
    num_arrivals += own.num_arrivals;
    num_escapes += own.escaped;
  }
  row.arrivals.resize(num_arrivals);
  row.escapes.resize(num_escapes);
}

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

bool HemisphereEstimator::is_enclosing(const Hit& hit, const Patches::Meeting& met) const {
  // Who is under a sheet that light passes is not inside of anything.
  return met.patch == kNoPatch && !surfaces_.is_see_through(hit.triangle);
}

bool HemisphereEstimator::has_way_out(const Scratch& scratch, std::span<const Hit> hits, const RowSample& row,
                                      std::uint64_t counted) const {
  // Collect what is neither a way out nor closed at first sight: surfaces that may be inside as well.
  std::uint64_t escaped = 0;
  std::vector<std::size_t> others;
  std::size_t k = 0;
  for (std::size_t s = 0; s < row.is_buried.size(); ++s) {
    if (row.is_buried[s]) escaped += row.of_site[s].escaped;
    for (; k < scratch.end_of_site[s]; ++k) {
      if (!row.is_buried[s] || hits[k].triangle == kNoHit) continue;
      if (!is_enclosing(hits[k], patches_.meet(hits[k], scratch.rays[k].direction, surfaces_))) others.push_back(k);
    }
  }
  if (kLeak * escaped > counted) return true;

  const Looks looks = look_from(scratch, hits, others, [](Vec3 facing, Vec3) { return facing; });
  return looks.num > 0 && kLeak * (escaped * looks.num + looks.open * others.size()) > counted * looks.num;
}

double HemisphereEstimator::hidden_share(const Scratch& scratch, const RowSample& row) const {
  if (scratch.hits.empty()) return 0;
  std::vector<std::size_t> others;
  for (std::size_t k = 0; k < scratch.hits.size(); ++k) {
    const Hit& hit = scratch.hits[k];
    if (hit.triangle == kNoHit) continue;
    if (!is_enclosing(hit, patches_.meet(hit, scratch.rays[k].direction, surfaces_))) others.push_back(k);
  }
  const Looks looks = look_from(scratch, scratch.hits, others,
                                [](Vec3 facing, Vec3 ray) { return ray - facing * (2 * dot(ray, facing)); });
  double hidden = row.enclosing;
  if (looks.num > 0) {
    hidden += static_cast<double>(others.size()) * static_cast<double>(looks.num - looks.open) /
              static_cast<double>(looks.num);
  }
  return hidden / static_cast<double>(scratch.hits.size());
}

template <typename Direction>
HemisphereEstimator::Looks HemisphereEstimator::look_from(const Scratch& scratch, std::span<const Hit> hits,
                                                          const std::vector<std::size_t>& from,
                                                          const Direction& direction) const {
  Looks out;
  out.num = std::min(from.size(), kMostLooks);
  std::vector<Ray> looks;
  for (std::size_t look = 0; look < out.num; ++look) {
    const std::size_t ray = from[look * from.size() / out.num];
    const Hit& hit = hits[ray];
    const auto& d = scratch.rays[ray].direction;
    const Vec3 normal = surfaces_.normals[hit.triangle], along{d[0], d[1], d[2]};
    const Vec3 facing = dot(normal, along) < 0 ? normal : -normal;
    const Vec3 at = surfaces_.position({hit.triangle, static_cast<double>(hit.u), static_cast<double>(hit.v)});
    const Vec3 to = direction(facing, along);
    looks.push_back({lifted_origin(surfaces_, at, facing, hit.triangle),
                     {static_cast<float>(to.x), static_cast<float>(to.y), static_cast<float>(to.z)}});
  }
  std::vector<Hit> met(out.num);
  visibility_.trace(looks, met);
  for (std::size_t look = 0; look < out.num; ++look) {
    const Hit& hit = met[look];
    out.open += hit.triangle == kNoHit || !is_enclosing(hit, patches_.meet(hit, looks[look].direction, surfaces_));
  }
  return out;
}

void HemisphereEstimator::read_off(std::span<const Site> sites, const Scratch& scratch, std::span<const Hit> hits,
                                   RowSample& row) const {
  row = {std::move(row.arrivals),  std::move(row.escapes), 0, 0, 0, 0, 0,
         std::move(row.is_buried), std::move(row.of_site), 1};
  row.escapes.clear();
  row.is_buried.assign(sites.size(), 0);
  row.of_site.assign(sites.size(), {});

  // Read off what each ray met, site by site.
  row.arrivals.resize(scratch.rays.size());
  std::uint32_t num_arrivals = 0;
  std::uint64_t counted = 0, free = 0;  // rays of all sites that are under something
  std::size_t k = 0;
  constexpr std::size_t kAhead = 16;  // a large scene's triangles are not in the cache
  for (std::size_t s = 0; s < sites.size(); ++s) {
    RowSample::SiteRays& own = row.of_site[s];
    own.first_arrival = num_arrivals;
    own.first_escape = static_cast<std::uint32_t>(row.escapes.size());
    own.counted = static_cast<std::uint32_t>(scratch.end_of_site[s] - k);
    std::uint32_t enclosing = 0;
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
      enclosing += is_enclosing(hit, met);
      row.arrivals[num_arrivals] = met.patch;
      num_arrivals += met.patch != kNoPatch;
    }
    own.num_arrivals = num_arrivals - own.first_arrival;
    row.enclosing += enclosing;
    if (2 * enclosing <= own.counted) continue;
    row.is_buried[s] = 1;
    counted += own.counted;
    free += own.counted - enclosing;
  }
  row.arrivals.resize(num_arrivals);

  // Sites that together see a way out are under something, not inside of it.
  if (counted > 0 && kLeak * free > counted && has_way_out(scratch, hits, row, counted)) {
    row.is_buried.assign(sites.size(), 0);
  } else if (counted > 0) {
    take_back_buried(row);
  }
  std::size_t num_buried = 0;
  for (std::size_t s = 0; s < sites.size(); ++s) {
    const RowSample::SiteRays& own = row.of_site[s];
    num_buried += row.is_buried[s];
    row.escaped += own.escaped;
    row.absorbed += own.counted - own.escaped - own.num_arrivals;
    row.counted += own.counted;
  }
  row.visible_share = 1 - static_cast<double>(num_buried) / static_cast<double>(sites.size());
}

}  // namespace radbake::radiosity
