#include "client/cli/report.h"

#include <nlohmann/json.hpp>

#include "client/cli/predictions.h"
#include "client/cli/proto_json.h"
#include "client/cli/reached_error.h"

namespace radbake::cli {

using Json = nlohmann::ordered_json;

Json make_report(const v1::Bake& bake, const std::vector<LayerFiles>& layers, const std::optional<SceneReport>& scene,
                 const std::vector<v1::StageSeconds>& client_stages) {
  const Json server = to_json(bake.result().report());
  Json report;
  report["engine_version"] = server["engine_version"];
  report["instruction_set"] = server["instruction_set"];

  // What was baked, and what came out.
  Json& source = report["scene"] = {{"name", to_utf8(bake.label())}};
  if (scene) {
    source["num_triangles_dropped"] = scene->num_triangles_dropped;
    source["mesh_transfer"] = to_json(scene->mesh_transfer);
  }
  Json& outputs = report["layers"] = Json::array();
  for (const LayerFiles& files : layers) {
    Json layer = to_json(files.layer);
    layer["image"] = files.image;
    if (!files.preview.empty()) layer["preview"] = files.preview;
    outputs.push_back(std::move(layer));
  }

  // The warnings of all who looked at the scene are one list.
  Json warnings = Json::array();
  if (scene) {
    for (const Warning& warning : scene->warnings) {
      warnings.push_back({{"id", warning.id}, {"text", to_utf8(warning.text)}});
    }
  }
  if (server.contains("warnings")) {
    for (const Json& warning : server["warnings"]) warnings.push_back(warning);
  }

  for (const auto& [key, value] : server.items()) {
    if (key != "run" && key != "warnings" && !report.contains(key)) report[key] = value;
  }
  if (bake.result().report().has_error()) report["error"] = error_json(bake.result().report().error());
  report["warnings"] = std::move(warnings);

  Json run = server.contains("run") ? server["run"] : Json::object();
  if (bake.result().report().run().has_prediction()) {
    run["predicted_and_actual"] = prediction_table(bake.result().report().run());
  }
  run["job"] = bake.name();
  run["attempt"] = bake.attempt();
  Json& client = run["client"] = {{"stages", Json::array()}};
  for (const v1::StageSeconds& stage : client_stages) client["stages"].push_back(to_json(stage));
  report["run"] = std::move(run);
  return report;
}

}  // namespace radbake::cli
