#include "client/cli/results.h"

#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>

#include "client/cli/proto_json.h"
#include "client/image/image_codec.h"

namespace radbake::cli {
namespace {

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

Result<std::vector<float>> download_layer(api::Client& client, const v1::Layer& layer, std::stop_token stop) {
  RADBAKE_RETURN_IF_ERROR(check_layer(layer));
  Result<std::string> bytes = client.download({layer.blob().sha256(), layer.blob().size_bytes()}, stop);
  if (!bytes.ok()) {
    Error error = bytes.error();
    // Whatever is wrong with a result, it is not the scene.
    if (error.code != ErrorCode::kUnavailable && error.code != ErrorCode::kCancelled) error.code = ErrorCode::kInternal;
    return error;
  }
  std::vector<float> values(bytes->size() / sizeof(float));
  std::memcpy(values.data(), bytes->data(), bytes->size());
  return values;
}

}  // namespace

Result<void> write_results(api::Client& client, const v1::Bake& bake, const std::optional<SceneReport>& scene,
                           ResultFolder& folder, Stopwatch& stages, Reporter& reporter, std::stop_token stop) {
  RADBAKE_ASSIGN_OR_RETURN(const image::ImageCodec* images, image::load_image_codec());
  reporter.stage("downloading", -1);
  std::vector<LayerFiles> layers;
  std::vector<std::vector<float>> values;
  for (const v1::Layer& layer : bake.result().layers()) {
    RADBAKE_ASSIGN_OR_RETURN(values.emplace_back(), download_layer(client, layer, stop));
    layers.push_back({layer, layer.name() + ".exr", layer.name() + ".png"});
  }
  stages.end_stage("download");

  reporter.stage("writing images", -1);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const v1::Layer& layer = layers[i].layer;
    const int width = layer.width(), height = layer.height(), channels = layer.channels();
    RADBAKE_RETURN_IF_ERROR(images->write_exr(folder.building() / layers[i].image, width, height, channels, values[i]));
    RADBAKE_RETURN_IF_ERROR(
        images->write_preview_png(folder.building() / layers[i].preview, width, height, channels, values[i]));
    names.insert(names.end(), {layers[i].image, layers[i].preview});
  }
  stages.end_stage("write");

  std::ofstream report(folder.building() / kReportName, std::ios::binary);
  report << to_text(make_report(bake, layers, scene, stages.stages()));
  report.close();
  if (!report) return internal_error("cannot write " + (folder.building() / kReportName).string());
  names.push_back(kReportName);
  RADBAKE_RETURN_IF_ERROR(folder.publish());
  reporter.written(bake.name(), folder.folder(), names);
  return {};
}

}  // namespace radbake::cli
