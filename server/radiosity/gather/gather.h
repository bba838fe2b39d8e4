#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "server/radiosity/form_factor/hemisphere.h"
#include "server/radiosity/lightmap/atlas.h"
#include "server/radiosity/lightmap/fill.h"
#include "server/radiosity/lights/direct_light.h"
#include "server/radiosity/patches/patches.h"

namespace radbake::radiosity {

/// What a gather reads. All parts outlive it.
struct GatherScene {
  const Surfaces& surfaces;
  const Atlas& atlas;
  const HemisphereEstimator& rows;
  const DirectLight& direct;
  std::span<const Vec3> radiosity;  ///< [patches] B'
  Vec3 sky;                         ///< luminance, nit
  std::uint64_t seed = 0;
};

/// A rectangle of finished texels. Shapes: rgba [height * width * 4], rows from the top.
struct GatheredTile {
  int x = 0, y = 0, width = 0, height = 0;
  std::vector<float> rgba;
  std::uint64_t texels_done = 0;  ///< with coverage, so far in the whole gather
};

/// A gathered lightmap before it is filled.
struct GatheredMap {
  std::vector<float> rgba;         ///< [size * size * 4] irradiance, lx, and coverage
  std::vector<TexelState> states;  ///< [size * size]
  std::uint64_t num_rays = 0;
  std::uint64_t num_light_rays = 0;
  double mean_irradiance = 0;  ///< of valid texels, weighted by area, mean of the channels, lx
  bool is_cancelled = false;
};

/// Final gather: the irradiance of each texel from all patches by one row of rays, and from the lights by sampling.
///
///   H = sum_j F_j B'_j + F_sky pi L_sky + H^direct       over the visible part of the texel's footprint
///
/// A texel of which more than half is buried in other geometry is invalid. Tiles are reported as they finish, one call
/// at a time, in any order; the map does not depend on that order.
GatheredMap gather_lightmap(const GatherScene& scene, const std::function<void(const GatheredTile&)>& on_tile,
                            std::stop_token stop);

}  // namespace radbake::radiosity
