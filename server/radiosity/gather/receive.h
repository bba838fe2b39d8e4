#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "server/radiosity/form_factor/hemisphere.h"
#include "server/radiosity/gather/parting.h"
#include "server/radiosity/lights/direct_light.h"
#include "server/radiosity/patches/patches.h"

namespace radbake::radiosity {

/// Replicates of the chain from rows to texels, at most.
inline constexpr int kMaxReplicates = 4;

/// What the patches send, as one replicate of the chain has found it. Shapes: [patches], lx.
struct SentLight {
  std::span<const Vec3> radiosity;     ///< B'
  std::span<const Vec3> glow = {};     ///< E_in, the part of B' that is not reflected; empty: nobody asks
  std::span<const Vec3> coarser = {};  ///< B' of patches twice as large; empty: nobody asks
};

/// What a gather reads. All parts outlive it.
struct GatherScene {
  const Surfaces& surfaces;
  const Visibility& visibility;
  const HemisphereEstimator& rows;
  const DirectLight& direct;
  std::span<const SentLight> sent;  ///< [rows.replicates()]
  Vec3 sky;                         ///< luminance, nit
  std::uint64_t seed = 0;
  /// Of channels 1 and 2, where they have rows of their own; `rows` is channel 0's then.
  std::span<const HemisphereEstimator> other_rows = {};
  double dark = 0;  ///< irradiance up to this is none: what the solver cannot tell from 0, lx
};

/// Light that arrives at one receiver, mean over the part that counts, lx.
struct ReceivedLight {
  Vec3 gathered;   ///< along hemisphere rays: from patches, and from the sky where it is not sampled
  Vec3 direct;     ///< straight from emitters, lamps and sampled skies
  Vec3 reflected;  ///< of `gathered` what surfaces reflect
  Vec3 coarser;    ///< what `gathered` would gain from patches twice as large

  Vec3 irradiance() const { return gathered + direct; }
};

struct Reception {
  std::array<ReceivedLight, kMaxReplicates> replicates;  ///< [rows.replicates()], independent of each other
  double openness = 0;       ///< cosine-weighted share of directions in which nothing is within the rows' near distance
  double visible_share = 0;  ///< of the sites: those that count
  bool is_buried = true;     ///< most of it lies inside other geometry: there is no light to tell
  std::uint64_t rays = 0, light_rays = 0;

  /// Mean of the replicates.
  ReceivedLight mean(int num_replicates) const;
};

/// Buffers that one thread reuses from receiver to receiver.
struct ReceiveScratch {
  std::vector<Site> sites;
  HemisphereEstimator::Scratch hemisphere;
  DirectLight::Scratch light;
  RowSample row;
  RowSample other_row;
  std::vector<std::uint8_t> is_out;
  std::vector<Site> places;
  PartingScratch parting;
};

/// What is the same about a receiver in every pass and with every seed.
struct Receiver {
  /// Whether anything stands across it.
  enum class Parts : std::uint8_t { kUnknown, kOne, kSeveral };

  std::uint64_t id = 0;  ///< tells it from others of the same bake
  /// The place at (u, v) of the unit square, spread over the receiver by area.
  std::function<Site(double u, double v)> site_at;
  Parts parts = Parts::kUnknown;  ///< receive() finds out
  Parts parts_behind = Parts::kUnknown;

  /// Whether either side was one part and is several now: what was gathered before is of all of them.
  bool turned_out_cut(Parts before, Parts behind_before) const {
    return (before == Parts::kOne && parts == Parts::kSeveral) ||
           (behind_before == Parts::kOne && parts_behind == Parts::kSeveral);
  }
};

/// Gathers the light at scratch.sites, which are spread over one receiver; each replicate has its share of them, in
/// order. What counts is decided for all replicates together.
///
///   H = sum_j F_j B'_j + F_sky pi L_sky + H^direct       over the visible part
///   H^indirect = sum_j F_j (B'_j - E_in_j)
///
/// Of a sky of every direction, rays that escape bring the dim part, H^direct the bright one.
/// A site does not count where it is buried: inside a single-sided object, or inside a closed object of any kind that
/// no light enters (the ground under a box that stands on it). Where something thin stands across the receiver, only
/// the darkest part of it counts (of those of an eighth at least): a receiver that showed the light of the other side
/// of a wall, or a mean of both, would be a leak. Its parts are those of places that are the same in every pass: found
/// anew by the sites of each, a part near an eighth would come and go, and no spread of replicates would tell.
/// What light goes through scattered (a leaf, a curtain) receives on both sides, and its light is the mean of both,
/// weighted by what it sends on of each: a surface that reflected rho + tau of that light would send what this one
/// sends.
///
///   (rho H + tau H_opp) / (rho + tau)
///
/// `rays_seed`, `light_seed`: what this pass of the receiver is.
/// `light_samples`: shadow rays to emitters, of all replicates; 0: as many as scene.direct has.
Reception receive(const GatherScene& scene, Receiver& receiver, std::uint64_t rays_seed, std::uint64_t light_seed,
                  ReceiveScratch& scratch, int light_samples = 0);

/// Of scratch.sites, further places of a receiver that counts as a whole: puts `known` ones, which receive() has had,
/// in the place of those that something parts from them.
void replace_unseen_sites(const GatherScene& scene, std::span<const Site> known, ReceiveScratch& scratch);

}  // namespace radbake::radiosity
