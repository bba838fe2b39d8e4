#include "client/gltf/read_gltf.h"

#include <cmath>
#include <exception>
#include <map>
#include <new>
#include <set>

#include "client/gltf/check_document.h"
#include "client/gltf/container.h"
#include "client/gltf/limits.h"
#include "client/gltf/load_model.h"
#include "client/gltf/place_nodes.h"
#include "client/gltf/primitive_triangles.h"
#include "client/gltf/read_lights.h"
#include "client/gltf/read_materials.h"
#include "client/gltf/read_primitive.h"
#include "client/gltf/scene_warnings.h"
#include "client/gltf/texel_density.h"
#include "client/gltf/vertex_colors.h"
#include "client/gltf/weld_vertices.h"

namespace radbake::gltf {
namespace {

// Drops triangles of zero area; returns the area of the rest.
double drop_degenerate(Mesh& mesh, std::uint64_t& num_dropped) {
  double area_m2 = 0;
  const std::size_t before = mesh.triangles.size();
  std::erase_if(mesh.triangles, [&](const auto& triangle) {
    const double area = length(area_vector(mesh, triangle));
    area_m2 += area;
    return area == 0;
  });
  num_dropped += before - mesh.triangles.size();
  return area_m2;
}

// Exporters write zeros or NaN for the normals of vertices that only degenerate triangles use, and some for others.
// Such a normal becomes that of the first triangle that uses it. Returns whether a used one was replaced.
bool replace_unusable_normals(Mesh& mesh) {
  if (mesh.normals.empty()) return false;
  std::vector<bool> is_usable(mesh.normals.size());
  for (std::size_t i = 0; i < is_usable.size(); ++i) {
    is_usable[i] = is_finite(mesh.normals[i]) && dot(mesh.normals[i], mesh.normals[i]) > 0;
    if (!is_usable[i]) mesh.normals[i] = {0, 0, 1};
  }
  bool is_replaced = false;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t vertex : triangle) {
      if (is_usable[vertex]) continue;
      mesh.normals[vertex] = normalized(area_vector(mesh, triangle));
      is_usable[vertex] = is_replaced = true;
    }
  }
  return is_replaced;
}

// Placements of meshes that are placed more than once.
std::uint64_t count_instances(const std::vector<MeshSource>& sources) {
  std::map<int, std::set<int>> nodes_of_mesh;
  for (const MeshSource& source : sources) nodes_of_mesh[source.mesh].insert(source.node);
  std::uint64_t count = 0;
  for (const auto& [mesh, nodes] : nodes_of_mesh) {
    if (nodes.size() > 1) count += nodes.size();
  }
  return count;
}

// A primitive of the file, ready to be placed.
struct LocalMesh {
  WeldedMesh welded;
  bool has_colors_out_of_range = false;
  bool has_translucent_colors = false;
  double limited_share = 0;  // of its area: reflectance above the limit
};

// Reads one file; messages leave its name to the caller.
class SceneReader {
 public:
  SceneReader(const tinygltf::Model& model, const std::filesystem::path& folder, const ImageDecoder& decode_image,
              const ReadOptions& options)
      : model_(model), folder_(folder), options_(options), materials_(model, decode_image, options) {}

  Result<GltfScene> read(const std::vector<std::string>& ignored_extensions) {
    RADBAKE_ASSIGN_OR_RETURN(const std::vector<PlacedNode> nodes, place_nodes(model_));
    RADBAKE_RETURN_IF_ERROR(check_size(nodes));
    // Mesh by mesh, so that one is read once and placed many times. Each placed node with a mesh is an object.
    std::vector<std::vector<Placement>> instances(model_.meshes.size());
    int num_objects = 0;
    for (const PlacedNode& placed : nodes) {
      const int mesh = model_.nodes[placed.node].mesh;
      if (mesh >= 0) instances[mesh].push_back({placed, num_objects++});
    }
    for (std::size_t mesh = 0; mesh < instances.size(); ++mesh) {
      for (std::size_t i = 0; i < model_.meshes[mesh].primitives.size() && !instances[mesh].empty(); ++i) {
        RADBAKE_RETURN_IF_ERROR(read_instances(mesh, i, instances[mesh]));
      }
    }
    if (result_.scene.meshes.empty()) return nothing_left();
    RADBAKE_ASSIGN_OR_RETURN(result_.scene.lights, read_lights(model_, folder_, nodes));
    result_.scene.materials = std::move(materials_.materials());
    result_.scene.textures = std::move(materials_.textures());
    result_.num_triangles_dropped = counts_.num_triangles_dropped;
    result_.scene.num_instances = count_instances(result_.sources);
    // The last ones may have lost all their triangles.
    counts_.area_m2.resize(result_.scene.materials.size(), 0.0);
    counts_.limited_area_m2.resize(result_.scene.materials.size(), 0.0);
    result_.warnings =
        scene_warnings(result_.scene.materials, materials_.facts(), counts_, ignored_extensions, options_);
    return std::move(result_);
  }

 private:
  struct Placement : PlacedNode {
    int object = 0;
  };

  // Primitives without triangles, or that we do not place, are counted and not read.
  bool is_read(const tinygltf::Primitive& primitive, const tinygltf::Node& node) {
    const bool has_triangles = primitive.mode >= kModeTriangles;
    if (!has_triangles) ++counts_.num_points_and_lines;
    if (has_triangles && node.skin >= 0) ++counts_.num_skinned;
    return has_triangles && node.skin < 0;
  }

  // A small file can place one large mesh a million times.
  Result<void> check_size(const std::vector<PlacedNode>& nodes) const {
    std::uint64_t num_vertices = 0, num_triangles = 0;
    for (const PlacedNode& placed : nodes) {
      if (model_.nodes[placed.node].mesh < 0) continue;
      for (const tinygltf::Primitive& primitive : model_.meshes[model_.nodes[placed.node].mesh].primitives) {
        const PrimitiveSize size = size_of_primitive(model_, primitive);
        num_vertices += size.num_vertices;
        num_triangles += size.num_triangles;
      }
      if (num_vertices > kMaxSceneVertices) {
        return invalid_argument(node_name(model_, placed.node) + ": up to it the scene has " +
                                std::to_string(num_vertices) + " vertices, above the limit of " +
                                std::to_string(kMaxSceneVertices));
      }
      if (num_triangles > kMaxSceneTriangles) {
        return invalid_argument(node_name(model_, placed.node) + ": up to it the scene has " +
                                std::to_string(num_triangles) + " triangles, above the limit of " +
                                std::to_string(kMaxSceneTriangles));
      }
    }
    return {};
  }

  Result<void> read_instances(std::size_t mesh_index, std::size_t primitive_index,
                              const std::vector<Placement>& instances) {
    const tinygltf::Mesh& source = model_.meshes[mesh_index];
    const tinygltf::Primitive& primitive = source.primitives[primitive_index];
    std::vector<Placement> placed;
    for (const Placement& instance : instances) {
      if (is_read(primitive, model_.nodes[instance.node])) placed.push_back(instance);
    }
    if (placed.empty()) return {};
    const std::string label = numbered("mesh", mesh_index, source.name) + ", " + numbered("primitive", primitive_index);
    RADBAKE_ASSIGN_OR_RETURN(const int texcoord0_set, materials_.texcoord0_set(primitive.material));
    Result<FilePrimitive> file = read_primitive(model_, primitive, texcoord0_set);
    if (!file.ok()) return invalid_argument(label + ": " + file.error().message);
    if (file->mesh.triangles.empty()) return {};
    drop_white_colors(file->mesh);
    LocalMesh local{weld_vertices(file->mesh), file->has_colors_out_of_range, file->has_translucent_colors};
    Mesh& mesh = local.welded.mesh;
    RADBAKE_ASSIGN_OR_RETURN(mesh.material, materials_.scene_material(primitive.material));
    RADBAKE_RETURN_IF_ERROR(check_texcoords(mesh, label, texcoord0_set));
    local.limited_share = limit_colors(mesh, materials_.facts()[mesh.material], options_.max_reflectance);
    const std::string mesh_name = source.name.empty() ? "mesh" + std::to_string(mesh_index) : printable(source.name);
    for (const Placement& instance : placed) {
      const std::string& node = model_.nodes[instance.node].name;
      mesh.name = (node.empty() ? "node" + std::to_string(instance.node) : printable(node)) + "/" + mesh_name + "#" +
                  std::to_string(primitive_index);
      mesh.object = instance.object;
      mesh.texel_density = texel_density(model_.nodes[instance.node], source);
      const std::size_t before = result_.scene.meshes.size();
      RADBAKE_RETURN_IF_ERROR(place(local, instance, source, primitive));
      if (result_.scene.meshes.size() == before) continue;
      result_.sources.push_back({instance.node, static_cast<int>(mesh_index), static_cast<int>(primitive_index)});
      result_.scene_vertex.push_back(local.welded.scene_vertex);
    }
    return {};
  }

  // A texture needs the coordinates that it names.
  Result<void> check_texcoords(const Mesh& mesh, const std::string& label, int texcoord0_set) {
    const Material& material = materials_.materials()[mesh.material];
    for (const auto& texture : material.textures()) {
      if (!texture || !(texture->texcoord == 0 ? mesh.texcoord0 : mesh.texcoord1).empty()) continue;
      return invalid_argument(label + ": its material " + in_quotes(material.name) + " has a texture on TEXCOORD_" +
                              std::to_string(texture->texcoord == 0 ? texcoord0_set : 1) +
                              ", which the primitive lacks");
    }
    return {};
  }

  Result<void> place(const LocalMesh& local, const PlacedNode& instance, const tinygltf::Mesh& source,
                     const tinygltf::Primitive& primitive) {
    Mesh mesh = placed_in_world(local.welded.mesh, instance.to_world);
    counts_.num_triangles_dropped += local.welded.num_triangles_dropped;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      if (is_finite(mesh.positions[i])) continue;
      return invalid_argument(node_name(model_, instance.node) + ": its transform takes vertex " + std::to_string(i) +
                              " of " + mesh.name + " to NaN or infinity");
    }
    const double area_m2 = drop_degenerate(mesh, counts_.num_triangles_dropped);
    if (mesh.triangles.empty()) return {};
    if (!std::isfinite(area_m2)) {
      return invalid_argument(node_name(model_, instance.node) + ": its transform makes the area of " + mesh.name +
                              " infinite");
    }
    counts_.area_m2.resize(materials_.materials().size(), 0.0);
    counts_.limited_area_m2.resize(materials_.materials().size(), 0.0);
    counts_.area_m2[mesh.material] += area_m2;
    counts_.limited_area_m2[mesh.material] += area_m2 * local.limited_share;
    counts_.total_area_m2 += area_m2;
    if (replace_unusable_normals(mesh)) counts_.renormaled_area_m2 += area_m2;
    if (local.has_colors_out_of_range) counts_.recolored_area_m2 += area_m2;
    if (local.has_translucent_colors && materials_.materials()[mesh.material].alpha_mode != AlphaMode::kOpaque) {
      counts_.translucent_color_area_m2 += area_m2;
    }
    const std::vector<double>& node_weights = model_.nodes[instance.node].weights;
    for (const double weight : node_weights.empty() ? source.weights : node_weights) {
      if (weight == 0 || primitive.targets.empty()) continue;
      counts_.morphed_area_m2 += area_m2;
      break;
    }
    result_.scene.meshes.push_back(std::move(mesh));
    return {};
  }

  Error nothing_left() const {
    std::string message = "the scene has no surface: no triangle with an area is left";
    if (counts_.num_triangles_dropped > 0) {
      message += "; " + std::to_string(counts_.num_triangles_dropped) + " have zero area after their transforms";
    }
    const std::uint64_t num_skipped = counts_.num_points_and_lines + counts_.num_skinned;
    if (num_skipped > 0) {
      message += "; " + std::to_string(num_skipped) + " primitives are skipped (points, lines, skinned)";
    }
    return invalid_argument(message);
  }

  const tinygltf::Model& model_;
  const std::filesystem::path folder_;
  const ReadOptions& options_;
  MaterialReader materials_;
  ReadCounts counts_;
  GltfScene result_;
};

Result<GltfScene> read_unnamed(const std::filesystem::path& path, const ImageDecoder& decode_image,
                               const ReadOptions& options) {
  if (!(options.max_reflectance >= 0 && options.max_reflectance < 1)) {
    return invalid_argument("the largest reflectance is " + std::to_string(options.max_reflectance) +
                            ", but must be at least 0 and below 1");
  }
  RADBAKE_ASSIGN_OR_RETURN(const Container file, read_container(path));
  RADBAKE_ASSIGN_OR_RETURN(nlohmann::json document, parse_json(file.json));
  RADBAKE_RETURN_IF_ERROR(check_document(document, path.parent_path(), file.bin.size()));
  RADBAKE_ASSIGN_OR_RETURN(const tinygltf::Model model, load_model(document, file.bin, path.parent_path()));
  return SceneReader(model, path.parent_path(), decode_image, options).read(ignored_extensions(document));
}

}  // namespace

Result<GltfScene> read_gltf(const std::filesystem::path& path, const ImageDecoder& decode_image,
                            const ReadOptions& options) {
  const auto named = [&](const std::string& message) {
    return invalid_argument(path.filename().string() + ": " + message);
  };
  try {
    Result<GltfScene> scene = read_unnamed(path, decode_image, options);
    return scene.ok() ? std::move(scene) : Result<GltfScene>(named(scene.error().message));
  } catch (const std::bad_alloc&) {
    return named("there is not enough memory to read it");
  } catch (const std::exception& error) {
    return named(error.what());
  }
}

}  // namespace radbake::gltf
