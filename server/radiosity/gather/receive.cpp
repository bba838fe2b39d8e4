#include "server/radiosity/gather/receive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "common/base/sequence.h"
#include "server/radiosity/gather/parting.h"

namespace radbake::radiosity {
namespace {

/// A receiver of which less is visible is buried: too few sites to stand for a part.
constexpr double kMinVisibleShare = 0.125;
/// Where less is visible, the part that is gets all of the receiver's rays.
constexpr double kRetracedShare = 0.5;
/// Fixed places that tell whether anything stands across a receiver, and those that its parts are made of: both powers
/// of 2, so that they are evenly spread.
constexpr int kFirstLook = 16, kFixedPlaces = 64;
/// Sites that stand for a part, at least, where it has so many fixed places.
constexpr std::size_t kFewSites = 8;

/// Sites of one replicate.
std::size_t sites_each(const GatherScene& scene, const ReceiveScratch& scratch) {
  return scratch.sites.size() / static_cast<std::size_t>(scene.rows.replicates());
}

/// Whether most of a site's rays meet backs: it lies inside of something closed, or under a sheet.
bool is_under_backs(const RowSample::SiteRays& own) { return 2 * own.backs > own.counted; }

/// Leaves sites out that are inside of something closed: most of their rays meet backs, and next to no light reaches
/// them, be it reflected, from the sky or from a lamp. They are judged together: a few rays each miss the light under a
/// sheet by chance, and to leave those out would brighten what lies under it. And they are judged by how much arrives:
/// of millions of rays one slips along an edge, and lights all of the inside a little.
void leave_out_sealed(const GatherScene& scene, std::uint64_t light_seed, ReceiveScratch& scratch, Reception& out) {
  std::vector<std::uint8_t> is_other(scratch.sites.size(), 1);
  double light = 0, num_rays = 0;
  for (std::size_t s = 0; s < scratch.sites.size(); ++s) {
    const RowSample::SiteRays& own = scratch.row.of_site[s];
    if (scratch.is_out[s] || !is_under_backs(own)) continue;
    if (own.escaped > 0) return;
    is_other[s] = 0;
    num_rays += own.counted;
    const std::span<const Vec3> radiosity = scene.sent[s / sites_each(scene, scratch)].radiosity;
    for (std::uint32_t k = 0; k < own.num_arrivals; ++k) {
      light += max_component(radiosity[scratch.row.arrivals[own.first_arrival + k]]);
    }
  }
  if (num_rays == 0 || light > scene.dark * num_rays) return;
  Vec3 direct;
  out.light_rays += scene.direct.estimate(scratch.sites, is_other, light_seed, scratch.light, std::span(&direct, 1));
  if (!(direct == Vec3{})) return;
  for (std::size_t s = 0; s < scratch.sites.size(); ++s) scratch.is_out[s] |= !is_other[s];
}

/// What the patches and the sky send along the rays of a replicate, from its sites that are not out. Without any,
/// empty.
std::optional<ReceivedLight> light_of_row(const GatherScene& scene, const RowSample& row, std::size_t replicate,
                                          const ReceiveScratch& scratch) {
  const SentLight& sent = scene.sent[replicate];
  Vec3 sum, glow, sky, coarser;
  std::uint64_t escaped = 0, counted = 0;
  const Environment* environment = scene.direct.environment();
  const std::size_t num_sites = sites_each(scene, scratch);
  for (std::size_t s = replicate * num_sites; s < (replicate + 1) * num_sites; ++s) {
    if (scratch.is_out[s]) continue;
    const RowSample::SiteRays& own = row.of_site[s];
    for (std::uint32_t k = 0; k < own.num_arrivals; ++k) {
      const std::uint32_t patch = row.arrivals[own.first_arrival + k];
      sum += sent.radiosity[patch];
      if (!sent.glow.empty()) glow += sent.glow[patch];
      if (!sent.coarser.empty()) coarser += sent.coarser[patch];
    }
    for (std::uint32_t k = 0; k < own.escaped && environment != nullptr; ++k) {
      const auto& d = scratch.hemisphere.rays[row.escapes[own.first_escape + k]].direction;
      sky += environment->dim_luminance({d[0], d[1], d[2]});
    }
    escaped += own.escaped;
    counted += own.counted;
  }
  if (counted == 0) return std::nullopt;
  const auto num = static_cast<double>(counted);
  sky += scene.sky * static_cast<double>(escaped);
  return ReceivedLight{(sum + sky * std::numbers::pi) / num,
                       {},
                       (sum - glow) / num,
                       sent.coarser.empty() ? Vec3{} : (coarser - sum) / num};
}

/// Light of a channel with rows of its own in the place of the first one's.
void put_channel(const ReceivedLight& from, int channel, ReceivedLight& to) {
  to.gathered[channel] = from.gathered[channel];
  to.reflected[channel] = from.reflected[channel];
  to.coarser[channel] = from.coarser[channel];
}

/// The light at the sites that are not out, from the row that was traced for them. Of channels with rows of their own,
/// the first says what counts. A replicate all of whose sites are out gets the others' mean.
void light_of(const GatherScene& scene, std::uint64_t light_seed, int light_samples, ReceiveScratch& scratch,
              Reception& out) {
  const auto num_replicates = static_cast<std::size_t>(scene.rows.replicates());
  std::array<bool, kMaxReplicates> is_there{};
  for (std::size_t r = 0; r < num_replicates; ++r) {
    const auto light = light_of_row(scene, scratch.row, r, scratch);
    is_there[r] = light.has_value();
    out.replicates[r] = light.value_or(ReceivedLight{});
  }
  for (std::size_t c = 0; c < scene.other_rows.size(); ++c) {
    scene.other_rows[c].sample_again(scratch.sites, scratch.hemisphere, scratch.other_row);
    out.rays += scratch.other_row.traced;
    for (std::size_t r = 0; r < num_replicates; ++r) {
      const auto light = light_of_row(scene, scratch.other_row, r, scratch);
      if (light) put_channel(*light, static_cast<int>(c) + 1, out.replicates[r]);
    }
  }
  const auto num_there = std::count(is_there.begin(), is_there.end(), true);
  if (num_there > 0 && num_there < static_cast<std::ptrdiff_t>(num_replicates)) {
    ReceivedLight sum;
    for (std::size_t r = 0; r < num_replicates; ++r) {
      sum.gathered += out.replicates[r].gathered;
      sum.reflected += out.replicates[r].reflected;
      sum.coarser += out.replicates[r].coarser;
    }
    const auto num = static_cast<double>(num_there);
    for (std::size_t r = 0; r < num_replicates; ++r) {
      if (!is_there[r]) out.replicates[r] = {sum.gathered / num, {}, sum.reflected / num, sum.coarser / num};
    }
  }

  // Add what the lights send straight.
  std::array<Vec3, kMaxReplicates> direct;
  out.light_rays += scene.direct.estimate(scratch.sites, scratch.is_out, light_seed, scratch.light,
                                          std::span(direct).first(num_replicates), light_samples);
  for (std::size_t r = 0; r < num_replicates; ++r) out.replicates[r].direct = direct[r];
}

/// Share of the counted rays that meet nothing near, of all sites that are not out.
double openness_of(const ReceiveScratch& scratch) {
  std::uint64_t counted = 0, near = 0;
  for (std::size_t s = 0; s < scratch.sites.size(); ++s) {
    if (scratch.is_out[s]) continue;
    counted += scratch.row.of_site[s].counted;
    near += scratch.row.of_site[s].near;
  }
  return counted > 0 ? 1 - static_cast<double>(near) / static_cast<double>(counted) : 0;
}

/// Traces the sites' rows and marks what does not count. Returns the share that does.
double trace_and_sort_out(const GatherScene& scene, std::uint64_t rays_seed, std::uint64_t light_seed,
                          ReceiveScratch& scratch, Reception& out) {
  scene.rows.sample_row(scratch.sites, rays_seed, scratch.hemisphere, scratch.row);
  out.rays += scratch.row.traced;
  scratch.is_out = scratch.row.is_buried;
  leave_out_sealed(scene, light_seed, scratch, out);
  const auto num_out = std::count(scratch.is_out.begin(), scratch.is_out.end(), 1);
  return 1 - static_cast<double>(num_out) / static_cast<double>(scratch.sites.size());
}

/// Puts the sites that count in the place of those that do not.
void repeat_visible_sites(ReceiveScratch& scratch) {
  std::vector<Site> visible;
  for (std::size_t s = 0; s < scratch.sites.size(); ++s) {
    if (!scratch.is_out[s]) visible.push_back(scratch.sites[s]);
  }
  for (std::size_t s = 0; s < scratch.sites.size(); ++s) scratch.sites[s] = visible[s % visible.size()];
}

/// Places of a receiver that depend on nothing else. count: up to kFixedPlaces.
void place_fixed(const Receiver& receiver, int count, std::vector<Site>& places) {
  static const SobolPoints points(kFixedPlaces);
  const auto seeds = SobolPoints::seeds_of(mixed_bits(receiver.id));
  places.clear();
  for (int k = 0; k < count; ++k) {
    places.push_back(receiver.site_at(points.coordinate(k, 0, seeds), points.coordinate(k, 1, seeds)));
  }
}

struct Seeds {
  std::uint64_t rays, light;
};

/// The light at scratch.sites, which are `share` of a receiver and on one side of what may stand across it.
Reception receive_part(const GatherScene& scene, double share, Seeds seeds, int light_samples,
                       ReceiveScratch& scratch) {
  Reception out;
  const double visible = trace_and_sort_out(scene, seeds.rays, seeds.light, scratch, out);
  out.visible_share = visible * share;
  if (out.visible_share < kMinVisibleShare) return out;
  if (visible < kRetracedShare) {
    repeat_visible_sites(scratch);
    trace_and_sort_out(scene, seeds.rays, seeds.light, scratch, out);
  }
  light_of(scene, seeds.light, light_samples, scratch, out);
  out.openness = openness_of(scratch);
  out.is_buried = false;
  return out;
}

/// Makes scratch.sites those of a part: its share of the pass's sites, where they are few, fixed places with them. All
/// count alike, and each replicate has as many. Shapes: sites, part_of_site [s]; scratch.places, part_of_place [p].
void place_sites_of_part(std::uint32_t part, std::span<const Site> sites, std::span<const std::uint32_t> part_of_site,
                         std::span<const std::uint32_t> part_of_place, std::size_t num_replicates,
                         ReceiveScratch& scratch) {
  std::vector<Site>& own = scratch.sites;
  own.clear();
  for (std::size_t s = 0; s < sites.size(); ++s) {
    if (part_of_site[s] == part) own.push_back(sites[s]);
  }
  for (std::size_t k = 0; k < scratch.places.size() && own.size() < kFewSites; ++k) {
    if (part_of_place[k] == part) own.push_back(scratch.places[k]);
  }
  while (own.size() % num_replicates != 0 && own.size() > num_replicates) own.pop_back();
  for (std::size_t s = 0; own.size() % num_replicates != 0; ++s) own.push_back(Site(own[s]));
}

/// Of the parts that are large enough to be measured, the darkest one's light. Parts are found by fixed places. One
/// whose rays nearly all end behind the scenes counts only where all parts' do: how much light finds a way there, and
/// whether that is enough not to be buried, is a matter of few rays, and no picture shows it.
Reception receive_darkest_part(const GatherScene& scene, const Receiver& receiver, Seeds seeds, int light_samples,
                               ReceiveScratch& scratch) {
  place_fixed(receiver, kFixedPlaces, scratch.places);
  const auto sizes = find_parts(scene.surfaces, scene.visibility, scratch.places, scratch.parting);
  const std::vector<std::uint32_t> part_of = scratch.parting.part;
  const std::vector<Site> sites = scratch.sites;
  assign_parts(scene.surfaces, scene.visibility, scratch.places, part_of, sites, scratch.parting);
  const std::vector<std::uint32_t> part_of_site = scratch.parting.part;
  const auto largest = static_cast<std::uint32_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  const auto num_replicates = static_cast<std::size_t>(scene.rows.replicates());
  Reception darkest;
  std::uint64_t rays = 0, light_rays = 0;
  double least = std::numeric_limits<double>::infinity();
  constexpr double kNearlyAll = 0.75;
  bool is_any_seen = false;
  for (std::uint32_t part = 0; part < sizes.size(); ++part) {
    const double share = static_cast<double>(sizes[part]) / static_cast<double>(scratch.places.size());
    if (part != largest && share < kMinVisibleShare) continue;
    place_sites_of_part(part, sites, part_of_site, part_of, num_replicates, scratch);
    const Reception reception = receive_part(scene, share, seeds, light_samples, scratch);
    rays += reception.rays;
    light_rays += reception.light_rays;
    if (reception.is_buried) continue;
    const bool is_seen = scene.rows.hidden_share(scratch.hemisphere, scratch.row) < kNearlyAll;
    const double light = max_component(reception.mean(scene.rows.replicates()).irradiance());
    if (is_any_seen && !is_seen) continue;
    if (light >= least && is_seen == is_any_seen) continue;
    is_any_seen |= is_seen;
    least = light;
    darkest = reception;
  }
  darkest.rays = rays;
  darkest.light_rays = light_rays;
  return darkest;
}

}  // namespace

ReceivedLight Reception::mean(int num_replicates) const {
  ReceivedLight sum;
  for (int r = 0; r < num_replicates; ++r) {
    const ReceivedLight& own = replicates[static_cast<std::size_t>(r)];
    sum.gathered += own.gathered / num_replicates;
    sum.direct += own.direct / num_replicates;
    sum.reflected += own.reflected / num_replicates;
    sum.coarser += own.coarser / num_replicates;
  }
  return sum;
}

void replace_unseen_sites(const GatherScene& scene, std::span<const Site> known, ReceiveScratch& scratch) {
  std::vector<Ray>& segments = scratch.parting.segments;
  std::vector<std::uint8_t>& is_blocked = scratch.parting.is_blocked;
  segments.clear();
  const auto known_of = [&](std::size_t s) -> const Site& { return known[s % known.size()]; };
  for (std::size_t s = 0; s < scratch.sites.size(); ++s) {
    segments.push_back(segment_between(scene.surfaces, known_of(s), scratch.sites[s]));
  }
  is_blocked.resize(scratch.sites.size());
  scene.visibility.blocked(segments, is_blocked);
  for (std::size_t s = 0; s < scratch.sites.size(); ++s) {
    if (is_blocked[s] && are_coplanar(known_of(s), scratch.sites[s])) scratch.sites[s] = known_of(s);
  }
}

namespace {

Reception receive_one_side(const GatherScene& scene, Receiver& receiver, Seeds seeds, int light_samples,
                           ReceiveScratch& scratch) {
  const auto is_one_part = [&](std::span<const Site> sites) {
    return find_parts(scene.surfaces, scene.visibility, sites, scratch.parting).size() == 1;
  };
  if (receiver.parts == Receiver::Parts::kUnknown) {
    place_fixed(receiver, kFirstLook, scratch.places);
    receiver.parts = is_one_part(scratch.places) ? Receiver::Parts::kOne : Receiver::Parts::kSeveral;
  }
  // The sites of every pass look for what the fixed places have missed.
  if (receiver.parts == Receiver::Parts::kOne && !is_one_part(scratch.sites)) {
    receiver.parts = Receiver::Parts::kSeveral;
  }
  if (receiver.parts == Receiver::Parts::kOne) return receive_part(scene, 1, seeds, light_samples, scratch);
  return receive_darkest_part(scene, receiver, seeds, light_samples, scratch);
}

Site turned(const Site& site) { return {site.point, site.position, -site.facing, -site.normal}; }

/// Of what arrives on either side, the share that counts for the front.
struct SideShares {
  Vec3 front, behind;
};
SideShares shares_of(const Surfaces& surfaces, std::span<const Site> sites) {
  Vec3 reflectance, through;
  for (const Site& site : sites) {
    reflectance += surfaces.reflectance(site.point);
    through += surfaces.diffuse_transmittance(site.point);
  }
  SideShares shares;
  for (int c = 0; c < 3; ++c) {
    const double both = reflectance[c] + through[c];
    shares.front[c] = both > 0 ? reflectance[c] / both : 0.5;
    shares.behind[c] = 1 - shares.front[c];
  }
  return shares;
}

void scale(Vec3 share, ReceivedLight& light) {
  for (Vec3* part : {&light.gathered, &light.direct, &light.reflected, &light.coarser}) *part = scaled_by(*part, share);
}

}  // namespace

Reception receive(const GatherScene& scene, Receiver& receiver, std::uint64_t rays_seed, std::uint64_t light_seed,
                  ReceiveScratch& scratch, int light_samples) {
  const bool is_translucent = scene.surfaces.is_translucent(scratch.sites.front().point.triangle);
  const std::vector<Site> sites = is_translucent ? scratch.sites : std::vector<Site>();
  Reception front = receive_one_side(scene, receiver, {rays_seed, light_seed}, light_samples, scratch);
  if (!is_translucent) return front;

  // The same places, turned.
  constexpr std::uint64_t kBehind = 1;
  Receiver other{mixed_bits(receiver.id + kBehind), [&](double u, double v) { return turned(receiver.site_at(u, v)); },
                 receiver.parts_behind};
  scratch.sites.clear();
  for (const Site& site : sites) scratch.sites.push_back(turned(site));
  const Seeds seeds{mixed_bits(rays_seed + kBehind), mixed_bits(light_seed + kBehind)};
  const Reception behind = receive_one_side(scene, other, seeds, light_samples, scratch);
  receiver.parts_behind = other.parts;

  // A side that is buried gets nothing.
  const SideShares shares = shares_of(scene.surfaces, sites);
  Reception out = front;
  out.rays += behind.rays;
  out.light_rays += behind.light_rays;
  out.is_buried = front.is_buried && behind.is_buried;
  out.visible_share = std::max(front.visible_share, behind.visible_share);
  if (front.is_buried) out.openness = behind.openness;
  for (std::size_t r = 0; r < static_cast<std::size_t>(scene.rows.replicates()); ++r) {
    ReceivedLight own = front.replicates[r], through = behind.replicates[r];
    scale(front.is_buried ? Vec3{} : shares.front, own);
    scale(behind.is_buried ? Vec3{} : shares.behind, through);
    out.replicates[r] = {own.gathered + through.gathered, own.direct + through.direct,
                         own.reflected + through.reflected, own.coarser + through.coarser};
  }
  return out;
}

}  // namespace radbake::radiosity
