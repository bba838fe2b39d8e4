#include "client/cli/mesh_results.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

namespace radbake::cli {
namespace {

/// Arrays one after the other, little endian. Nothing is allocated for what is not there.
class ArrayReader {
 public:
  ArrayReader(const std::string& bytes, std::uint64_t offset) : bytes_(bytes), offset_(offset) {}

  /// Shapes: appends [count] values of trivial type. Errors: the bytes end before.
  template <typename T>
  Result<std::vector<T>> take(std::uint64_t count) {
    if (offset_ > bytes_.size() || count > (bytes_.size() - offset_) / sizeof(T)) {
      return internal_error(std::to_string(count) + " values from byte " + std::to_string(offset_) + " on do not fit " +
                            std::to_string(bytes_.size()) + " bytes");
    }
    std::vector<T> values(count);
    if (count > 0) std::memcpy(values.data(), bytes_.data() + offset_, count * sizeof(T));
    offset_ += count * sizeof(T);
    return values;
  }

 private:
  const std::string& bytes_;
  std::uint64_t offset_;
};

template <std::size_t N>
Result<void> check_values(const std::vector<std::array<float, N>>& values, const std::string& what, float low) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (const float value : values[i]) {
      if (std::isfinite(value) && value >= low) continue;
      return internal_error(what + " of vertex " + std::to_string(i) + " is " + std::to_string(value));
    }
  }
  return {};
}

Result<int> layer_of(const v1::BakeResult& result, std::uint32_t lightmap) {
  const std::string name = "lightmap_" + std::to_string(lightmap);
  int index = 0;
  for (const v1::Layer& layer : result.layers()) {
    if (layer.name() == name) return index;
    if (is_lightmap(layer.name())) ++index;
  }
  return internal_error("it lies in " + name + ", which is not there");
}

Result<void> read_split(const v1::MeshResult& record, const Mesh& mesh, ArrayReader& arrays, gltf::BakedMesh& baked) {
  const std::size_t num_own = mesh.positions.size();
  RADBAKE_ASSIGN_OR_RETURN(baked.source_vertices, arrays.take<std::uint32_t>(record.num_vertices()));
  RADBAKE_ASSIGN_OR_RETURN(baked.triangles, (arrays.take<std::array<std::uint32_t, 3>>(record.num_triangles())));
  const std::size_t n = baked.source_vertices.size();
  if (n < num_own) {
    return internal_error("it has " + std::to_string(n) + " vertices, fewer than the " + std::to_string(num_own) +
                          " of the scene");
  }
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t source = baked.source_vertices[i];
    if (source < num_own && (i >= num_own || source == i)) continue;
    return internal_error("vertex " + std::to_string(i) + " copies vertex " + std::to_string(source) + " of " +
                          std::to_string(num_own));
  }
  for (std::size_t i = 0; i < baked.triangles.size(); ++i) {
    for (const std::uint32_t vertex : baked.triangles[i]) {
      if (vertex < n) continue;
      return internal_error("triangle " + std::to_string(i) + " names vertex " + std::to_string(vertex) + " of " +
                            std::to_string(n));
    }
  }
  return {};
}

Result<gltf::BakedMesh> read_mesh(const v1::BakeResult& result, const v1::MeshResult& record, const Mesh& mesh,
                                  const std::string& data) {
  gltf::BakedMesh baked;
  ArrayReader arrays(data, record.data_offset());
  const bool has_data = record.is_split() || record.uv_source() == v1::UV_UNWRAPPED || record.has_irradiance();
  if (record.is_split()) {
    RADBAKE_RETURN_IF_ERROR(read_split(record, mesh, arrays, baked));
  } else if (has_data && record.num_vertices() != mesh.positions.size()) {
    return internal_error("it has " + std::to_string(record.num_vertices()) + " vertices, in the scene " +
                          std::to_string(mesh.positions.size()));
  }
  switch (record.uv_source()) {
    case v1::UV_NONE: break;
    case v1::UV_KEPT:
    case v1::UV_PLACED:
      if (mesh.texcoord1.empty()) return internal_error("it keeps its TEXCOORD_1 and has none");
      // Kept coordinates are what they are; a scale that is not set is 0.
      if (record.uv_source() == v1::UV_PLACED) {
        baked.uv_scale = {record.uv_scale().x(), record.uv_scale().y()};
        baked.uv_offset = {record.uv_offset().x(), record.uv_offset().y()};
      }
      if (!is_finite(baked.uv_scale) || !is_finite(baked.uv_offset)) {
        return internal_error("its place in the lightmap is not finite");
      }
      break;
    case v1::UV_UNWRAPPED: {
      RADBAKE_ASSIGN_OR_RETURN(baked.uvs, (arrays.take<std::array<float, 2>>(record.num_vertices())));
      RADBAKE_RETURN_IF_ERROR(check_values(baked.uvs, "TEXCOORD_1", std::numeric_limits<float>::lowest()));
      break;
    }
    default: return internal_error("its layout is of kind " + std::to_string(record.uv_source()));
  }
  if (record.uv_source() != v1::UV_NONE) {
    RADBAKE_ASSIGN_OR_RETURN(baked.lightmap, layer_of(result, record.lightmap()));
  }
  if (record.has_irradiance()) {
    RADBAKE_ASSIGN_OR_RETURN(baked.irradiance, (arrays.take<std::array<float, 3>>(record.num_vertices())));
    RADBAKE_RETURN_IF_ERROR(check_values(baked.irradiance, "irradiance", 0));
  }
  return baked;
}

}  // namespace

bool is_lightmap(const std::string& layer) {
  const std::string prefix = "lightmap_";
  return layer.starts_with(prefix) && layer.size() > prefix.size() &&
         layer.find_first_not_of("0123456789", prefix.size()) == std::string::npos;
}

Result<MeshResults> read_mesh_results(const v1::BakeResult& result, const std::string& data, const Scene& scene,
                                      const std::vector<int>& scene_meshes) {
  if (static_cast<std::size_t>(result.meshes_size()) != scene_meshes.size()) {
    return internal_error("the server sent results of " + std::to_string(result.meshes_size()) + " meshes for " +
                          std::to_string(scene_meshes.size()));
  }
  MeshResults results;
  results.meshes.resize(scene.meshes.size());
  results.uv_sources.resize(scene.meshes.size(), v1::UV_NONE);
  for (std::size_t i = 0; i < scene_meshes.size(); ++i) {
    const auto mesh = static_cast<std::size_t>(scene_meshes[i]);
    const v1::MeshResult& record = result.meshes(static_cast<int>(i));
    Result<gltf::BakedMesh> baked = read_mesh(result, record, scene.meshes[mesh], data);
    if (!baked.ok()) {
      return internal_error("the server's result of mesh '" + scene.meshes[mesh].name +
                            "' cannot be used: " + baked.error().message);
    }
    for (const auto& [r, g, b] : baked->irradiance) {
      results.max_irradiance = std::max<double>(results.max_irradiance, std::max({r, g, b}));
    }
    results.meshes[mesh] = std::move(baked).value();
    results.uv_sources[mesh] = record.uv_source();
  }
  return results;
}

}  // namespace radbake::cli
