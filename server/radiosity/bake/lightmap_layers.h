#pragma once

#include <string>
#include <vector>

#include "server/radiosity/bake/bake.h"
#include "server/radiosity/gather/gather.h"
#include "server/radiosity/lightmap/atlas.h"

namespace radbake::radiosity {

/// "lightmap_0": all light of a sheet.
inline std::string lightmap_name(int sheet) { return "lightmap_" + std::to_string(sheet); }

/// Layers beside the one of all light.
struct WantedLayers {
  bool direct = false, indirect = false, openness = false;
};

/// Fills buried and padding texels of a gathered map, brings its seams together, and appends it, sheet by sheet: all
/// light first, then direct and indirect light and openness as wanted, then the standard errors. Returns what the
/// report says of it. Shapes: standard_errors [texels * 4].
LightmapSummary append_layers(const Surfaces& surfaces, const LightmapGather& gather, WantedLayers wanted,
                              std::vector<float> standard_errors, std::vector<Layer>& layers);

}  // namespace radbake::radiosity
