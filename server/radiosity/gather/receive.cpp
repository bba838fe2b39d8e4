#include "server/radiosity/gather/receive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace radbake::radiosity {
namespace {

/// A receiver of which less is visible is buried: too few sites to stand for a part.
constexpr double kMinVisibleShare = 0.125;
/// Where less is visible, the part that is gets all of the receiver's rays.
constexpr double kRetracedShare = 0.5;
constexpr std::uint32_t kNoPart = std::numeric_limits<std::uint32_t>::max();

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

/// Whether two sites lie in one plane, as far as a segment between them tells whether something stands there.
bool are_coplanar(const Site& a, const Site& b) {
  constexpr double kFlat = 1e-3;
  const Vec3 between = b.position - a.position;
  const double limit = kFlat * length(between);
  return std::fabs(dot(between, a.facing)) <= limit && std::fabs(dot(between, b.facing)) <= limit &&
         dot(a.facing, b.facing) > 0;
}

/// From one site to another, just above the surface.
Ray segment_between(const Surfaces& surfaces, const Site& a, const Site& b) {
  Ray segment;
  segment.origin = lifted_origin(surfaces, a.position, a.facing, a.point.triangle);
  const auto end = lifted_origin(surfaces, b.position, b.facing, b.point.triangle);
  for (int axis = 0; axis < 3; ++axis) segment.direction[axis] = end[axis] - segment.origin[axis];
  segment.max_distance = 1;
  return segment;
}

/// Parts the sites by what stands between them, seen just above the surface. A site that cannot be seen from the first
/// of a part is tried from a few others of it.
class Parting {
 public:
  Parting(const GatherScene& scene, ReceiveScratch& scratch) : scene_(scene), scratch_(scratch) {}

  /// Numbers the parts in scratch.part. Returns how many sites each has.
  std::vector<std::uint32_t> find_parts() {
    scratch_.part.assign(scratch_.sites.size(), kNoPart);
    std::vector<std::uint32_t> sizes;
    for (std::uint32_t s = 0; s < scratch_.sites.size(); ++s) {
      if (scratch_.is_out[s] || scratch_.part[s] != kNoPart) continue;
      grow(s, static_cast<std::uint32_t>(sizes.size()));
      sizes.push_back(0);
    }
    for (const std::uint32_t part : scratch_.part) {
      if (part != kNoPart) ++sizes[part];
    }
    return sizes;
  }

 private:
  void grow(std::uint32_t first, std::uint32_t part) {
    constexpr int kTries = 4;
    scratch_.part[first] = part;
    std::uint32_t from = first;
    for (int attempt = 0; attempt < kTries; ++attempt) {
      const std::uint32_t found = reach(from, part);
      if (found == kNoPart) return;  // nobody is left
      from = found;
    }
  }

  /// Takes what is seen from a site into its part. Returns the last one taken, or `from`; kNoPart: all have a part.
  std::uint32_t reach(std::uint32_t from, std::uint32_t part) {
    scratch_.segments.clear();
    targets_.clear();
    std::uint32_t last = from;
    bool is_anybody_left = false;
    const Site& a = scratch_.sites[from];
    for (std::uint32_t s = 0; s < scratch_.sites.size(); ++s) {
      if (scratch_.is_out[s] || scratch_.part[s] != kNoPart) continue;
      const Site& b = scratch_.sites[s];
      if (!are_coplanar(a, b)) {
        scratch_.part[s] = part;
        continue;
      }
      scratch_.segments.push_back(segment_between(scene_.surfaces, a, b));
      targets_.push_back(s);
    }
    scratch_.is_blocked.resize(targets_.size());
    scene_.visibility.blocked(scratch_.segments, scratch_.is_blocked);
    for (std::size_t k = 0; k < targets_.size(); ++k) {
      if (scratch_.is_blocked[k]) {
        is_anybody_left = true;
      } else {
        scratch_.part[targets_[k]] = part;
        last = targets_[k];
      }
    }
    return is_anybody_left ? last : kNoPart;
  }

  const GatherScene& scene_;
  ReceiveScratch& scratch_;
  std::vector<std::uint32_t> targets_;
};

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

/// Leaves all parts out but the darkest of those that are large enough to be measured.
void keep_darkest_part(const GatherScene& scene, std::uint64_t light_seed, int light_samples, ReceiveScratch& scratch,
                       Reception& out) {
  const std::vector<std::uint32_t> sizes = Parting(scene, scratch).find_parts();
  if (sizes.size() <= 1) return;
  const std::vector<std::uint8_t> is_buried = scratch.is_out;
  const auto keep = [&](std::uint32_t part) {
    for (std::size_t s = 0; s < scratch.sites.size(); ++s) {
      scratch.is_out[s] = is_buried[s] || scratch.part[s] != part;
    }
  };
  auto kept = static_cast<std::uint32_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t part = 0; part < sizes.size(); ++part) {
    if (sizes[part] < kMinVisibleShare * static_cast<double>(scratch.sites.size())) continue;
    keep(part);
    light_of(scene, light_seed, light_samples, scratch, out);
    const double light = max_component(out.mean(scene.rows.replicates()).irradiance());
    if (light >= least) continue;
    least = light;
    kept = part;
  }
  keep(kept);
}

/// Traces the sites' rows and marks what does not count. Returns the share that does.
double trace_and_sort_out(const GatherScene& scene, std::uint64_t rays_seed, std::uint64_t light_seed,
                          int light_samples, ReceiveScratch& scratch, Reception& out) {
  scene.rows.sample_row(scratch.sites, rays_seed, scratch.hemisphere, scratch.row);
  out.rays += scratch.row.traced;
  scratch.is_out = scratch.row.is_buried;
  leave_out_sealed(scene, light_seed, scratch, out);
  keep_darkest_part(scene, light_seed, light_samples, scratch, out);
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
  scratch.segments.clear();
  const auto known_of = [&](std::size_t s) -> const Site& { return known[s % known.size()]; };
  for (std::size_t s = 0; s < scratch.sites.size(); ++s) {
    scratch.segments.push_back(segment_between(scene.surfaces, known_of(s), scratch.sites[s]));
  }
  scratch.is_blocked.resize(scratch.sites.size());
  scene.visibility.blocked(scratch.segments, scratch.is_blocked);
  for (std::size_t s = 0; s < scratch.sites.size(); ++s) {
    if (scratch.is_blocked[s] && are_coplanar(known_of(s), scratch.sites[s])) scratch.sites[s] = known_of(s);
  }
}

Reception receive(const GatherScene& scene, std::uint64_t rays_seed, std::uint64_t light_seed, ReceiveScratch& scratch,
                  int light_samples) {
  Reception out;
  // Find the part that counts.
  out.visible_share = trace_and_sort_out(scene, rays_seed, light_seed, light_samples, scratch, out);
  if (out.visible_share < kMinVisibleShare) return out;
  if (out.visible_share < kRetracedShare) {
    repeat_visible_sites(scratch);
    trace_and_sort_out(scene, rays_seed, light_seed, light_samples, scratch, out);
  }
  light_of(scene, light_seed, light_samples, scratch, out);
  out.openness = openness_of(scratch);
  out.is_buried = false;
  return out;
}

}  // namespace radbake::radiosity
