#include "server/radiosity/form_factor/hemicube_rows.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace radbake::radiosity {
namespace {

/// Sites for material and light, each with a probe of 12 rays.
constexpr int kNumSites = 32;
constexpr int kProbeResolution = 2;
/// Points along a side of the unit square that the centre of a patch is found from.
constexpr int kCentrePoints = 16;

class Scratch final : public RowScratch {
 public:
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  std::vector<double> seen;            ///< [patches] form factor so far; all 0 between rows
  std::vector<std::uint32_t> patches;  ///< those with one
};

double squared_distance(Vec3 a, Vec3 b) { return dot(a - b, a - b); }

/// The site nearest to a point, of those that are wanted.
const Site* nearest_site(std::span<const Site> sites, std::span<const std::uint8_t> is_left_out, Vec3 to) {
  const Site* nearest = nullptr;
  for (std::size_t s = 0; s < sites.size(); ++s) {
    if (is_left_out[s]) continue;
    if (!nearest || squared_distance(sites[s].position, to) < squared_distance(nearest->position, to)) {
      nearest = &sites[s];
    }
  }
  return nearest;
}

Vec3 mean_position(std::span<const Site> sites, std::span<const std::uint8_t> is_left_out) {
  Vec3 sum;
  int count = 0;
  for (std::size_t s = 0; s < sites.size(); ++s) {
    if (is_left_out[s]) continue;
    sum += sites[s].position;
    ++count;
  }
  return sum / std::max(count, 1);
}

Vec3 direction_of(const Ray& ray) { return {ray.direction[0], ray.direction[1], ray.direction[2]}; }

/// The turn of a row's hemicube about its normal: a quarter covers all there are.
double turn_of(std::uint64_t seed) {
  return static_cast<double>(mixed_bits(seed) >> 11) * 0x1p-53 * std::numbers::pi / 2;
}

}  // namespace

HemicubeEstimator::HemicubeEstimator(const Surfaces& surfaces, const Patches& patches, const Visibility& visibility,
                                     int resolution)
    : surfaces_(surfaces),
      patches_(patches),
      visibility_(visibility),
      hemicube_(resolution),
      probe_(kProbeResolution) {}

std::unique_ptr<RowScratch> HemicubeEstimator::make_scratch() const {
  auto scratch = std::make_unique<Scratch>();
  scratch->seen.assign(patches_.size(), 0);
  return scratch;
}

int HemicubeEstimator::num_sites() const { return kNumSites; }

Site HemicubeEstimator::centre_site(std::uint32_t patch) const {
  std::vector<Site> sites;
  for (int j = 0; j < kCentrePoints; ++j) {
    for (int i = 0; i < kCentrePoints; ++i) {
      const SurfacePoint p = patches_.sample(patch, (i + 0.5) / kCentrePoints, (j + 0.5) / kCentrePoints);
      sites.push_back(side_site(surfaces_, p, patches_.normal(patch, p, surfaces_)));
    }
  }
  const std::vector<std::uint8_t> none(sites.size(), 0);
  const Vec3 mean = mean_position(sites, none);
  Site centre = *nearest_site(sites, none, mean);
  // Move there, within the plane and by no more than the points are apart: so far the patch reaches.
  const Vec3 offset = mean - centre.position;
  const bool is_in_plane = std::fabs(dot(offset, centre.facing)) <= surfaces_.ray_offsets[centre.point.triangle];
  if (is_in_plane && dot(offset, offset) * kCentrePoints * kCentrePoints <= patches_.area(patch)) {
    centre.position = mean;
  }
  return centre;
}

void HemicubeEstimator::estimate(std::uint32_t patch, std::span<const Site> sites, std::uint64_t seed,
                                 RowScratch& scratch, const std::stop_token&, FormFactorRow& row,
                                 std::vector<std::uint8_t>& is_buried) const {
  auto& own = static_cast<Scratch&>(scratch);
  row = {std::move(row.entries)};
  row.entries.clear();
  const auto look = [&](const Hemicube& hemicube, const Site& site) {
    const auto origin = lifted_origin(surfaces_, site.position, site.facing, site.point.triangle);
    hemicube.cast(visibility_, origin, site.facing, turn_of(seed), own.rays, own.hits);
    row.traced += own.rays.size();
  };
  const auto patch_at = [&](std::size_t k) {
    return patches_.met_by(own.hits[k], direction_of(own.rays[k]), surfaces_);
  };

  // Tell which sites are buried.
  is_buried.assign(sites.size(), 0);
  for (std::size_t s = 0; s < sites.size(); ++s) {
    look(probe_, sites[s]);
    double absorbed = 0;
    for (std::size_t k = 0; k < own.hits.size(); ++k) {
      if (own.hits[k].triangle != kNoHit && patch_at(k) == kNoPatch) absorbed += probe_.pixels()[k].form_factor;
    }
    is_buried[s] = absorbed > 0.5;
  }
  const auto num_buried = std::count(is_buried.begin(), is_buried.end(), 1);
  if (num_buried == static_cast<std::ptrdiff_t>(sites.size())) return;

  // Look out of the centre of what is visible.
  look(hemicube_,
       num_buried == 0 ? centre_site(patch) : *nearest_site(sites, is_buried, mean_position(sites, is_buried)));
  double escaped = 0, absorbed = 0;
  own.patches.clear();
  for (std::size_t k = 0; k < own.hits.size(); ++k) {
    const double form_factor = hemicube_.pixels()[k].form_factor;
    if (own.hits[k].triangle == kNoHit) {
      escaped += form_factor;
      continue;
    }
    const std::uint32_t met = patch_at(k);
    if (met == kNoPatch) {
      absorbed += form_factor;
      continue;
    }
    if (own.seen[met] == 0) own.patches.push_back(met);
    own.seen[met] += form_factor;
  }

  row.counted = static_cast<double>(hemicube_.pixels().size());
  row.escaped = escaped * row.counted;
  row.absorbed = absorbed * row.counted;
  std::sort(own.patches.begin(), own.patches.end());
  for (const std::uint32_t met : own.patches) {
    row.entries.push_back({met, static_cast<float>(own.seen[met] * row.counted)});
    own.seen[met] = 0;
  }
}

}  // namespace radbake::radiosity
