#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <vector>

#include "server/radiosity/form_factor/hemisphere.h"
#include "server/radiosity/lights/direct_light.h"

namespace radbake::radiosity {

/// What a patch is as a sender and receiver, averaged over its visible part, and its row.
struct PatchRow {
  struct Entry {
    std::uint32_t patch;
    std::uint32_t count;  ///< rays that met it
  };
  std::vector<Entry> entries;  ///< ascending by patch
  std::uint32_t counted = 0;   ///< rays of the row; 0: the patch was never reached, or is buried
  std::uint32_t escaped = 0;
  std::uint32_t absorbed = 0;
  std::uint32_t traced = 0;
  std::uint32_t light_rays = 0;
  double visible_share = 0;
  Vec3 reflectance;
  Vec3 glow;                   ///< E_in, lx
  Vec3 direct;                 ///< from emitters and lamps, lx
  double direct_variance = 0;  ///< of the mean of direct's channels
};

/// Samples the rows and the direct light of all front patches, and of those back patches that rays reach.
///
/// Shapes: returns [patches].
/// on_row is called after each row, from any thread, with the number of rows done and known to be needed.
/// Stopped early, the rest of the rows is empty.
std::vector<PatchRow> sample_patch_rows(const Surfaces& surfaces, const Patches& patches,
                                        const HemisphereEstimator& estimator, const DirectLight& direct,
                                        std::uint64_t seed,
                                        const std::function<void(std::uint64_t done, std::uint64_t total)>& on_row,
                                        std::stop_token stop);

}  // namespace radbake::radiosity
