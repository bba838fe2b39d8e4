#include "client/gltf/write_gltf.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <string>

#include "client/gltf/check_document.h"
#include "client/gltf/container.h"
#include "client/gltf/write_document.h"
#include "client/gltf/write_materials.h"
#include "client/gltf/write_primitive.h"

namespace radbake::gltf {
namespace {

constexpr char kDraco[] = "KHR_draco_mesh_compression";

bool is_changed(const BakedMesh& baked) { return baked.lightmap >= 0 || !baked.irradiance.empty(); }

/// Everything that the writer counts on in what was baked for a mesh.
Result<void> check_fits(const Mesh& mesh, const BakedMesh& baked, std::size_t num_lightmaps) {
  const auto error = [&](const std::string& why) {
    return internal_error("the bake of mesh '" + mesh.name + "' does not fit it: " + why);
  };
  const std::size_t num_own = mesh.positions.size();
  const std::size_t n = baked.source_vertices.empty() ? num_own : baked.source_vertices.size();
  if (baked.lightmap >= static_cast<int>(num_lightmaps)) {
    return error("lightmap " + std::to_string(baked.lightmap) + " of " + std::to_string(num_lightmaps));
  }
  if (n < num_own) return error(std::to_string(n) + " vertices of " + std::to_string(num_own));
  for (std::size_t i = 0; i < baked.source_vertices.size(); ++i) {
    const std::size_t source = baked.source_vertices[i];
    if (source >= num_own || (i < num_own && source != i)) {
      return error("vertex " + std::to_string(i) + " copies vertex " + std::to_string(source));
    }
  }
  for (const auto& triangle : baked.triangles) {
    for (const std::uint32_t vertex : triangle) {
      if (vertex >= n) return error("a triangle names vertex " + std::to_string(vertex) + " of " + std::to_string(n));
    }
  }
  if (!baked.uvs.empty() && baked.uvs.size() != n) return error(std::to_string(baked.uvs.size()) + " coordinates");
  if (!baked.irradiance.empty() && baked.irradiance.size() != n) {
    return error(std::to_string(baked.irradiance.size()) + " values of irradiance");
  }
  if (baked.lightmap >= 0 && baked.uvs.empty() && mesh.texcoord1.empty()) {
    return error("it lies in a lightmap and has no TEXCOORD_1");
  }
  return {};
}

double max_irradiance(const std::vector<BakedMesh>& baked) {
  float highest = 0;
  for (const BakedMesh& mesh : baked) {
    for (const auto& [r, g, b] : mesh.irradiance) highest = std::max({highest, r, g, b});
  }
  return highest;
}

/// Gives the meshes of the file their light, instance by instance.
class SceneWriter {
 public:
  SceneWriter(Document& document, const GltfScene& scene, const std::vector<BakedMesh>& baked, double max_color)
      : document_(document), scene_(scene), baked_(baked), primitives_(document, max_color) {}

  Result<void> write(const std::vector<LightmapImage>& lightmaps) {
    RADBAKE_RETURN_IF_ERROR(sort_by_node());
    const std::size_t num_meshes = document_.json.at("meshes").size();
    for (std::size_t mesh = 0; mesh < num_meshes; ++mesh) RADBAKE_RETURN_IF_ERROR(write_mesh(mesh));
    attach_lightmaps(document_, uses_, lightmaps);
    drop_unused_compression();
    return {};
  }

 private:
  // Scene meshes of a node, by primitive.
  using Placed = std::vector<std::size_t>;

  Result<void> sort_by_node() {
    if (document_.json.contains("nodes")) placed_.resize(document_.json["nodes"].size());
    for (std::size_t i = 0; i < scene_.sources.size(); ++i) {
      const MeshSource& source = scene_.sources[i];
      const auto node = static_cast<std::size_t>(source.node);
      const auto primitive = static_cast<std::size_t>(source.primitive);
      const bool is_there = node < placed_.size() && document_.json["nodes"][node].value("mesh", -1) == source.mesh &&
                            primitive < document_.json["meshes"].at(source.mesh).at("primitives").size();
      if (!is_there) {
        return internal_error("mesh '" + scene_.scene.meshes[i].name + "' is not in the file any more");
      }
      if (is_changed(baked_[i])) placed_[node].push_back(i);
    }
    return {};
  }

  bool is_baked_alike(const Placed& a, const Placed& b) const {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(), [&](std::size_t i, std::size_t k) {
      return scene_.sources[i].primitive == scene_.sources[k].primitive && baked_[i] == baked_[k] &&
             scene_.scene_vertex[i] == scene_.scene_vertex[k];
    });
  }

  // Nodes whose bakes are alike share a mesh; nodes that were not baked keep the file's.
  Result<void> write_mesh(std::size_t mesh) {
    const OrderedJson original = document_.json["meshes"][mesh];
    bool is_taken = false;
    std::vector<std::size_t> nodes;
    for (std::size_t node = 0; node < placed_.size(); ++node) {
      const OrderedJson& object = document_.json["nodes"][node];
      if (!object.contains("mesh") || object["mesh"] != mesh) continue;
      if (placed_[node].empty()) is_taken = true;
      if (!placed_[node].empty()) nodes.push_back(node);
    }
    std::vector<std::pair<std::size_t, std::size_t>> written;  // node, mesh
    for (const std::size_t node : nodes) {
      const auto alike = std::find_if(written.begin(), written.end(), [&](const auto& other) {
        return is_baked_alike(placed_[node], placed_[other.first]);
      });
      std::size_t place = mesh;
      if (alike != written.end()) {
        place = alike->second;
      } else {
        if (is_taken) place = document_.add("meshes", original);
        is_taken = true;
        RADBAKE_RETURN_IF_ERROR(write_instance(mesh, placed_[node], place));
        written.emplace_back(node, place);
      }
      document_.json["nodes"][node]["mesh"] = place;
    }
    return {};
  }

  Result<void> write_instance(std::size_t mesh, const Placed& placed, std::size_t place) {
    for (const std::size_t i : placed) {
      const auto index = static_cast<std::size_t>(scene_.sources[i].primitive);
      // A copy: what is added to the document may move what it holds.
      OrderedJson primitive = document_.json["meshes"][place]["primitives"][index];
      RADBAKE_ASSIGN_OR_RETURN(
          const MaterialUse use,
          primitives_.write({&scene_.scene.meshes[i], &scene_.scene_vertex[i], &baked_[i]}, {mesh, index}, primitive));
      document_.json["meshes"][place]["primitives"][index] = std::move(primitive);
      if (use.lightmap >= 0) uses_[{place, index}] = use;
    }
    return {};
  }

  void drop_unused_compression() {
    for (const OrderedJson& mesh : document_.json["meshes"]) {
      for (const OrderedJson& primitive : mesh.at("primitives")) {
        if (primitive.contains("extensions") && primitive["extensions"].contains(kDraco)) return;
      }
    }
    document_.drop_extension(kDraco);
  }

  Document& document_;
  const GltfScene& scene_;
  const std::vector<BakedMesh>& baked_;
  PrimitiveWriter primitives_;
  std::vector<Placed> placed_;  // [nodes]
  MaterialUses uses_;
};

Result<void> write_checked(const std::filesystem::path& path, const std::filesystem::path& source,
                           const GltfScene& scene, const std::vector<BakedMesh>& baked,
                           const std::vector<LightmapImage>& lightmaps, const WriteOptions& options) {
  const std::size_t num_meshes = scene.scene.meshes.size();
  if (baked.size() != num_meshes || scene.sources.size() != num_meshes || scene.scene_vertex.size() != num_meshes) {
    return internal_error("the bake has " + std::to_string(baked.size()) + " meshes, the scene " +
                          std::to_string(num_meshes));
  }
  for (std::size_t i = 0; i < num_meshes; ++i) {
    RADBAKE_RETURN_IF_ERROR(check_fits(scene.scene.meshes[i], baked[i], lightmaps.size()));
  }
  Result<Document> document = Document::load(source);
  if (!document.ok()) return invalid_argument(source.filename().string() + ": " + document.error().message);
  const double max_color = options.vertex_colors ? max_irradiance(baked) : 0;
  RADBAKE_RETURN_IF_ERROR(SceneWriter(*document, scene, baked, max_color).write(lightmaps));
  return document->write(path);
}

}  // namespace

Result<void> write_gltf(const std::filesystem::path& path, const std::filesystem::path& source, const GltfScene& scene,
                        const std::vector<BakedMesh>& baked, const std::vector<LightmapImage>& lightmaps,
                        const WriteOptions& options) {
  try {
    return write_checked(path, source, scene, baked, lightmaps, options);
  } catch (const std::exception& error) {
    return invalid_argument(source.filename().string() + ": cannot be written again: " + error.what());
  }
}

Result<std::vector<std::string>> read_node_names(const std::filesystem::path& path) {
  RADBAKE_ASSIGN_OR_RETURN(const Container file, read_container(path));
  RADBAKE_ASSIGN_OR_RETURN(const nlohmann::json document, parse_json(file.json));
  std::vector<std::string> names;
  for (const auto& node : document.value("nodes", nlohmann::json::array())) {
    const bool is_named = node.is_object() && node.contains("name") && node["name"].is_string();
    names.push_back(is_named ? node["name"].get<std::string>() : "");
  }
  return names;
}

}  // namespace radbake::gltf
