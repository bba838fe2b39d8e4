#pragma once

#include "server/radiosity/form_factor/analytic_rows.h"
#include "server/radiosity/form_factor/hemisphere.h"

namespace radbake::radiosity {

/// How large a patch is, for the choice of a method.
struct PatchExtent {
  Vec3 middle;
  double radius = 0;  ///< of the sphere about the middle that holds the patch
  double area = 0;
};

/// Below this many edges of the larger patch, taken as a square, pairs are near.
inline constexpr double kNearEdges = 2;
/// Above this share of either's light, A / (pi d^2), pairs are large.
inline constexpr double kLargeShare = 0.05;

/// Whether a pair is near or subtends much: there rays are at their worst, and the formula is worth its time. The same
/// for both directions.
bool is_near_or_large(const PatchExtent& a, const PatchExtent& b);

/// Rows by rays, but for pairs that are near or subtend much: those by formula.
///
///   F_ij = (A F)_ij / A_i                                 j in N(i): near or large
///   F_ij = (1 - sum over N(i) of F_ik) n_ij / (n - n_N)   else: n_ij of n rays met j first, n_N those in N(i)
///
/// Rays that meet N(i) are thrown away; the others, escaped and absorbed ones with them, share what the formula leaves.
/// Where the formula has more than 1 in sum its part is cut down to 1: `clipped` is the weight that was cut off. Where
/// no ray is left, the formula's part is all there is and is scaled to 1. A patch that lies partly in other geometry
/// has its row by rays alone: only they know which part is seen. Errors: in N(i) the tolerance, asked of the formula;
/// else the variance is at most F_ij (S - F_ij) / (n S), S what the
///         formula leaves: below that of rays alone by as much, and no error at all from N(i). stated_error is 0: rays
///         have a variance, not a bound.
/// Source: stratification by regions of known integral, e.g. Owen 2013, Monte Carlo theory, chapter 8.
class AdaptiveEstimator final : public RowEstimator {
 public:
  AdaptiveEstimator(const Surfaces& surfaces, const Patches& patches, const Visibility& visibility, int rays,
                    double tolerance = kTolerance);

  /// Of one form factor by formula: far below what some thousand rays reach.
  static constexpr double kTolerance = 1e-5;

  const char* name() const override { return "adaptive"; }
  std::unique_ptr<RowScratch> make_scratch() const override;
  int num_sites() const override { return rays_.num_sites(); }
  void estimate(std::uint32_t patch, std::span<const Site> sites, std::uint64_t seed, RowScratch& scratch,
                const std::stop_token& stop, FormFactorRow& row, std::vector<std::uint8_t>& is_buried) const override;

 private:
  HemisphereEstimator rays_;
  PatchExchanges exchanges_;
  std::vector<PatchExtent> extents_;  ///< [front patches]
};

}  // namespace radbake::radiosity
