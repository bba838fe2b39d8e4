#pragma once

#include <string>
#include <vector>

#include "server/radiosity/bake/bake.h"
#include "server/radiosity/gather/gather.h"
#include "server/radiosity/lightmap/atlas.h"

namespace radbake::radiosity {

/// "lightmap_0": all light of a sheet.
inline std::string lightmap_name(int sheet) { return "lightmap_" + std::to_string(sheet); }

/// Fills buried and padding texels of a gathered map, brings its seams together, and appends it, sheet by sheet: all
/// light first, then direct and indirect light and openness, where there are any. Takes the map's values.
/// Returns what the report says of it.
LightmapSummary append_layers(const Surfaces& surfaces, const Atlas& atlas, GatheredMap& map,
                              std::vector<Layer>& layers);

}  // namespace radbake::radiosity
