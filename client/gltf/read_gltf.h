#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::gltf {

/// An image file's bytes decoded to a plane. `is_srgb`: the values are to be brought from sRGB to linear light
/// (opacity never is). Injected, so that this library needs no image library.
using ImageDecoder =
    std::function<Result<TexturePlane>(std::span<const std::byte> bytes, const std::string& name, bool is_srgb)>;

struct ReadOptions {
  double max_reflectance = 0.98;  ///< glTF's default base colour is 1, and 1 does not converge
};

/// Where a mesh of the scene comes from: indices into the file's lists.
struct MeshSource {
  int node = 0;
  int mesh = 0;
  int primitive = 0;
};

/// A vertex of the file that no triangle with an area uses.
inline constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

/// Vertices of a scene mesh are not those of its primitive: vertices that are equal in all that is read (POSITION,
/// NORMAL, TEXCOORD_0, TEXCOORD_1, COLOR_0, bit for bit) are one, numbered in the order in which the triangles first
/// use them. So a scene is the same however a file spells it: strip, list, without indices, sparse.
/// Triangles keep the file's order; those of zero area are left out.
struct GltfScene {
  Scene scene;                      ///< in world space: instances, transforms and mirrors are applied
  std::vector<MeshSource> sources;  ///< [scene.meshes]
  /// [scene.meshes][vertices of the primitive in the file]: the vertex of the scene mesh, or kNoVertex. A vertex of
  /// the scene may stand for several of the file, which may differ in what is not read (joints, tangents).
  /// Of a primitive compressed by Draco, the file's vertices are the points that Draco's decoder gives, in its order.
  std::vector<std::vector<std::uint32_t>> scene_vertex;
  std::vector<Warning> warnings;            ///< what was limited, dropped or not simulated, with its share of the area
  std::uint64_t num_triangles_dropped = 0;  ///< of zero area
};

/// Reads the default scene of a .glb or .gltf file.
///
/// Errors: kInvalidArgument with a message that names the file and the mesh, accessor, node or value: not a glTF,
/// truncated, missing buffer, index out of range, counts beyond the buffer, NaN or infinite position, a cycle in the
/// node tree, no area, unknown required extension, corrupt Draco, image that does not decode.
/// Source: glTF 2.0 specification; KHR_materials_emissive_strength, KHR_lights_punctual, KHR_materials_transmission.
Result<GltfScene> read_gltf(const std::filesystem::path& path, const ImageDecoder& decode_image,
                            const ReadOptions& options);

}  // namespace radbake::gltf
