#include "server/settings/to_options.h"

#include <cmath>
#include <optional>
#include <set>
#include <string>

namespace radbake::settings {
namespace {

radiosity::LightmapUv to_lightmap_uv(v1::LightmapUv uv) {
  if (uv == v1::LIGHTMAP_UV_KEEP) return radiosity::LightmapUv::kKeep;
  return uv == v1::LIGHTMAP_UV_UNWRAP ? radiosity::LightmapUv::kUnwrap : radiosity::LightmapUv::kAuto;
}

radiosity::Output to_output(v1::Output output) {
  if (output == v1::OUTPUT_VERTICES) return radiosity::Output::kVertices;
  return output == v1::OUTPUT_BOTH ? radiosity::Output::kBoth : radiosity::Output::kLightmap;
}

radiosity::FormFactors to_form_factors(v1::FormFactors method) {
  switch (method) {
    case v1::FORM_FACTORS_ANALYTIC: return radiosity::FormFactors::kAnalytic;
    case v1::FORM_FACTORS_HEMICUBE: return radiosity::FormFactors::kHemicube;
    case v1::FORM_FACTORS_HEMISPHERE: return radiosity::FormFactors::kHemisphere;
    case v1::FORM_FACTORS_ADAPTIVE: return radiosity::FormFactors::kAdaptive;
    default: return radiosity::FormFactors::kAuto;
  }
}

radiosity::Transport to_transport(v1::Transport transport) {
  switch (transport) {
    case v1::TRANSPORT_DENSE: return radiosity::Transport::kDense;
    case v1::TRANSPORT_SPARSE: return radiosity::Transport::kSparse;
    case v1::TRANSPORT_STREAMED: return radiosity::Transport::kStreamed;
    default: return radiosity::Transport::kAuto;
  }
}

std::optional<radiosity::Solver> to_solver(v1::Solver solver) {
  switch (solver) {
    case v1::SOLVER_LU: return radiosity::Solver::kLu;
    case v1::SOLVER_JACOBI: return radiosity::Solver::kJacobi;
    case v1::SOLVER_GAUSS_SEIDEL: return radiosity::Solver::kGaussSeidel;
    case v1::SOLVER_SOUTHWELL: return radiosity::Solver::kSouthwell;
    case v1::SOLVER_SHOOTING: return radiosity::Solver::kShooting;
    case v1::SOLVER_KRYLOV: return radiosity::Solver::kKrylov;
    default: return std::nullopt;
  }
}

}  // namespace

radiosity::BakeOptions to_options(const v1::BakeSettings& settings, const v1::RunOptions& run) {
  radiosity::BakeOptions options;
  options.atlas_size = static_cast<int>(settings.atlas_size());
  options.texels_per_meter = settings.texels_per_meter();
  options.rays = static_cast<int>(settings.rays());
  options.max_patches = static_cast<int>(settings.max_patches());
  options.seed = settings.seed();
  options.lightmap_uv = to_lightmap_uv(settings.lightmap_uv());
  options.output = to_output(settings.output());
  options.form_factors = to_form_factors(settings.form_factors());
  options.transport = to_transport(settings.transport());
  options.solver = to_solver(settings.solver());
  options.transport_memory = settings.transport_memory_bytes();
  for (const v1::EffectOverride& change : settings.effects()) {
    const auto effect = radiosity::effect_by_name(change.effect());
    if (effect && change.choice() == v1::EFFECT_CHOICE_ON) options.effects[*effect] = true;
    if (effect && change.choice() == v1::EFFECT_CHOICE_OFF) options.effects[*effect] = false;
  }
  for (const int layer : settings.layers()) {
    options.wants_direct |= layer == v1::EXTRA_LAYER_DIRECT;
    options.wants_indirect |= layer == v1::EXTRA_LAYER_INDIRECT;
    options.wants_ao |= layer == v1::EXTRA_LAYER_AO;
  }
  options.ao_distance = settings.ao_distance();
  options.max_error = settings.max_error();
  options.time_budget_seconds = 1e-3 * static_cast<double>(settings.time_budget_ms());
  options.threads = static_cast<int>(run.threads());
  return options;
}

radiosity::HostCosts to_costs(const v1::HostCosts& costs) {
  return {costs.row_ray(),  costs.texel_ray(),  costs.light_ray(), costs.row(),
          costs.receiver(), costs.entry_step(), costs.entry()};
}

std::optional<FieldProblem> find_effect_problem(const v1::BakeSettings& settings) {
  constexpr double kMaxDistance = 1e6;
  std::set<std::string> names;
  for (const v1::EffectOverride& change : settings.effects()) {
    const std::string shown = "'" + change.effect().substr(0, 40) + "'";
    if (!radiosity::effect_by_name(change.effect())) {
      std::string all;
      for (const std::string_view name : radiosity::kEffectNames) all += (all.empty() ? "" : " ") + std::string(name);
      return FieldProblem{"settings.effects", shown + " is not an effect; there are " + all};
    }
    if (!names.insert(change.effect()).second) {
      return FieldProblem{"settings.effects", shown + " is chosen more than once"};
    }
    if (!v1::EffectChoice_IsValid(change.choice())) {
      return FieldProblem{"settings.effects",
                          shown + ": " + std::to_string(change.choice()) + " is not an EffectChoice"};
    }
  }
  for (const int layer : settings.layers()) {
    if (!v1::ExtraLayer_IsValid(layer) || layer == v1::EXTRA_LAYER_UNSPECIFIED) {
      return FieldProblem{"settings.layers", std::to_string(layer) + " is not an ExtraLayer"};
    }
  }
  if (!(settings.ao_distance() >= 0 && settings.ao_distance() <= kMaxDistance)) {
    return FieldProblem{"settings.ao_distance",
                        std::to_string(settings.ao_distance()) + " is not between 0 and 1000000"};
  }
  return std::nullopt;
}

std::optional<FieldProblem> find_target_problem(const v1::BakeSettings& settings) {
  const double error = settings.max_error();
  const std::uint64_t budget = settings.time_budget_ms();
  if (!(error >= 0 && error < 1)) {
    return FieldProblem{"settings.max_error", std::to_string(error) + " is not at least 0 and below 1"};
  }
  if (budget > kMaxTimeBudgetMs) {
    return FieldProblem{"settings.time_budget_ms",
                        std::to_string(budget) + " is above " + std::to_string(kMaxTimeBudgetMs) + ", 30 days"};
  }
  if (settings.rays() > 0 && (error > 0 || budget > 0)) {
    const std::string asked =
        error > 0 ? "max_error " + std::to_string(error) : "time_budget_ms " + std::to_string(budget);
    return FieldProblem{error > 0 ? "settings.max_error" : "settings.time_budget_ms",
                        asked + " chooses the rays by itself: not with rays " + std::to_string(settings.rays())};
  }
  return std::nullopt;
}

std::optional<FieldProblem> find_size_problem(const v1::BakeSettings& settings) {
  const auto below = [](std::string field, const std::string& value, const std::string& least) {
    return FieldProblem{std::move(field), value + " is below " + least + "; 0: chosen for the scene"};
  };
  if (settings.rays() > 0 && settings.rays() < radiosity::kMinRays) {
    return below("settings.rays", std::to_string(settings.rays()), std::to_string(radiosity::kMinRays));
  }
  if (settings.max_patches() > 0 && settings.max_patches() < radiosity::kMinMaxPatches) {
    return below("settings.max_patches", std::to_string(settings.max_patches()),
                 std::to_string(radiosity::kMinMaxPatches));
  }
  if (settings.texels_per_meter() > 0 && settings.texels_per_meter() < radiosity::kMinTexelsPerMeter) {
    return below("settings.texels_per_meter", "the value", "0.000001");
  }
  if (settings.output() == v1::OUTPUT_VERTICES && settings.layers_size() > 0) {
    return FieldProblem{"settings.layers", "layers are lightmaps, and with output OUTPUT_VERTICES there are none"};
  }
  return std::nullopt;
}

}  // namespace radbake::settings
