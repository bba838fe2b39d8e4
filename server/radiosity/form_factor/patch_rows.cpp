#include "server/radiosity/form_factor/patch_rows.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <numeric>

#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

enum Purpose : std::uint64_t { kSitesOfPatch = 1, kRaysOfPatch = 2, kLightOfPatch = 3 };

/// Independent estimates of a patch's direct light; their spread is its standard error.
constexpr int kDirectReplicates = 4;
constexpr std::size_t kRowsPerTask = 16;

struct Scratch {
  std::vector<Site> sites;
  HemisphereEstimator::Scratch hemisphere;
  DirectLight::Scratch light;
  RowSample row;
};

/// Sorts the arrivals and counts equal ones.
void count_arrivals(std::vector<std::uint32_t>& arrivals, std::vector<PatchRow::Entry>& entries) {
  std::sort(arrivals.begin(), arrivals.end());
  for (const std::uint32_t patch : arrivals) {
    if (entries.empty() || entries.back().patch != patch) entries.push_back({patch, 0});
    ++entries.back().count;
  }
  entries.shrink_to_fit();
}

class PatchSampler {
 public:
  PatchSampler(const Surfaces& surfaces, const Patches& patches, const HemisphereEstimator& estimator,
               const DirectLight& direct, std::uint64_t seed)
      : surfaces_(surfaces),
        patches_(patches),
        estimator_(estimator),
        direct_(direct),
        seed_(seed),
        site_points_(estimator.num_sites()) {}

  void sample(std::uint32_t patch, Scratch& scratch, PatchRow& out) const {
    // Spread the sites over the patch.
    const auto seeds = SobolPoints::seeds_of(seed_of(seed_, kSitesOfPatch, patch));
    scratch.sites.clear();
    for (int s = 0; s < site_points_.size(); ++s) {
      const SurfacePoint p =
          patches_.sample(patch, site_points_.coordinate(s, 0, seeds), site_points_.coordinate(s, 1, seeds));
      scratch.sites.push_back(side_site(surfaces_, p, patches_.normal(patch, p, surfaces_)));
    }
    estimator_.sample_row(scratch.sites, seed_of(seed_, kRaysOfPatch, patch), scratch.hemisphere, scratch.row);
    out.traced = scratch.row.traced;
    out.visible_share = scratch.row.visible_share;
    if (scratch.row.counted == 0) return;
    out.counted = scratch.row.counted;
    out.escaped = scratch.row.escaped;
    out.absorbed = scratch.row.absorbed;
    count_arrivals(scratch.row.arrivals, out.entries);

    // Average the material over the part that is not buried.
    int visible = 0;
    for (std::size_t s = 0; s < scratch.sites.size(); ++s) {
      if (scratch.row.is_buried[s]) continue;
      const SurfacePoint& p = scratch.sites[s].point;
      out.reflectance += surfaces_.reflectance(p);
      if (!surfaces_.is_emitter[p.triangle]) out.glow += surfaces_.exitance(p);
      ++visible;
    }
    out.reflectance = out.reflectance / visible;
    out.glow = out.glow / visible;

    // Direct light: mean of the replicates, and the variance of that mean.
    std::array<Vec3, kDirectReplicates> replicates;
    out.light_rays = static_cast<std::uint32_t>(direct_.estimate(
        scratch.sites, scratch.row.is_buried, seed_of(seed_, kLightOfPatch, patch), scratch.light, replicates));
    for (const Vec3 replicate : replicates) out.direct += replicate / kDirectReplicates;
    for (const Vec3 replicate : replicates) {
      const double difference = mean_component(replicate - out.direct);
      out.direct_variance += difference * difference / (kDirectReplicates * (kDirectReplicates - 1));
    }
  }

 private:
  const Surfaces& surfaces_;
  const Patches& patches_;
  const HemisphereEstimator& estimator_;
  const DirectLight& direct_;
  std::uint64_t seed_;
  SobolPoints site_points_;
};

}  // namespace

std::vector<PatchRow> sample_patch_rows(const Surfaces& surfaces, const Patches& patches,
                                        const HemisphereEstimator& estimator, const DirectLight& direct,
                                        std::uint64_t seed,
                                        const std::function<void(std::uint64_t, std::uint64_t)>& on_row,
                                        std::stop_token stop) {
  const PatchSampler sampler(surfaces, patches, estimator, direct, seed);
  std::vector<PatchRow> rows(patches.size());
  std::vector<std::uint8_t> is_wanted(patches.size(), 0);
  // First all fronts; then, wave by wave, the backs that the last wave's rays have met.
  std::vector<std::uint32_t> wave(patches.num_cells());
  std::iota(wave.begin(), wave.end(), 0);
  std::fill_n(is_wanted.begin(), wave.size(), 1);
  std::uint64_t total = wave.size();
  std::atomic<std::uint64_t> done = 0;
  while (!wave.empty()) {
    for_each_range(wave.size(), kRowsPerTask, [&](std::size_t begin, std::size_t end) {
      Scratch scratch;
      for (std::size_t k = begin; k < end; ++k) {
        if (stop.stop_requested()) return;
        sampler.sample(wave[k], scratch, rows[wave[k]]);
        const std::uint64_t now = ++done;
        if (on_row) on_row(now, total);
      }
    });
    if (stop.stop_requested()) break;
    std::vector<std::uint32_t> next;
    for (const std::uint32_t patch : wave) {
      for (const PatchRow::Entry& entry : rows[patch].entries) {
        if (is_wanted[entry.patch]) continue;
        is_wanted[entry.patch] = 1;
        next.push_back(entry.patch);
      }
    }
    std::sort(next.begin(), next.end());
    wave = std::move(next);
    total += wave.size();
  }
  return rows;
}

}  // namespace radbake::radiosity
