#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/radiosity/form_factor/cosine_directions.h"
#include "server/radiosity/patches/patches.h"
#include "server/radiosity/survey/site.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// Where the rays of one row went. arrivals.size() + escaped + absorbed = counted.
struct RowSample {
  /// Of one site's rays; none where it is buried.
  struct SiteRays {
    std::uint32_t first_arrival = 0, num_arrivals = 0;
    std::uint32_t first_escape = 0;
    std::uint32_t escaped = 0;
    std::uint32_t near = 0;  ///< rays that met anything within the asked distance
    std::uint32_t counted = 0;
    std::uint32_t backs = 0;  ///< rays that met a back, of single- or double-sided surfaces
  };
  std::vector<std::uint32_t> arrivals;  ///< patch of each ray that met one, in the order of the rays
  std::vector<std::uint32_t> escapes;   ///< rays that met nothing, into Scratch::rays, in their order
  std::uint32_t escaped = 0;            ///< their number: the row's share of the sky
  std::uint32_t absorbed = 0;           ///< rays that met the back of a single-sided surface
  std::uint32_t counted = 0;            ///< rays from sites that are not buried
  std::uint32_t traced = 0;
  std::uint32_t enclosing =
      0;  ///< of all sites' rays, those that met the back of something single-sided that stops light
  std::vector<std::uint8_t> is_buried;  ///< [sites]
  std::vector<SiteRays> of_site;        ///< [sites]
  double visible_share = 1;             ///< of the sites: those not buried
};

/// A form-factor row by rays: F_ij is the share of cosine-distributed rays from i that meet j first.
///
///   F_ij = 1/A_i int_i int_hemisphere cos(theta)/pi V_j(x, omega) d omega dA
///
/// The rays of one row are a scrambled Sobol sequence over the hemisphere, dealt to the sites in runs. Hits,
/// escapes and absorptions sum to the rays counted by construction. Sites of which more than half of the rays meet the
/// back of single-sided opaque surfaces are *buried*, and their rays do not count, unless more than one in 64 of their
/// rays together finds a way out: then they are not inside of anything, only under a sheet. Rays about
/// an interpolated normal that leave below the surface are rejected and do not count either. Errors: variance of F_ij
/// is at most F (1 - F) / rays. Source: Malley's method; the directions are those of CosineDirections.
class HemisphereEstimator {
 public:
  /// `near_distance`: rays that meet anything within are counted apart, scene units; 0: none.
  /// `replicates`: that a row consists of, independent of each other, each with its share of the sites and of the rays,
  /// both multiples of their number.
  HemisphereEstimator(const Surfaces& surfaces, const Patches& patches, const Visibility& visibility, int rays,
                      double near_distance = 0, int replicates = 1)
      : surfaces_(surfaces),
        patches_(patches),
        visibility_(visibility),
        directions_(rays / replicates),
        near_distance_(static_cast<float>(near_distance)),
        replicates_(replicates) {}

  int rays() const { return directions_.size() * replicates_; }
  int replicates() const { return replicates_; }
  /// How many sites a receiver should have for this number of rays.
  int num_sites() const;

  /// Buffers that one thread reuses from row to row.
  struct Scratch {
    CosineDirections::Row directions;
    std::vector<Ray> rays;
    std::vector<Hit> hits;
    std::vector<std::size_t> end_of_site;  ///< into rays
    std::vector<Hit> hits_again;           ///< of another channel
    std::vector<std::uint8_t> wanted;
  };

  /// Traces one row. Shapes: sites [n], n >= 1 and a multiple of replicates(): replicate r has those from r n /
  /// replicates().
  void sample_row(std::span<const Site> sites, std::uint64_t seed, Scratch& scratch, RowSample& row) const;

  /// Of the last sample_row() with this scratch, the share of all sites' rays that end behind the scenes: on the back
  /// of something single-sided that stops light, or on a surface from which, mirrored, they would go on to one.
  double hidden_share(const Scratch& scratch, const RowSample& row) const;

  /// The same rays as the last sample_row() with this scratch, as this estimator's channel meets them; only those are
  /// traced that may differ.
  void sample_again(std::span<const Site> sites, Scratch& scratch, RowSample& row) const;

 private:
  /// Whether a ray met the back of something that is single-sided and stops light.
  bool is_enclosing(const Hit& hit, const Patches::Meeting& met) const;
  /// Whether more than one in kLeak of the rays of sites marked as buried gets into the open, or to a surface that
  /// does not face the back of something in its turn, as those inside of solids that cross do. `counted`: those rays.
  bool has_way_out(const Scratch& scratch, std::span<const Hit> hits, const RowSample& row,
                   std::uint64_t counted) const;
  /// Of rays that start at hits of the last row's, along `direction` of the surface's facing normal and the ray, how
  /// many meet something else than what encloses, or nothing. Looks from up to kMostLooks of `from`, evenly spread.
  struct Looks {
    std::size_t num = 0, open = 0;
  };
  template <typename Direction>
  Looks look_from(const Scratch& scratch, std::span<const Hit> hits, const std::vector<std::size_t>& from,
                  const Direction& direction) const;
  void read_off(std::span<const Site> sites, const Scratch& scratch, std::span<const Hit> hits, RowSample& row) const;
  void deal_rays(std::span<const Site> sites, std::uint64_t seed, Scratch& scratch) const;

  const Surfaces& surfaces_;
  const Patches& patches_;
  const Visibility& visibility_;
  CosineDirections directions_;
  float near_distance_;
  int replicates_;
};

}  // namespace radbake::radiosity
