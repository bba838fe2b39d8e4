#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "client/gltf/write_document.h"
#include "client/gltf/write_gltf.h"

namespace radbake::gltf {

/// What a primitive asks of its material.
struct MaterialUse {
  int lightmap = -1;        ///< index into the lightmaps; -1: the material as it is
  int moved_texcoord1 = 0;  ///< n: what was TEXCOORD_1 is now TEXCOORD_n; 0: it is where it was

  auto operator<=>(const MaterialUse&) const = default;
};

/// Primitives by (mesh, primitive), those that are lightmapped only.
using MaterialUses = std::map<std::pair<std::size_t, std::size_t>, MaterialUse>;

/// Attaches lightmaps to the materials of primitives, those of KHR_materials_variants included.
///
/// MOZ_lightmap belongs to a material: one that is used in several ways gets a copy for each, the first of which takes
/// its place where nobody uses it as it was. Primitives without a material get one with glTF's default values.
/// Textures that looked up TEXCOORD_1 follow it to where it went.
/// Source: MOZ_lightmap (draft, hubs): {index, texCoord, intensity}.
void attach_lightmaps(Document& document, const MaterialUses& uses, const std::vector<LightmapImage>& lightmaps);

}  // namespace radbake::gltf
