#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "server/radiosity/gather/receive.h"
#include "server/radiosity/lightmap/atlas.h"
#include "server/radiosity/lightmap/fill.h"

namespace radbake::radiosity {

/// A rectangle of finished texels of one sheet. Shapes: rgba [height * width * 4], rows from the top.
struct GatheredTile {
  int sheet = 0;
  int x = 0, y = 0, width = 0, height = 0;
  std::vector<float> rgba;
  std::uint64_t texels_done = 0;  ///< with coverage, so far in the whole gather
};

/// Gathered lightmaps, sheets stacked, before they are filled.
struct GatheredMap {
  std::vector<float> rgba;  ///< [num_rows * width * 4] irradiance, lx, and coverage
  // The same shape, where they are asked for: lx, lx, and openness in each channel.
  std::vector<float> direct, indirect, openness;
  std::vector<TexelState> states;  ///< [num_rows * width]
  std::uint64_t num_rays = 0;
  std::uint64_t num_light_rays = 0;
  double mean_irradiance = 0;  ///< of valid texels, weighted by area, mean of the channels, lx
  bool is_cancelled = false;
};

/// Parts of the light that are kept beside all of it.
struct GatherLayers {
  bool direct = false, indirect = false, openness = false;
};

/// Final gather: receive() over the footprint of each texel. A buried texel is invalid. Tiles are reported as they
/// finish, one call at a time, in any order; the map does not depend on that order.
GatheredMap gather_lightmap(const GatherScene& scene, const Atlas& atlas, GatherLayers layers,
                            const std::function<void(const GatheredTile&)>& on_tile, std::stop_token stop);

}  // namespace radbake::radiosity
