#include "client/cli/lightmaps_json.h"

#include <nlohmann/json.hpp>

#include "client/cli/proto_json.h"
#include "common/base/version.h"

namespace radbake::cli {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kColourSpace[] = "linear Rec.709";

/// How the numbers of a file become lx.
Json describe(const std::string& layer, Encoding encoding, double intensity) {
  Json file = {{"file", image_name(layer, encoding)}};
  switch (encoding) {
    case Encoding::kExr: file.update({{"encoding", "exr"}, {"bits", "float32"}}); break;
    case Encoding::kHdr: file.update({{"encoding", "hdr"}, {"bits", "rgbe8"}}); break;
    case Encoding::kRgbmPng:
      file.update({{"encoding", "png-rgbm"}, {"bits", "uint8"}, {"multiplier", intensity}});
      break;
  }
  file["colour_space"] = kColourSpace;
  return file;
}

/// What the numbers of a layer are, and where they stand.
Json describe_layer(const LightmapFiles& lightmap, const FileChoices& files) {
  Json json = {{"quantity", lightmap.layer.quantity()},
               {"unit", lightmap.layer.unit()},
               {"maximum", lightmap.max_irradiance},
               {"files", Json::array()}};
  for (const Encoding encoding : encodings_of(lightmap.layer, files)) {
    json["files"].push_back(describe(lightmap.layer.name(), encoding, lightmap.intensity));
  }
  return json;
}

const char* name_of(v1::UvSource source) {
  switch (source) {
    case v1::UV_KEPT: return "kept";
    case v1::UV_PLACED: return "placed";
    default: return "unwrapped";
  }
}

Json describe_mesh(const gltf::GltfScene& scene, const MeshResults& results, std::size_t i,
                   const std::vector<std::string>& node_names, const std::vector<LightmapFiles>& lightmaps,
                   const FileChoices& files) {
  const gltf::MeshSource& source = scene.sources[i];
  const gltf::BakedMesh& baked = results.meshes[i];
  const auto node = static_cast<std::size_t>(source.node);
  Json mesh = {{"node", source.node},
               {"node_name", node < node_names.size() ? to_utf8(node_names[node]) : ""},
               {"mesh", source.mesh},
               {"primitive", source.primitive}};
  if (baked.lightmap >= 0) {
    const v1::Layer& layer = lightmaps[static_cast<std::size_t>(baked.lightmap)].layer;
    mesh["lightmap"] = baked.lightmap;
    mesh["file"] = image_name(layer.name(), files.encodings.front());
    mesh["scale"] = {baked.uv_scale.x, baked.uv_scale.y};
    mesh["offset"] = {baked.uv_offset.x, baked.uv_offset.y};
    mesh["uv_set"] = 1;
    mesh["uv_source"] = name_of(results.uv_sources[i]);
  }
  mesh["has_vertex_light"] = !baked.irradiance.empty();
  return mesh;
}

/// lightmap_0_direct and error_0 are laid out as lightmap_0.
bool shares_layout(const v1::Layer& layer, const v1::Layer& lightmap) {
  constexpr std::string_view kLightmap = "lightmap_";
  return layer.name().starts_with(lightmap.name() + "_") ||
         (is_error_map(layer) && layer.name() == "error_" + lightmap.name().substr(kLightmap.size()));
}

}  // namespace

bool is_error_map(const v1::Layer& layer) { return layer.quantity() == "standard_error"; }

std::vector<Encoding> encodings_of(const v1::Layer& layer, const FileChoices& files) {
  return is_error_map(layer) ? std::vector{Encoding::kExr} : files.encodings;
}

std::string image_name(const std::string& layer, Encoding encoding) {
  switch (encoding) {
    case Encoding::kExr: return layer + ".exr";
    case Encoding::kHdr: return layer + ".hdr";
    case Encoding::kRgbmPng: return layer + "_rgbm.png";
  }
  return {};
}

Json make_lightmaps_json(const std::vector<LightmapFiles>& lightmaps, const std::vector<LightmapFiles>& extra_layers,
                         const FileChoices& files, const gltf::GltfScene& scene,
                         const std::vector<std::string>& node_names, const MeshResults& results) {
  Json json = {{"version", 1}, {"generator", std::string("radbake ") + kEngineVersion}, {"scene", "scene.glb"}};
  json["uv_origin"] = "top left";
  Json& maps = json["lightmaps"] = Json::array();
  for (const LightmapFiles& lightmap : lightmaps) {
    Json map = {
        {"name", lightmap.layer.name()}, {"width", lightmap.layer.width()}, {"height", lightmap.layer.height()}};
    map.update(describe_layer(lightmap, files));
    map["moz_lightmap"] = {
        {"encoding", "png"}, {"bits", "uint16"}, {"intensity", lightmap.intensity}, {"colour_space", kColourSpace}};
    // Parts of the same light, openness, or errors, in the same layout.
    for (const LightmapFiles& extra : extra_layers) {
      const std::string& name = extra.layer.name();
      if (!shares_layout(extra.layer, lightmap.layer)) continue;
      Json layer = {{"name", name}};
      layer.update(describe_layer(extra, files));
      map["layers"].push_back(std::move(layer));
    }
    maps.push_back(std::move(map));
  }
  bool has_vertex_light = false;
  Json& meshes = json["meshes"] = Json::array();
  for (std::size_t i = 0; i < results.meshes.size(); ++i) {
    const gltf::BakedMesh& baked = results.meshes[i];
    if (baked.lightmap < 0 && baked.irradiance.empty()) continue;
    has_vertex_light = has_vertex_light || !baked.irradiance.empty();
    meshes.push_back(describe_mesh(scene, results, i, node_names, lightmaps, files));
  }
  if (has_vertex_light) {
    Json& vertices = json["vertices"] = {{"attribute", "_IRRADIANCE"},
                                         {"quantity", "irradiance"},
                                         {"unit", "lx"},
                                         {"colour_space", kColourSpace},
                                         {"maximum", results.max_irradiance}};
    if (files.vertex_colors) vertices["color_attribute"] = "COLOR_0";
  }
  return json;
}

}  // namespace radbake::cli
