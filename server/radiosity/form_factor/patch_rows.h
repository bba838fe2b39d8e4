#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "common/base/sequence.h"
#include "server/radiosity/form_factor/row_estimator.h"
#include "server/radiosity/lights/direct_light.h"
#include "server/radiosity/patches/patches.h"

namespace radbake::radiosity {

/// What a patch is as a sender and receiver, averaged over its visible part.
struct PatchSample {
  double visible_share = 0;  ///< of its sites: those not buried; 0: the patch was never reached, or is buried
  double opaque_share = 1;   ///< of its area: what stops light, reflects and emits
  std::uint32_t light_rays = 0;
  Vec3 reflectance;
  Vec3 diffuse_transmittance;  ///< of what arrives on the other side
  Vec3 glow;                   ///< E_in, lx
  Vec3 direct;                 ///< from emitters and lamps, lx
  double direct_variance = 0;  ///< of the mean of direct's channels
};

/// Buffers that one thread reuses from patch to patch.
struct PatchScratch {
  std::vector<Site> sites;
  std::vector<Site> opaque;  ///< of them, where light passes some
  std::vector<std::uint8_t> is_buried;
  double opaque_share = 1;
  std::unique_ptr<RowScratch> row;
  DirectLight::Scratch light;
};

/// Samples patches: their rows, and what they do with light. The same patch gives the same bits at any time, so that a
/// row can be thrown away and made again.
///
/// Of a patch that light passes in part, only what is opaque counts: its sites are chosen among those with a
/// probability of their opacity in `channel`, and its area is opaque_share of the whole.
class PatchSampler {
 public:
  PatchSampler(const Surfaces& surfaces, const Patches& patches, const RowEstimator& estimator,
               const DirectLight& direct, std::uint64_t seed, int channel = 0);

  std::size_t size() const { return patches_.size(); }
  PatchScratch make_scratch() const { return {{}, {}, {}, 1, estimator_.make_scratch(), {}}; }

  /// The form factors of a patch.
  void sample_row(std::uint32_t patch, PatchScratch& scratch, const std::stop_token& stop, FormFactorRow& row) const;

  /// Material and light of the patch whose row scratch was used for last.
  PatchSample sample_light(std::uint32_t patch, PatchScratch& scratch) const;

  /// E_in of a patch, lx, for who needs no row of it: buried parts are not told from others.
  Vec3 glow(std::uint32_t patch, PatchScratch& scratch) const;

 private:
  /// Spreads sites over the opaque part of a patch.
  void place_sites(std::uint32_t patch, PatchScratch& scratch) const;

  const Surfaces& surfaces_;
  const Patches& patches_;
  const RowEstimator& estimator_;
  const DirectLight& direct_;
  std::uint64_t seed_;
  int channel_;  ///< of the opacity
  SobolPoints site_points_;
  SobolPoints candidates_;  ///< for sites where light passes some of a patch
};

/// Which back patches light can reach: rays from them meet fronts, or other backs that are reached. A back that no row
/// has met sends nothing, and is black to texels that see it: each is looked for by rays of its own, once, as the few
/// rays of each row may miss it. Shapes: [patches], 1: reached; fronts are not marked.
std::vector<std::uint8_t> find_reached_backs(const Surfaces& surfaces, const Patches& patches,
                                             const Visibility& visibility, const std::stop_token& stop);

/// Of rows: done, and known to be needed; whether the one that was done last was sampled, or known before.
using OnRow = std::function<void(std::uint64_t done, std::uint64_t total, bool is_new)>;

/// Samples all front patches, the `reached` backs, and other back patches that rows reach, and hands each to `take`.
///
/// take(patch, row, sample) is called from any thread, once a patch; it may move the entries out of the row. Patches
/// that no row reaches are not sampled. on_row is called after each row, from any thread. Stopped early, some are
/// missing. `known`, from any thread: the entries of a row that need not be sampled, or null; it is not taken.
void sample_patches(const PatchSampler& sampler, std::size_t num_fronts, std::span<const std::uint8_t> reached,
                    const std::function<void(std::uint32_t, FormFactorRow&, const PatchSample&)>& take,
                    const OnRow& on_row, const std::stop_token& stop,
                    const std::function<const std::vector<FormFactorRow::Entry>*(std::uint32_t)>& known = {});

}  // namespace radbake::radiosity
