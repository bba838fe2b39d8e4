#include "client/cli/results.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "client/cli/lightmaps_json.h"
#include "client/cli/mesh_results.h"
#include "client/cli/proto_json.h"
#include "client/gltf/container.h"
#include "client/gltf/limits.h"
#include "client/gltf/write_gltf.h"
#include "client/image/image_codec.h"

namespace radbake::cli {
namespace {

constexpr char kSceneName[] = "scene.glb";
constexpr char kLightmapsName[] = "lightmaps.json";
/// Layer names become file names: nothing but these characters.
constexpr char kNameCharacters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-";

/// A server's layer is not trusted: its name becomes a path, its size the bounds of a loop.
Result<void> check_layer(const v1::Layer& layer) {
  const std::string& name = layer.name();
  if (name.empty() || name.size() > 100 || name.find_first_not_of(kNameCharacters) != std::string::npos) {
    return internal_error("the server sent a layer named '" + name.substr(0, 100) + "'");
  }
  constexpr std::uint64_t kMaxSide = 1 << 16, kMaxChannels = 64;
  const std::uint64_t num_values = std::uint64_t{layer.width()} * layer.height() * layer.channels();
  if (num_values == 0 || layer.width() > kMaxSide || layer.height() > kMaxSide || layer.channels() > kMaxChannels ||
      num_values * sizeof(float) != layer.blob().size_bytes()) {
    return internal_error("the server sent layer " + name + " of " + std::to_string(layer.width()) + " x " +
                          std::to_string(layer.height()) + " x " + std::to_string(layer.channels()) + " values in " +
                          std::to_string(layer.blob().size_bytes()) + " bytes");
  }
  return {};
}

/// Whatever is wrong with a result, it is not the scene.
Error of_the_result(Error error) {
  if (error.code != ErrorCode::kUnavailable && error.code != ErrorCode::kCancelled) error.code = ErrorCode::kInternal;
  return error;
}

Result<std::vector<float>> download_layer(api::Client& client, const v1::Layer& layer, std::stop_token stop) {
  RADBAKE_RETURN_IF_ERROR(check_layer(layer));
  const Result<std::string> bytes = client.download({layer.blob().sha256(), layer.blob().size_bytes()}, stop);
  if (!bytes.ok()) return of_the_result(bytes.error());
  std::vector<float> values(bytes->size() / sizeof(float));
  std::memcpy(values.data(), bytes->data(), bytes->size());
  return values;
}

/// The light by vertex and the new layouts; empty where the bake has none.
Result<std::string> download_mesh_data(api::Client& client, const v1::BakeResult& result, std::stop_token stop) {
  if (!result.has_mesh_data()) return std::string();
  Result<std::string> bytes = client.download({result.mesh_data().sha256(), result.mesh_data().size_bytes()}, stop);
  return bytes.ok() ? std::move(bytes) : Result<std::string>(of_the_result(bytes.error()));
}

/// A lightmap in memory.
struct Plane {
  LightmapFiles files;
  std::vector<float> values;

  int width() const { return static_cast<int>(files.layer.width()); }
  int height() const { return static_cast<int>(files.layer.height()); }
  int channels() const { return static_cast<int>(files.layer.channels()); }
};

Result<Plane> download_plane(api::Client& client, const v1::Layer& layer, std::stop_token stop) {
  Plane plane;
  plane.files.layer = layer;
  RADBAKE_ASSIGN_OR_RETURN(plane.values, download_layer(client, layer, stop));
  float highest = 0;
  const std::size_t channels = layer.channels();
  for (std::size_t at = 0; at < plane.values.size(); at += channels) {
    for (std::size_t c = 0; c < std::min<std::size_t>(channels, 3); ++c) {
      if (std::isfinite(plane.values[at + c])) highest = std::max(highest, plane.values[at + c]);
    }
  }
  plane.files.max_irradiance = highest;
  plane.files.intensity = highest > 0 ? highest : 1;  // a dark map is dark in any unit
  return plane;
}

/// Writes files into the folder that is built, and remembers their names.
class ResultWriter {
 public:
  ResultWriter(const std::filesystem::path& folder, const FileChoices& choices) : folder_(folder), choices_(choices) {}

  Result<void> write_images(const image::ImageCodec& images, const Plane& plane) {
    const int width = plane.width(), height = plane.height(), channels = plane.channels();
    const std::string& layer = plane.files.layer.name();
    for (const Encoding encoding : encodings_of(plane.files.layer, choices_)) {
      const std::filesystem::path path = add(image_name(layer, encoding));
      const auto write = [&]() -> Result<void> {
        switch (encoding) {
          case Encoding::kExr:
            return images.write_exr(path, width, height, channels, plane.values, plane.files.layer.unit());
          case Encoding::kHdr: return images.write_hdr(path, width, height, channels, plane.values);
          case Encoding::kRgbmPng:
            return images.write_rgbm_png(path, width, height, channels, plane.values, plane.files.intensity);
        }
        return {};
      };
      RADBAKE_RETURN_IF_ERROR(write());
    }
    if (is_error_map(plane.files.layer)) return {};  // a picture of it would say nothing
    return images.write_preview_png(add(layer + ".png"), width, height, channels, plane.values);
  }

  /// The lightmaps of all light go into the scene; other layers are only named beside them.
  Result<void> write_scene(const image::ImageCodec* images, const std::vector<Plane>& planes, const BakedScene& scene,
                           const MeshResults& meshes) {
    // Hours may have passed since the scene was read.
    const Result<std::string> bytes = gltf::read_file(scene.path, gltf::kMaxFileBytes);
    if (!bytes.ok() || digest_of(*bytes) != scene.digest) {
      return internal_error("cannot write " + (folder_ / kSceneName).string() + ": " + scene.path.string() +
                            " has changed since it was read");
    }
    std::vector<gltf::LightmapImage> attached;
    std::vector<LightmapFiles> lightmaps;
    std::vector<LightmapFiles> extra_layers;
    for (const Plane& plane : planes) {
      if (!is_lightmap(plane.files.layer.name())) {
        extra_layers.push_back(plane.files);
        continue;
      }
      RADBAKE_ASSIGN_OR_RETURN(std::string png,
                               images->encode_linear_png(plane.width(), plane.height(), plane.channels(), plane.values,
                                                         plane.files.intensity));
      attached.push_back({plane.files.layer.name(), std::move(png), plane.files.intensity});
      lightmaps.push_back(plane.files);
    }
    gltf::WriteOptions options;
    options.vertex_colors = choices_.vertex_colors;
    RADBAKE_RETURN_IF_ERROR(
        gltf::write_gltf(add(kSceneName), scene.path, scene.scene, meshes.meshes, attached, options));
    RADBAKE_ASSIGN_OR_RETURN(const std::vector<std::string> node_names, gltf::read_node_names(scene.path));
    return write_json(kLightmapsName,
                      make_lightmaps_json(lightmaps, extra_layers, choices_, scene.scene, node_names, meshes));
  }

  Result<void> write_json(const char* name, const nlohmann::ordered_json& json) {
    const std::filesystem::path path = add(name);
    std::ofstream file(path, std::ios::binary);
    file << to_text(json);
    file.close();
    return file ? Result<void>() : internal_error("cannot write " + path.string());
  }

  const std::vector<std::string>& names() const { return names_; }

 private:
  std::filesystem::path add(const std::string& name) {
    names_.push_back(name);
    return folder_ / name;
  }

  std::filesystem::path folder_;
  const FileChoices& choices_;
  std::vector<std::string> names_;
};

}  // namespace

Result<void> write_results(api::Client& client, const ResultRequest& request, ResultFolder& folder, Stopwatch& stages,
                           Reporter& reporter, std::stop_token stop) {
  const v1::BakeResult& result = request.bake.result();
  reporter.stage("downloading", -1);
  std::vector<Plane> planes;
  for (const v1::Layer& layer : result.layers()) {
    RADBAKE_ASSIGN_OR_RETURN(planes.emplace_back(), download_plane(client, layer, stop));
  }
  std::optional<MeshResults> meshes;
  if (request.scene && result.meshes_size() > 0) {
    RADBAKE_ASSIGN_OR_RETURN(const std::string data, download_mesh_data(client, result, stop));
    RADBAKE_ASSIGN_OR_RETURN(meshes,
                             read_mesh_results(result, data, request.scene->scene.scene, request.scene->scene_meshes));
  } else if (request.scene) {
    reporter.note("the server does not say where meshes lie in the lightmap: no scene.glb");
  }
  stages.end_stage("download");

  reporter.stage("writing", -1);
  const image::ImageCodec* images = nullptr;
  if (!planes.empty()) {
    RADBAKE_ASSIGN_OR_RETURN(images, image::load_image_codec());
  }
  ResultWriter writer(folder.building(), request.files);
  std::vector<LayerFiles> layers;
  for (const Plane& plane : planes) {
    RADBAKE_RETURN_IF_ERROR(writer.write_images(*images, plane));
    const std::string& name = plane.files.layer.name();
    layers.push_back({plane.files.layer, image_name(name, encodings_of(plane.files.layer, request.files).front()),
                      is_error_map(plane.files.layer) ? "" : name + ".png"});
  }
  if (meshes) RADBAKE_RETURN_IF_ERROR(writer.write_scene(images, planes, *request.scene, *meshes));
  stages.end_stage("write");

  RADBAKE_RETURN_IF_ERROR(
      writer.write_json(kReportName, make_report(request.bake, layers, request.report, stages.stages())));
  RADBAKE_RETURN_IF_ERROR(folder.publish());
  reporter.written(request.bake.name(), folder.folder(), writer.names());
  return {};
}

}  // namespace radbake::cli
