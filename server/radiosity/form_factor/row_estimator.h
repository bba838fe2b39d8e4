#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include "server/radiosity/survey/site.h"

namespace radbake::radiosity {

/// The form factors from one patch, as weights: F_ij = weight_ij / counted.
///
/// Sum of the weights + escaped + absorbed = counted, up to rounding. `counted` says how much the row is worth beside
/// another estimate of the same exchange: rays where the estimator draws rays, else the rays of an equal variance.
struct FormFactorRow {
  struct Entry {
    std::uint32_t patch;
    float weight;  ///< > 0; a number of rays is exact up to 2^24
  };
  std::vector<Entry> entries;  ///< ascending by patch, each once
  double counted = 0;          ///< 0: the patch is buried; nothing else means anything then
  double escaped = 0;          ///< into the open: the row's share of the sky
  double absorbed = 0;         ///< at the backs of single-sided surfaces
  std::uint64_t traced = 0;    ///< rays that were traced for it
  double clipped = 0;          ///< what parts known exactly had above 1 in sum, and was cut off
  double stated_error = 0;     ///< |sum of form factors - exact| is at most this; 0: not known, rays have a variance
};

/// Buffers that one thread reuses from row to row. Each estimator makes its own kind.
class RowScratch {
 public:
  virtual ~RowScratch() = default;
};

/// A way to find the form factors from a patch to all patches. Thread-safe. Geometry only: no light, no material.
///
/// What a row is depends on the patch and the seed alone, never on the thread or on rows that were made before.
class RowEstimator {
 public:
  virtual ~RowEstimator() = default;

  /// "analytic", "hemicube", "hemisphere", "adaptive".
  virtual const char* name() const = 0;

  virtual std::unique_ptr<RowScratch> make_scratch() const = 0;

  /// How many sites a patch should have; they sample its material and light too.
  virtual int num_sites() const = 0;

  /// Estimates one row. Shapes: sites [n], n >= 1, spread over the patch; is_buried [n], 1 where a site lies inside
  /// other geometry (its material and light do not count). Replaces what row and is_buried hold.
  /// Errors: none; stopped early, the row means nothing.
  virtual void estimate(std::uint32_t patch, std::span<const Site> sites, std::uint64_t seed, RowScratch& scratch,
                        const std::stop_token& stop, FormFactorRow& row,
                        std::vector<std::uint8_t>& is_buried) const = 0;
};

}  // namespace radbake::radiosity
