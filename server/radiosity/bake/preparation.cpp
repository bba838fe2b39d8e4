#include "server/radiosity/bake/preparation.h"

#include <algorithm>
#include <sstream>

#include "server/radiosity/bake/bake.h"
#include "server/radiosity/bake/cpu_clock.h"
#include "server/radiosity/bake/on_threads.h"
#include "server/radiosity/bake/pilot.h"
#include "server/radiosity/form_factor/patch_rows.h"
#include "server/radiosity/gather/receive.h"
#include "server/radiosity/survey/probe.h"
#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

/// Decides which effects are simulated, and leaves out of surfaces and options what the others would do.
Result<void> choose_effects(Preparation& prepared) {
  BakeOptions& options = prepared.options;
  const AskedOutputs asked{options.output != Output::kVertices, options.output != Output::kLightmap,
                           options.wants_direct || options.wants_indirect, options.wants_ao};
  BakePlan& plan = prepared.plan;
  RADBAKE_ASSIGN_OR_RETURN(plan.effects, plan_effects(prepared.surveyed.survey, asked, options.effects));
  const EffectSet effects = effects_on(plan.effects);
  if (!effects.has(Effect::kVertices)) options.output = Output::kLightmap;
  if (!effects.has(Effect::kLayers)) options.wants_direct = options.wants_indirect = false;
  if (!effects.has(Effect::kAmbientOcclusion)) options.wants_ao = false;
  plan.num_channels = effects.has(Effect::kColor) ? 3 : 1;
  if (!(effects == prepared.surveyed.surfaces.effects)) prepared.surveyed.surfaces.simulate(effects);
  if (!has_light(effects)) {
    plan.warnings.push_back({"no_light_arrives", "no light arrives at any surface: the lightmaps are black"});
  }
  return {};
}

/// Adds to the plan of skies how much of the scene sees them: known when rays have probed it.
void tell_escape_share(const Survey& survey, std::vector<EffectPlan>& effects) {
  std::ostringstream text;
  text.precision(3);
  text << ": " << 100 * survey.escape_share << " % of rays from surfaces escape to it";
  for (EffectPlan& plan : effects) {
    if ((plan.effect != Effect::kSky && plan.effect != Effect::kHdri) || plan.state != EffectState::kOn) continue;
    plan.reason += text.str();
    plan.value = survey.escape_share;
  }
}

double wanted_density(const BakeOptions& options) {
  return options.texels_per_meter > 0 ? options.texels_per_meter : kDefaultTexelsPerMeter;
}

/// Where texels and vertices lie. Returns the layout's warnings.
Result<std::vector<Warning>> lay_out(Preparation& prepared) {
  const Surfaces& surfaces = prepared.surveyed.surfaces;
  const BakeOptions& options = prepared.options;
  std::vector<Warning> warnings;
  if (options.output != Output::kVertices) {
    const LayoutOptions wanted{options.lightmap_uv, options.atlas_size, wanted_density(options),
                               options.texels_per_meter == 0};
    RADBAKE_ASSIGN_OR_RETURN(Layout layout, make_layout(surfaces, wanted));
    warnings = std::move(layout.warnings);
    RADBAKE_ASSIGN_OR_RETURN(prepared.atlas, Atlas::make(surfaces, std::move(layout)));
  }
  if (options.output != Output::kLightmap) prepared.groups = group_vertices(surfaces);
  return warnings;
}

}  // namespace

Result<std::unique_ptr<Preparation>> prepare_scene(const Scene& scene, const BakeOptions& asked, std::stop_token stop) {
  const Error cancelled{ErrorCode::kCancelled, "the bake was cancelled while it was prepared"};
  RADBAKE_RETURN_IF_ERROR(check_options(asked));
  auto prepared = std::make_unique<Preparation>();
  prepared->options = asked;
  const BakeOptions& options = prepared->options;
  RADBAKE_ASSIGN_OR_RETURN(prepared->surveyed, survey_scene(scene));
  RADBAKE_RETURN_IF_ERROR(choose_effects(*prepared));
  const Surfaces& surfaces = prepared->surveyed.surfaces;
  if (stop.stop_requested()) return cancelled;

  // The tree needs nothing of the layout: they are made side by side.
  for (std::uint32_t t = 0; t < surfaces.size() && !prepared->opacity; ++t) {
    if (surfaces.is_see_through(t)) prepared->opacity = std::make_unique<SurfaceOpacity>(surfaces);
  }
  Result<std::vector<Warning>> layout_warnings = std::vector<Warning>();
  for_each_range(2, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t part = begin; part < end; ++part) {
      if (part == 0) layout_warnings = lay_out(*prepared);
      if (part == 1) prepared->visibility = make_embree_visibility(surfaces.corners, stop, prepared->opacity.get());
    }
  });
  if (!layout_warnings.ok()) return layout_warnings.error();
  if (!prepared->visibility || stop.stop_requested()) return cancelled;

  double area = 0;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    // As the file says, so that patches are the same where backs are not simulated.
    area += surfaces.areas[t] * (scene.materials[surfaces.mesh(t).material].is_double_sided ? 2 : 1);
  }
  const auto max_patches = static_cast<std::size_t>(max_patches_of(options));
  const double reached_density = prepared->atlas ? prepared->atlas->texels_per_meter() : wanted_density(options);
  const double texel_edge = 1 / (reached_density * surfaces.metres_per_unit);
  if (!surfaces.effects.has(Effect::kOcclusion)) prepared->unblocked = make_unblocked(*prepared->visibility);
  probe_escape(surfaces, *prepared->visibility, prepared->surveyed.survey);
  prepared->patch_edge = patch_edge(texel_edge, area, max_patches);
  prepared->patches = make_patches(surfaces, *prepared->visibility, {prepared->patch_edge, max_patches, stop});
  prepared->reached_backs = find_reached_backs(surfaces, prepared->patches, *prepared->visibility, stop);
  if (stop.stop_requested()) return cancelled;

  BakePlan& plan = prepared->plan;
  plan.survey = prepared->surveyed.survey;
  tell_escape_share(plan.survey, plan.effects);
  if (prepared->atlas) {
    plan.atlas_size = prepared->atlas->width();
    plan.atlas_height = prepared->atlas->height();
    plan.num_lightmaps = prepared->atlas->num_sheets();
    plan.num_texels = prepared->atlas->num_texels();
  }
  if (prepared->groups) plan.num_vertex_groups = prepared->groups->size();
  plan.num_patches = prepared->patches.size();
  plan.rays_per_texel = options.rays > 0 ? options.rays : kDefaultRays;
  // Each replicate of a row has enough to tell what is buried.
  plan.rays_per_row = std::max(plan.rays_per_texel, kMinRays * num_replicates_of(FormFactors::kHemisphere));
  plan.light_samples_per_texel =
      std::count(surfaces.is_emitter.begin(), surfaces.is_emitter.end(), 1) > 0 ? kLightSamplesPerTexel : 0;
  if (asks_for_result(options)) {
    plan.spacing = options.spacing > 0 ? options.spacing : kProgressiveSpacing;
    plan.first_pass = pass_of({});
    plan.rays_per_row = plan.first_pass.rays_per_row;
    plan.rays_per_texel = plan.first_pass.rays_per_texel;
  } else {
    plan.spacing = options.spacing > 0 ? options.spacing : 1;
    plan.first_pass = {
        plan.rays_per_row,
        kLightSamplesPerPatch,
        plan.rays_per_texel,
        plan.rays_per_texel * plan.spacing,
        options.light_samples > 0 ? options.light_samples / kMaxReplicates * kMaxReplicates : kLightSamplesPerTexel,
        1};
  }
  choose_methods(options, plan);
  if (prepared->opacity &&
      (plan.form_factors == FormFactors::kAnalytic || plan.form_factors == FormFactors::kAdaptive)) {
    return invalid_argument(std::string("form factors by formula (--form-factors ") +
                            form_factors_name(plan.form_factors) +
                            ") know opaque surfaces only, and light passes some of this scene's: choose hemisphere or "
                            "hemicube, or force alpha_mask and tint off (--effect)");
  }
  plan.texels_per_meter = reached_density;
  plan.warnings.insert(plan.warnings.begin(), prepared->surveyed.warnings.begin(), prepared->surveyed.warnings.end());
  plan.warnings.insert(plan.warnings.end(), layout_warnings->begin(), layout_warnings->end());
  if (prepared->patches.num_uncut() > 0) {
    plan.warnings.push_back({"contacts_not_cut", std::to_string(prepared->patches.num_uncut()) +
                                                     " patches reach across surfaces that stand on them: more would "
                                                     "pass the limit of " +
                                                     std::to_string(max_patches) + " patches (--max-patches)"});
  }
  return prepared;
}

Result<PlannedBake> plan_scene(const Scene& scene, const BakeOptions& options, std::stop_token stop) {
  return on_threads(options.threads, [&]() -> Result<PlannedBake> {
    const double start = process_cpu_seconds();
    RADBAKE_ASSIGN_OR_RETURN(const std::unique_ptr<Preparation> prepared, prepare_scene(scene, options, stop));
    const Prediction prediction = predict_bake(*prepared, process_cpu_seconds() - start, stop);
    if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "the plan was cancelled"};
    return PlannedBake{prepared->plan, prediction};
  });
}

}  // namespace radbake::radiosity
