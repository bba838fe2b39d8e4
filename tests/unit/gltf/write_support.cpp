#include "tests/unit/gltf/write_support.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "client/gltf/container.h"

namespace radbake::gltf {
namespace {

using nlohmann::ordered_json;

template <typename T>
std::vector<T> values_of(const std::string& bytes) {
  std::vector<T> values(bytes.size() / sizeof(T));
  std::memcpy(values.data(), bytes.data(), values.size() * sizeof(T));
  return values;
}

}  // namespace

const ordered_json& Written::primitive(std::size_t mesh, std::size_t index) const {
  return document.at("meshes").at(mesh).at("primitives").at(index);
}

std::string Written::view(const ordered_json& accessor) const {
  const ordered_json& view =
      document.at("bufferViews")
          .at(document.at("accessors").at(accessor.get<std::size_t>()).at("bufferView").get<std::size_t>());
  return bin.substr(view.value("byteOffset", std::size_t{0}), view.at("byteLength"));
}

std::vector<float> Written::floats(const ordered_json& accessor) const { return values_of<float>(view(accessor)); }

std::vector<std::uint32_t> Written::indices(const ordered_json& accessor) const {
  if (document.at("accessors").at(accessor.get<std::size_t>()).at("componentType") == 5125) {
    return values_of<std::uint32_t>(view(accessor));
  }
  const std::vector<std::uint16_t> narrow = values_of<std::uint16_t>(view(accessor));
  return {narrow.begin(), narrow.end()};
}

Written write_baked(const std::string& bytes, const Bake& bake, const WriteOptions& options, const std::string& name,
                    const std::vector<std::pair<std::string, std::string>>& beside) {
  const TemporaryFolder folder;
  for (const auto& [other, content] : beside) folder.write(other, content);
  const std::filesystem::path source = folder.write(name, bytes);
  Written written;
  Result<GltfScene> before = read_gltf(source, decode_text_image, {});
  if (!before.ok()) {
    ADD_FAILURE() << before.error().message;
    return written;
  }
  written.before = std::move(before).value();
  written.baked.resize(written.before.scene.meshes.size());
  bake(written.before.scene, written.baked);
  std::vector<LightmapImage> lightmaps;
  for (const BakedMesh& mesh : written.baked) {
    while (static_cast<int>(lightmaps.size()) <= mesh.lightmap) {
      const std::string label = "lightmap_" + std::to_string(lightmaps.size());
      lightmaps.push_back({label, "\x89PNG of " + label, 10.0 + static_cast<double>(lightmaps.size())});
    }
  }
  // Elsewhere: what is written needs no file beside it.
  const TemporaryFolder target;
  const std::filesystem::path path = target.path() / "scene.glb";
  written.result = write_gltf(path, source, written.before, written.baked, lightmaps, options);
  if (!written.result.ok()) return written;
  const Result<Container> container = read_container(path);
  Result<GltfScene> after = read_gltf(path, decode_text_image, {});
  if (!container.ok() || !after.ok()) {
    ADD_FAILURE() << (container.ok() ? after.error().message : container.error().message);
    return written;
  }
  written.document = ordered_json::parse(container->json);
  written.bin = container->bin;
  written.after = std::move(after).value();
  return written;
}

BakedMesh taken_apart(const Mesh& mesh) {
  BakedMesh baked;
  baked.lightmap = 0;
  for (std::uint32_t i = 0; i < mesh.positions.size(); ++i) baked.source_vertices.push_back(i);
  std::set<std::uint32_t> used;
  for (const auto& triangle : mesh.triangles) {
    auto& out = baked.triangles.emplace_back(triangle);
    for (std::uint32_t& vertex : out) {
      if (used.insert(vertex).second) continue;
      baked.source_vertices.push_back(vertex);
      vertex = static_cast<std::uint32_t>(baked.source_vertices.size() - 1);
    }
    std::rotate(out.begin(), out.begin() + 1, out.end());  // from any corner
  }
  std::reverse(baked.triangles.begin(), baked.triangles.end());  // in any order
  for (std::size_t i = 0; i < baked.source_vertices.size(); ++i) {
    const float f = static_cast<float>(i);
    baked.uvs.push_back({f / 64, 1 - f / 64});
    baked.irradiance.push_back({f, 2 * f, 3 * f});
  }
  return baked;
}

std::vector<std::array<double, 5>> corners_of(const Mesh& mesh) {
  std::vector<std::array<double, 5>> corners;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t vertex : triangle) {
      const Vec3 p = mesh.positions[vertex];
      const Vec2 uv = mesh.texcoord1.empty() ? Vec2{-1, -1} : mesh.texcoord1[vertex];
      corners.push_back({p.x, p.y, p.z, uv.x, uv.y});
    }
  }
  return corners;
}

std::vector<std::array<double, 5>> corners_of(const Mesh& mesh, const BakedMesh& baked) {
  std::vector<std::array<double, 5>> corners;
  // As taken_apart() turned them.
  for (auto it = baked.triangles.rbegin(); it != baked.triangles.rend(); ++it) {
    for (const std::size_t corner : {2, 0, 1}) {
      const Vec3 p = mesh.positions[baked.source_vertices[(*it)[corner]]];
      const auto uv = baked.uvs[(*it)[corner]];
      corners.push_back({p.x, p.y, p.z, uv[0], uv[1]});
    }
  }
  return corners;
}

GltfBuilder strip() {
  GltfBuilder file;
  const int positions = file.add_floats({0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0}, "VEC3");
  const int indices = file.add_indices({0, 1, 2, 3, 4});
  const int mesh = file.add_mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}, {"mode", 5}});
  file.add_root({{"mesh", mesh}});
  return file;
}

}  // namespace radbake::gltf
