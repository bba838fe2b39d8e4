#include "client/cli/plan_page.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "client/cli/proto_json.h"
#include "client/cli/quantities.h"

namespace radbake::cli {
namespace {

using Json = nlohmann::ordered_json;

double seconds_of(const v1::Plan& plan, const std::string& effect) {
  for (const v1::EffectSeconds& seconds : plan.prediction().effects()) {
    if (seconds.effect() == effect) return seconds.cpu_seconds();
  }
  return 0;
}

std::string percent(double share) { return compact(100 * share) + " %"; }

std::string scene_facts(const v1::Survey& survey, const std::string& scene_name) {
  std::string text = scene_name + ": " + counted(survey.num_triangles(), "triangle") + " in " +
                     counted(survey.num_meshes(), "mesh") + ", " + counted(survey.num_materials(), "material") + ", " +
                     counted(survey.num_textures(), "texture");
  if (survey.num_textures_flat() > 0) text += " (" + grouped(survey.num_textures_flat()) + " of one value in fact)";
  if (survey.num_instances() > 0) text += ", " + counted(survey.num_instances(), "instance");
  text += "\n  " + compact(survey.area_m2()) + " m2 of surface, " + compact(survey.extent_m()) + " m long, ";
  if (survey.is_closed()) {
    text += "closed and convex";
  } else if (survey.is_convex()) {
    text += "convex";
  } else if (survey.num_probe_rays() > 0) {
    text += percent(survey.escape_share()) + " +- " + percent(survey.escape_share_interval()) + " of rays escape";
  } else {
    text += "not convex";
  }
  text += "\n  reflectance " + compact(survey.min_reflectance()) + " to " + compact(survey.max_reflectance()) +
          (survey.is_grey() ? ", all grey" : ", coloured");
  text +=
      "\n  surfaces emit " + compact(survey.emitted_lumens()) + " lm, lamps " + compact(survey.lamp_lumens()) + " lm";
  std::string brightest;
  for (const std::string& mesh : survey.brightest_emitters()) brightest += (brightest.empty() ? "" : ", ") + mesh;
  if (!brightest.empty()) text += "; most from " + brightest;
  return text + "\n";
}

std::string effect_lines(const v1::Plan& plan) {
  std::string text = "\nEffects\n", absent;
  for (const char* state : {"on", "off", "unsupported"}) {
    for (const v1::EffectPlan& effect : plan.effects()) {
      if (effect.state() != state) continue;
      const double seconds = seconds_of(plan, effect.effect());
      text += "  " + padded(effect.state(), 12) + padded(effect.effect(), 22) + effect.reason();
      if (seconds > 0) text += std::string(effect.state() == "on" ? " [" : " [saves ") + duration(seconds) + "]";
      text += "\n";
    }
  }
  for (const v1::EffectPlan& effect : plan.effects()) {
    if (effect.state() == "absent") absent += (absent.empty() ? "" : ", ") + effect.effect();
  }
  return absent.empty() ? text : text + "  " + padded("absent", 12) + absent + "\n";
}

std::string line(const std::string& name, const std::string& text) { return "  " + padded(name, 18) + text + "\n"; }

std::string with_reason(const std::string& choice, const std::string& reason) {
  return reason.empty() ? choice : choice + ": " + reason;
}

std::string method_lines(const v1::Plan& plan) {
  std::string text = "\nMethods\n";
  text += line("form factors", with_reason(plan.estimator(), plan.estimator_reason()));
  text += line("kept as", with_reason(plan.transport(), plan.transport_reason()));
  text += line("solver", with_reason(plan.solver(), plan.solver_reason()));
  text += line("channels", plan.num_channels() == 1 ? "1" : std::to_string(plan.num_channels()));
  text += line("rays", grouped(plan.rays_per_row()) + " a patch, " + grouped(plan.rays_per_texel()) +
                           " a texel or vertex, " + counted(plan.light_samples_per_texel(), "sample") + " of lights");
  text += line("patches", grouped(plan.num_patches()));
  if (plan.atlas_size() > 0) {
    text +=
        line("lightmaps", std::to_string(plan.num_lightmaps()) + " of " + std::to_string(plan.atlas_size()) + " x " +
                              std::to_string(plan.atlas_height()) + ": " + counted(plan.num_texels(), "texel") + ", " +
                              compact(plan.texels_per_meter()) + " a metre");
  }
  if (plan.num_vertex_groups() > 0) text += line("vertices", grouped(plan.num_vertex_groups()));
  return text;
}

std::string prediction_line(const std::string& name, const v1::StagePrediction& stage) {
  const std::string interval = duration(stage.cpu_seconds_low()) + " to " + duration(stage.cpu_seconds_high());
  return "  " + padded(name, 18) + padded(duration(stage.cpu_seconds()), 14) + padded(interval, 30) +
         padded(duration(stage.wall_seconds()), 14) + bytes(stage.memory_bytes()) + "\n";
}

std::string prediction_lines(const v1::Prediction& prediction) {
  std::string text = "\n" + padded("Predicted", 20) + padded("CPU time", 14) + padded("95 % interval", 30) +
                     padded("wall time", 14) + "memory\n";
  for (const v1::StagePrediction& stage : prediction.stages()) {
    std::string name = stage.stage();
    std::replace(name.begin(), name.end(), '_', ' ');
    text += prediction_line(name, stage);
  }
  text += prediction_line("in all", prediction.total());
  if (prediction.source() == "pilot") {
    text += "  from a pilot of " + duration(prediction.pilot_seconds()) + "\n";
  } else if (!prediction.source().empty()) {
    text += "  from costs that earlier bakes measured here\n";
  }
  if (!prediction.costliest().empty()) text += "\nCostliest meshes\n";
  for (const v1::MeshPrediction& mesh : prediction.costliest()) {
    std::string size = counted(mesh.num_patches(), "patch");
    if (mesh.num_texels() > 0) size = counted(mesh.num_texels(), "texel") + ", " + size;
    text += "  " + padded(duration(mesh.cpu_seconds()), 12) + mesh.mesh() + " (" + size + ")\n";
  }
  return text;
}

}  // namespace

std::string plan_page(const v1::Plan& plan, const std::string& scene_name, const std::vector<Warning>& warnings) {
  std::string text = scene_facts(plan.survey(), scene_name) + effect_lines(plan) + method_lines(plan);
  if (plan.has_prediction()) text += prediction_lines(plan.prediction());
  if (!warnings.empty() || !plan.warnings().empty()) text += "\nWarnings\n";
  for (const Warning& warning : warnings) text += "  " + warning.text + "\n";
  for (const v1::Warning& warning : plan.warnings()) text += "  " + warning.text() + "\n";
  return text;
}

Json plan_json(const v1::Plan& plan, const std::vector<Warning>& warnings) {
  Json json;
  Json& effects = json["effects"] = Json::array();
  for (const v1::EffectPlan& effect : plan.effects()) {
    effects.push_back({{"effect", effect.effect()},
                       {"state", effect.state()},
                       {"reason", effect.reason()},
                       {"value", effect.value()},
                       {"seconds", seconds_of(plan, effect.effect())},
                       {"is_forced", effect.is_forced()}});
  }
  const Json rest = to_json(plan);
  for (const auto& [key, value] : rest.items()) {
    if (key == "effects") continue;
    json[key] = value;
    if (key != "warnings" || warnings.empty()) continue;
    Json all = Json::array();
    for (const Warning& warning : warnings) all.push_back({{"id", warning.id}, {"text", to_utf8(warning.text)}});
    for (const Json& warning : value) all.push_back(warning);
    json[key] = std::move(all);
  }
  return json;
}

}  // namespace radbake::cli
