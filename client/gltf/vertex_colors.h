#pragma once

#include "client/gltf/read_materials.h"
#include "common/scene/scene.h"

namespace radbake::gltf {

/// Colours that are all white say nothing: they go.
void drop_white_colors(Mesh& mesh);

/// Brings a mesh's colours in line with the limit of its material's reflectance, and returns the share of its surface
/// that is above the limit.
///
/// Where no texture multiplies them, the limit is on the product of factor and colour, so a white material of dark
/// vertices loses nothing: with factor f, f' = min(f, limit) and colour c, f' c' = min(f c, limit).
double limit_colors(Mesh& mesh, const MaterialFacts& facts, double max_reflectance);

}  // namespace radbake::gltf
