#include "server/radiosity/bake/preparation.h"

#include "server/radiosity/bake/bake.h"

namespace radbake::radiosity {

Result<std::unique_ptr<Preparation>> prepare_scene(const Scene& scene, const BakeOptions& options,
                                                   std::stop_token stop) {
  const Error cancelled{ErrorCode::kCancelled, "the bake was cancelled while it was prepared"};
  RADBAKE_RETURN_IF_ERROR(check_options(options));
  auto prepared = std::make_unique<Preparation>();
  RADBAKE_ASSIGN_OR_RETURN(prepared->surveyed, survey_scene(scene));
  const Surfaces& surfaces = prepared->surveyed.surfaces;
  if (stop.stop_requested()) return cancelled;

  const double density = options.texels_per_meter > 0 ? options.texels_per_meter : kDefaultTexelsPerMeter;
  std::vector<Warning> layout_warnings;
  if (options.output != Output::kVertices) {
    const LayoutOptions wanted{options.lightmap_uv, options.atlas_size, density, options.texels_per_meter == 0};
    RADBAKE_ASSIGN_OR_RETURN(Layout layout, make_layout(surfaces, wanted));
    layout_warnings = std::move(layout.warnings);
    RADBAKE_ASSIGN_OR_RETURN(prepared->atlas, Atlas::make(surfaces, std::move(layout)));
  }
  if (options.output != Output::kLightmap) prepared->groups = group_vertices(surfaces);
  if (stop.stop_requested()) return cancelled;

  double area = 0;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    area += surfaces.areas[t] * (surfaces.material(t).is_double_sided ? 2 : 1);
  }
  const auto max_patches = static_cast<std::size_t>(max_patches_of(options));
  const double reached_density = prepared->atlas ? prepared->atlas->texels_per_meter() : density;
  const double texel_edge = 1 / (reached_density * surfaces.metres_per_unit);
  prepared->visibility = make_embree_visibility(surfaces.corners, stop);
  if (!prepared->visibility || stop.stop_requested()) return cancelled;
  prepared->patches =
      make_patches(surfaces, *prepared->visibility, {patch_edge(texel_edge, area, max_patches), max_patches, stop});
  if (stop.stop_requested()) return cancelled;

  BakePlan& plan = prepared->plan;
  plan.survey = prepared->surveyed.survey;
  if (prepared->atlas) {
    plan.atlas_size = prepared->atlas->width();
    plan.atlas_height = prepared->atlas->height();
    plan.num_lightmaps = prepared->atlas->num_sheets();
    plan.num_texels = prepared->atlas->num_texels();
  }
  if (prepared->groups) plan.num_vertex_groups = prepared->groups->size();
  plan.num_patches = prepared->patches.size();
  plan.rays_per_texel = options.rays > 0 ? options.rays : kDefaultRays;
  plan.rays_per_row = plan.rays_per_texel;
  plan.light_samples_per_texel = plan.survey.num_emitter_triangles > 0 ? kLightSamplesPerTexel : 0;
  choose_methods(options, plan);
  plan.texels_per_meter = reached_density;
  plan.warnings = prepared->surveyed.warnings;
  plan.warnings.insert(plan.warnings.end(), layout_warnings.begin(), layout_warnings.end());
  if (prepared->patches.num_uncut() > 0) {
    plan.warnings.push_back({"contacts_not_cut", std::to_string(prepared->patches.num_uncut()) +
                                                     " patches reach across surfaces that stand on them: more would "
                                                     "pass the limit of " +
                                                     std::to_string(max_patches) + " patches (--max-patches)"});
  }
  return prepared;
}

Result<PlannedBake> plan_scene(const Scene& scene, const BakeOptions& options, std::stop_token stop) {
  RADBAKE_ASSIGN_OR_RETURN(const std::unique_ptr<Preparation> prepared, prepare_scene(scene, options, stop));
  return PlannedBake{prepared->plan, {}};
}

}  // namespace radbake::radiosity
