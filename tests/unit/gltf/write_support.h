#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/gltf/write_gltf.h"
#include "tests/unit/gltf/gltf_builder.h"

namespace radbake::gltf {

/// A file that was written, taken apart, and what reading it again gives.
struct Written {
  GltfScene before;
  std::vector<BakedMesh> baked;
  Result<void> result;
  nlohmann::ordered_json document;
  std::string bin;
  GltfScene after;

  const nlohmann::ordered_json& primitive(std::size_t mesh, std::size_t index = 0) const;
  /// Floats of an accessor without gaps, and integers of an accessor of indices.
  std::vector<float> floats(const nlohmann::ordered_json& accessor) const;
  std::vector<std::uint32_t> indices(const nlohmann::ordered_json& accessor) const;
  /// Bytes of an accessor's view.
  std::string view(const nlohmann::ordered_json& accessor) const;
};

/// Says what was baked, mesh by mesh.
using Bake = std::function<void(const Scene& scene, std::vector<BakedMesh>& baked)>;

/// Reads a file, bakes it by hand, writes it with lightmaps of intensity 10, 11, ... and reads that again.
/// `name`: scene.glb or scene.gltf; other files of the folder by name.
Written write_baked(const std::string& bytes, const Bake& bake, const WriteOptions& options = {},
                    const std::string& name = "scene.glb",
                    const std::vector<std::pair<std::string, std::string>>& beside = {});

/// Every triangle gets vertices of its own: the mesh's where no triangle before used them, else copies. The vertex i
/// lies at (i / 64, 1 - i / 64) in lightmap 0 and has i, 2 i, 3 i lx.
BakedMesh taken_apart(const Mesh& mesh);

/// Corners of all triangles: position and texcoord1.
std::vector<std::array<double, 5>> corners_of(const Mesh& mesh);

/// The corners that a bake asks for, in the order of the scene's triangles.
std::vector<std::array<double, 5>> corners_of(const Mesh& mesh, const BakedMesh& baked);

/// Three triangles that share edges, as a strip: five vertices in the plane z = 0, with indices.
GltfBuilder strip();

}  // namespace radbake::gltf
