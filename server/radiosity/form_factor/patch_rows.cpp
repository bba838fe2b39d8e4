#include "server/radiosity/form_factor/patch_rows.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <numeric>

#include "server/radiosity/form_factor/hemisphere.h"
#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

enum Purpose : std::uint64_t { kSitesOfPatch = 1, kRaysOfPatch = 2, kLightOfPatch = 3, kReachOfPatch = 4 };

/// Independent estimates of a patch's direct light; their spread is its standard error.
constexpr int kDirectReplicates = 4;
/// Places that are tried for opaque ones where light passes some of a patch: what is opaque to less is left out.
constexpr int kCandidates = 64;
/// Few, so that threads run out of rows at about the same time where rows cost much or unequally.
constexpr std::size_t kRowsPerTask = 4;

}  // namespace

PatchSampler::PatchSampler(const Surfaces& surfaces, const Patches& patches, const RowEstimator& estimator,
                           const DirectLight& direct, std::uint64_t seed, int channel)
    : surfaces_(surfaces),
      patches_(patches),
      estimator_(estimator),
      direct_(direct),
      seed_(seed),
      channel_(channel),
      site_points_(estimator.num_sites()),
      candidates_(std::max(kCandidates, estimator.num_sites())) {}

void PatchSampler::place_sites(std::uint32_t patch, PatchScratch& scratch) const {
  const auto seeds = SobolPoints::seeds_of(seed_of(seed_, kSitesOfPatch, patch));
  scratch.sites.clear();
  scratch.opaque_share = 1;
  bool is_see_through = false;
  for (int s = 0; s < site_points_.size(); ++s) {
    const SurfacePoint p =
        patches_.sample(patch, site_points_.coordinate(s, 0, seeds), site_points_.coordinate(s, 1, seeds));
    scratch.sites.push_back(side_site(surfaces_, p, patches_.normal(patch, p, surfaces_)));
    is_see_through = is_see_through || surfaces_.is_see_through(p.triangle);
  }
  scratch.is_buried.assign(scratch.sites.size(), 0);
  if (!is_see_through) return;

  // Put sites that are opaque in the place of those that are not.
  double opacities = 0;
  scratch.opaque.clear();
  for (int s = 0; s < candidates_.size(); ++s) {
    const SurfacePoint p =
        patches_.sample(patch, candidates_.coordinate(s, 0, seeds), candidates_.coordinate(s, 1, seeds));
    const double opacity = surfaces_.is_see_through(p.triangle) ? surfaces_.opacity(p)[channel_] : 1;
    opacities += opacity;
    if (candidates_.coordinate(s, 2, seeds) >= opacity) continue;
    scratch.opaque.push_back(side_site(surfaces_, p, patches_.normal(patch, p, surfaces_)));
  }
  scratch.opaque_share = scratch.opaque.empty() ? 0 : opacities / candidates_.size();
  for (std::size_t s = 0; s < scratch.sites.size() && !scratch.opaque.empty(); ++s) {
    scratch.sites[s] = scratch.opaque[s % scratch.opaque.size()];
  }
}

void PatchSampler::sample_row(std::uint32_t patch, PatchScratch& scratch, const std::stop_token& stop,
                              FormFactorRow& row) const {
  place_sites(patch, scratch);
  if (scratch.opaque_share > 0) {
    estimator_.estimate(patch, scratch.sites, seed_of(seed_, kRaysOfPatch, patch), *scratch.row, stop, row,
                        scratch.is_buried);
  } else {
    row = {};
    scratch.is_buried.assign(scratch.sites.size(), 1);
  }
}

PatchSample PatchSampler::sample_light(std::uint32_t patch, PatchScratch& scratch) const {
  // Average the material over the part that is not buried.
  PatchSample sample;
  sample.opaque_share = scratch.opaque_share;
  if (scratch.opaque_share <= 0) return sample;
  int visible = 0;
  for (std::size_t s = 0; s < scratch.sites.size(); ++s) {
    if (scratch.is_buried[s]) continue;
    const SurfacePoint& p = scratch.sites[s].point;
    sample.reflectance += surfaces_.reflectance(p);
    sample.diffuse_transmittance += surfaces_.diffuse_transmittance(p);
    if (!surfaces_.is_emitter[p.triangle]) sample.glow += surfaces_.exitance(p);
    ++visible;
  }
  if (visible == 0) return sample;
  sample.visible_share = static_cast<double>(visible) / static_cast<double>(scratch.sites.size());
  sample.reflectance = sample.reflectance / visible;
  sample.diffuse_transmittance = sample.diffuse_transmittance / visible;
  sample.glow = sample.glow / visible;

  // Direct light: mean of the replicates, and the variance of that mean.
  std::array<Vec3, kDirectReplicates> replicates;
  sample.light_rays = static_cast<std::uint32_t>(direct_.estimate(
      scratch.sites, scratch.is_buried, seed_of(seed_, kLightOfPatch, patch), scratch.light, replicates));
  for (const Vec3 replicate : replicates) sample.direct += replicate / kDirectReplicates;
  for (const Vec3 replicate : replicates) {
    const double difference = mean_component(replicate - sample.direct);
    sample.direct_variance += difference * difference / (kDirectReplicates * (kDirectReplicates - 1));
  }
  return sample;
}

Vec3 PatchSampler::glow(std::uint32_t patch, PatchScratch& scratch) const {
  place_sites(patch, scratch);
  Vec3 sum;
  for (const Site& site : scratch.sites) {
    if (!surfaces_.is_emitter[site.point.triangle]) sum += surfaces_.exitance(site.point);
  }
  return scratch.opaque_share > 0 ? sum / static_cast<double>(scratch.sites.size()) : Vec3{};
}

std::vector<std::uint8_t> find_reached_backs(const Surfaces& surfaces, const Patches& patches,
                                             const Visibility& visibility, const std::stop_token& stop) {
  constexpr int kRays = 16, kSites = 4;
  const std::size_t num_fronts = patches.num_cells(), num_backs = patches.size() - num_fronts;
  const HemisphereEstimator estimator(surfaces, patches, visibility, kRays);
  const SobolPoints points(kSites);
  std::vector<std::vector<std::uint32_t>> met(num_backs);
  std::vector<std::uint8_t> reached(patches.size(), 0);
  for_each_range(num_backs, kRowsPerTask, [&](std::size_t begin, std::size_t end) {
    HemisphereEstimator::Scratch scratch;
    RowSample row;
    std::vector<Site> sites;
    for (std::size_t k = begin; k < end && !stop.stop_requested(); ++k) {
      const auto patch = static_cast<std::uint32_t>(num_fronts + k);
      const std::uint64_t seed = seed_of(0, kReachOfPatch, patch);
      const auto seeds = SobolPoints::seeds_of(seed);
      sites.clear();
      for (int s = 0; s < kSites; ++s) {
        const SurfacePoint p = patches.sample(patch, points.coordinate(s, 0, seeds), points.coordinate(s, 1, seeds));
        sites.push_back(side_site(surfaces, p, patches.normal(patch, p, surfaces)));
      }
      // Light that meets a back which lets it through lights the front.
      const auto pieces = patches.pieces(patches.front_of(patch));
      if (std::any_of(pieces.begin(), pieces.end(),
                      [&](const auto& piece) { return surfaces.is_translucent(piece.triangle); })) {
        reached[patch] = 1;
      }
      estimator.sample_row(sites, seed, scratch, row);
      for (const std::uint32_t other : row.arrivals) {
        if (other < num_fronts) {
          reached[patch] = 1;
        } else {
          met[k].push_back(other);
        }
      }
    }
  });
  // From the backs that see fronts to those that see them.
  for (bool is_changed = true; is_changed;) {
    is_changed = false;
    for (std::size_t k = 0; k < num_backs; ++k) {
      if (reached[num_fronts + k]) continue;
      const bool sees_reached =
          std::any_of(met[k].begin(), met[k].end(), [&](std::uint32_t other) { return reached[other] != 0; });
      if (!sees_reached) continue;
      reached[num_fronts + k] = 1;
      is_changed = true;
    }
  }
  return reached;
}

void sample_patches(const PatchSampler& sampler, std::size_t num_fronts, std::span<const std::uint8_t> reached,
                    const std::function<void(std::uint32_t, FormFactorRow&, const PatchSample&)>& take,
                    const OnRow& on_row, const std::stop_token& stop,
                    const std::function<const std::vector<FormFactorRow::Entry>*(std::uint32_t)>& known) {
  std::vector<std::atomic<std::uint8_t>> is_met(sampler.size());
  // First all fronts and the reached backs; then, wave by wave, the backs that the last wave's rows have met.
  std::vector<std::uint32_t> wave(num_fronts);
  std::iota(wave.begin(), wave.end(), 0);
  std::vector<std::uint8_t> is_known(sampler.size(), 0);
  for (auto patch = static_cast<std::uint32_t>(num_fronts); patch < reached.size(); ++patch) {
    if (!reached[patch]) continue;
    is_known[patch] = 1;
    wave.push_back(patch);
  }
  std::uint64_t total = wave.size();
  std::atomic<std::uint64_t> done = 0;
  while (!wave.empty()) {
    for_each_range(wave.size(), kRowsPerTask, [&](std::size_t begin, std::size_t end) {
      PatchScratch scratch = sampler.make_scratch();
      FormFactorRow row;
      for (std::size_t k = begin; k < end; ++k) {
        if (stop.stop_requested()) return;
        const auto* entries = known ? known(wave[k]) : nullptr;
        const bool is_new = entries == nullptr;
        if (is_new) {
          sampler.sample_row(wave[k], scratch, stop, row);
          if (stop.stop_requested()) return;
          entries = &row.entries;
        }
        for (const FormFactorRow::Entry& entry : *entries) is_met[entry.patch].store(1, std::memory_order_relaxed);
        if (is_new) take(wave[k], row, sampler.sample_light(wave[k], scratch));
        const std::uint64_t now = ++done;
        if (on_row) on_row(now, total, is_new);
      }
    });
    if (stop.stop_requested()) return;
    wave.clear();
    for (auto patch = static_cast<std::uint32_t>(num_fronts); patch < sampler.size(); ++patch) {
      if (is_known[patch] || !is_met[patch].load(std::memory_order_relaxed)) continue;
      is_known[patch] = 1;
      wave.push_back(patch);
    }
    total += wave.size();
  }
}

}  // namespace radbake::radiosity
