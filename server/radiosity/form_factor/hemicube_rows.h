#pragma once

#include "server/radiosity/form_factor/hemicube.h"
#include "server/radiosity/form_factor/row_estimator.h"
#include "server/radiosity/patches/patches.h"

namespace radbake::radiosity {

inline constexpr int kHemicubeResolution = 32;

/// Rows of patches by one hemicube each, at the patch's centre, turned about the normal by the row's seed.
///
///   F_ij = sum of the delta form factors of the pixels whose centre shows j
///
/// The classic, for comparison: the row is that of a point, and its error does not fall with the resolution alone. The
/// centre is the mean of the patch's area; where that does not lie on the patch (a curved or ring-shaped one), or where
/// part of the patch is buried, the visible site that is nearest to it. A site is buried where more than half of a
/// small hemicube shows backs of single-sided surfaces. Errors: not stated; sums of a row are 1 by construction.
/// counted is the number of pixels, all rows alike. Source: Cohen & Greenberg 1985; its limits: Baum, Rushmeier &
/// Winget 1989.
class HemicubeEstimator final : public RowEstimator {
 public:
  /// Precondition: resolution even and >= 2.
  HemicubeEstimator(const Surfaces& surfaces, const Patches& patches, const Visibility& visibility,
                    int resolution = kHemicubeResolution);

  const char* name() const override { return "hemicube"; }
  std::unique_ptr<RowScratch> make_scratch() const override;
  int num_sites() const override;
  void estimate(std::uint32_t patch, std::span<const Site> sites, std::uint64_t seed, RowScratch& scratch,
                const std::stop_token& stop, FormFactorRow& row, std::vector<std::uint8_t>& is_buried) const override;

  /// Where the hemicube of a patch stands that is not buried anywhere.
  Site centre_site(std::uint32_t patch) const;

 private:
  const Surfaces& surfaces_;
  const Patches& patches_;
  const Visibility& visibility_;
  Hemicube hemicube_;
  Hemicube probe_;  ///< tells buried sites
};

}  // namespace radbake::radiosity
