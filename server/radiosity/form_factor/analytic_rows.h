#pragma once

#include <atomic>
#include <memory>
#include <span>

#include "server/radiosity/form_factor/analytic_pair.h"
#include "server/radiosity/form_factor/patch_polygons.h"
#include "server/radiosity/form_factor/row_estimator.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// A F between patches, with what stands between them: sums of pair_exchange over their polygons.
///
/// Both directions of a pair are one number, found with the lower patch first whoever asks: A_i F_ij and A_j F_ji have
/// equal bits. Thread-safe.
class PatchExchanges {
 public:
  /// tolerance: of F of the smaller patch of a pair. keeps_all: keep each exchange that was found, 12 bytes for each
  /// two patches, so that the other direction costs nothing; where rows are made one by one again and again, do
  /// without.
  PatchExchanges(const Surfaces& surfaces, const Patches& patches, const Visibility& visibility, double tolerance,
                 bool keeps_all);

  struct Value {
    double value = 0;
    double error = 0;
  };
  /// Buffers of one thread.
  struct Scratch {
    std::vector<std::uint32_t> triangles, candidates;
    Shaft shaft;
  };
  Value between(std::uint32_t i, std::uint32_t j, Scratch& scratch) const;

  /// What patch i sends to the back of front patch j, which has no patch: the surface is single-sided there.
  Value onto_back(std::uint32_t i, std::uint32_t j, Scratch& scratch) const;

  const Patches& patches() const { return patches_; }

 private:
  std::span<const Piece> polygons_of(std::uint32_t patch) const {
    return patches_.is_back(patch) ? polygons_.back_of(patches_.front_of(patch)) : polygons_.of(patch);
  }
  Value sum(std::span<const Piece> from, std::span<const Piece> to, bool is_one_patch, double tolerance,
            Scratch& scratch) const;
  void find_candidates(const Piece& p, const Piece& q, Scratch& scratch) const;

  const Patches& patches_;
  const Visibility& visibility_;
  PatchPolygons polygons_;
  double tolerance_;
  std::vector<std::uint32_t> all_occluders_;
  // [n (n + 1) / 2] of pairs (i <= j) at j (j + 1) / 2 + i; NaN: not found yet. The error is written first.
  mutable std::vector<std::atomic<double>> values_;
  mutable std::vector<std::atomic<float>> errors_;
};

/// Rows by formula: F_ij = (A F)_ij / A_i of all patches that i faces.
///
/// Absorbed is what reaches the backs of single-sided surfaces, escaped what is missing to 1, and 0 where the stated
/// error may account for it: a closed room has no sky. A patch is buried when more than half of its light is absorbed.
/// No random numbers: sites and seed do not matter, and `counted` is kEqualRays for all rows.
/// Errors: stated_error is the sum of the pairs' errors, over A_i. Surfaces that lie on each other face to face see no
///         light through each other: what is coplanar does not count as between.
/// Cost:   3 to 200 microseconds a pair; milliseconds where several occluders hide each other. Stops within a pair.
class AnalyticEstimator final : public RowEstimator {
 public:
  /// tolerance: of one form factor.
  AnalyticEstimator(const Surfaces& surfaces, const Patches& patches, const Visibility& visibility,
                    double tolerance = kTolerance, bool keeps_all = true)
      : exchanges_(surfaces, patches, visibility, tolerance, keeps_all) {}

  static constexpr double kTolerance = 1e-7;
  /// Weights are shares of so many rays. Their spread would be 1e-3 of F at 1e-3; F here is better known than that.
  static constexpr double kEqualRays = 0x1p30;

  const char* name() const override { return "analytic"; }
  std::unique_ptr<RowScratch> make_scratch() const override;
  int num_sites() const override { return kNumSites; }
  void estimate(std::uint32_t patch, std::span<const Site> sites, std::uint64_t seed, RowScratch& scratch,
                const std::stop_token& stop, FormFactorRow& row, std::vector<std::uint8_t>& is_buried) const override;

 private:
  static constexpr int kNumSites = 64;  ///< they sample material and direct light only
  PatchExchanges exchanges_;
};

}  // namespace radbake::radiosity
