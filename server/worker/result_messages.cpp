#include "server/worker/result_messages.h"

#include <bit>

namespace radbake::worker {
namespace {

static_assert(std::endian::native == std::endian::little, "planes travel in little endian");

v1::Warning to_message(const Warning& warning) {
  v1::Warning out;
  out.set_id(warning.id);
  out.set_text(warning.text);
  return out;
}

v1::Survey to_message(const radiosity::Survey& survey) {
  v1::Survey out;
  out.set_num_meshes(survey.num_meshes);
  out.set_num_vertices(survey.num_vertices);
  out.set_num_triangles(survey.num_triangles);
  out.set_num_triangles_dropped(survey.num_triangles_dropped);
  out.set_num_materials(survey.num_materials);
  out.set_num_textures(survey.num_textures);
  out.set_num_lights(survey.num_lights);
  out.set_num_emitter_triangles(survey.num_emitter_triangles);
  out.set_num_glowing_triangles(survey.num_glowing_triangles);
  out.set_area_m2(survey.area_m2);
  out.set_emitted_lumens(survey.emitted_lumens);
  out.set_max_reflectance(survey.max_reflectance);
  out.set_extent_m(survey.extent_m);
  out.set_has_sky(survey.has_sky);
  out.set_min_reflectance(survey.min_reflectance);
  out.set_num_instances(survey.num_instances);
  out.set_is_grey(survey.is_grey);
  out.set_is_convex(survey.is_convex);
  out.set_is_closed(survey.is_closed);
  out.set_escape_share(survey.escape_share);
  out.set_escape_share_interval(survey.escape_share_interval);
  out.set_num_probe_rays(survey.num_probe_rays);
  out.set_area_masked_m2(survey.area_masked_m2);
  out.set_area_tinted_m2(survey.area_tinted_m2);
  out.set_area_translucent_m2(survey.area_translucent_m2);
  out.set_area_double_sided_m2(survey.area_double_sided_m2);
  out.set_area_specular_m2(survey.area_specular_m2);
  out.set_area_refractive_m2(survey.area_refractive_m2);
  out.set_area_normal_mapped_m2(survey.area_normal_mapped_m2);
  out.set_area_volume_m2(survey.area_volume_m2);
  out.set_num_textures_flat(survey.num_textures_flat);
  out.set_lamp_lumens(survey.lamp_lumens);
  for (const std::string& mesh : survey.brightest_emitters) out.add_brightest_emitters(mesh);
  return out;
}

v1::EffectPlan to_message(const radiosity::EffectPlan& effect) {
  v1::EffectPlan out;
  out.set_effect(std::string(radiosity::effect_name(effect.effect)));
  out.set_state(radiosity::effect_state_name(effect.state));
  out.set_reason(effect.reason);
  out.set_value(effect.value);
  out.set_is_forced(effect.is_forced);
  return out;
}

v1::StagePrediction to_message(const radiosity::StagePrediction& stage) {
  v1::StagePrediction out;
  out.set_stage(stage.stage);
  out.set_cpu_seconds(stage.cpu_seconds);
  out.set_cpu_seconds_low(stage.cpu_seconds_low);
  out.set_cpu_seconds_high(stage.cpu_seconds_high);
  out.set_wall_seconds(stage.wall_seconds);
  out.set_memory_bytes(stage.memory_bytes);
  return out;
}

v1::SolverReport to_message(const radiosity::SolverSummary& solver) {
  v1::SolverReport out;
  out.set_solver(solver.solver);
  out.set_status(solver.status);
  out.set_sweeps(static_cast<std::uint32_t>(solver.sweeps));
  out.set_residual(solver.residual);
  out.set_error_bound(solver.error_bound);
  out.set_relative_error_bound(solver.relative_error_bound);
  out.set_tolerance(solver.tolerance);
  for (const radiosity::SolverSummary::Point& point : solver.history) {
    v1::SolverPoint& to = *out.add_history();
    to.set_steps(point.steps);
    to.set_rows(point.rows);
    to.set_residual(point.residual);
    to.set_relative_error_bound(point.relative_error_bound);
  }
  return out;
}

v1::EnergyAudit to_message(const radiosity::EnergyAudit& energy) {
  v1::EnergyAudit out;
  out.set_is_closed(energy.is_closed);
  out.set_emitted(energy.emitted);
  out.set_absorbed(energy.absorbed);
  out.set_gap(energy.gap);
  out.set_gap_standard_error(energy.gap_standard_error);
  out.set_escaped(energy.escaped);
  out.set_transported_relative_gap(energy.transported_relative_gap);
  out.set_mean_irradiance(energy.mean_irradiance);
  return out;
}

v1::TransportReport to_message(const radiosity::TransportSummary& transport) {
  v1::TransportReport out;
  out.set_num_entries(transport.num_entries);
  out.set_raw_reciprocity_rms(transport.raw_reciprocity_rms);
  out.set_raw_closure_max(transport.raw_closure_max);
  out.set_paired_row_error_rms(transport.paired_row_error_rms);
  out.set_repaired_row_error_max(transport.repaired_row_error_max);
  out.set_scaling_sweeps(static_cast<std::uint32_t>(transport.scaling_sweeps));
  out.set_escape_share(transport.escape_share);
  out.set_absorbed_share(transport.absorbed_share);
  out.set_row_error_max(transport.row_error_max);
  out.set_num_rows_clipped(transport.num_rows_clipped);
  return out;
}

v1::LightmapReport to_message(const radiosity::LightmapSummary& lightmap) {
  v1::LightmapReport out;
  out.set_atlas_size(static_cast<std::uint32_t>(lightmap.atlas_size));
  out.set_num_texels(lightmap.num_texels);
  out.set_num_texels_filled(lightmap.num_texels_filled);
  out.set_num_texels_dilated(lightmap.num_texels_dilated);
  out.set_texels_per_meter(lightmap.texels_per_meter);
  out.set_atlas_height(static_cast<std::uint32_t>(lightmap.atlas_height));
  out.set_num_lightmaps(static_cast<std::uint32_t>(lightmap.num_lightmaps));
  out.set_fill(lightmap.fill);
  out.set_num_meshes_kept(lightmap.num_meshes_kept);
  out.set_num_meshes_placed(lightmap.num_meshes_placed);
  out.set_num_meshes_unwrapped(lightmap.num_meshes_unwrapped);
  out.set_num_charts(lightmap.num_charts);
  out.set_max_stretch(lightmap.max_stretch);
  out.set_num_seam_samples(lightmap.num_seam_samples);
  out.set_seam_difference_before(lightmap.seam_difference_before);
  out.set_seam_difference(lightmap.seam_difference);
  return out;
}

v1::VertexReport to_message(const radiosity::VertexSummary& vertices) {
  v1::VertexReport out;
  out.set_num_groups(vertices.num_groups);
  out.set_num_groups_filled(vertices.num_groups_filled);
  out.set_num_copies(vertices.num_copies);
  return out;
}

v1::ErrorReport to_message(const radiosity::ErrorSummary& error) {
  v1::ErrorReport out;
  out.set_relative_rmse(error.relative_rmse);
  out.set_interval_low(error.interval_low);
  out.set_interval_high(error.interval_high);
  out.set_algebraic(error.algebraic);
  out.set_sampling(error.sampling);
  out.set_discretisation(error.discretisation);
  v1::WorstTexels& worst = *out.mutable_worst_1_percent();
  worst.set_error(error.worst.error);
  worst.set_lightmap(static_cast<std::uint32_t>(error.worst.lightmap));
  worst.set_x(static_cast<std::uint32_t>(error.worst.x));
  worst.set_y(static_cast<std::uint32_t>(error.worst.y));
  worst.set_mesh(error.worst.mesh);
  out.set_asked(error.asked);
  out.set_predicted(error.predicted);
  out.set_reached(error.is_reached);
  out.set_limited_by(error.limited_by);
  out.set_num_texels(error.num_texels);
  return out;
}

v1::PassReport to_message(const radiosity::PassSummary& pass) {
  v1::PassReport out;
  out.set_num_patches(pass.num_patches);
  out.set_rays_per_row(static_cast<std::uint32_t>(pass.rays_per_row));
  out.set_rays_per_texel(static_cast<std::uint32_t>(pass.rays_per_texel));
  out.set_light_samples_per_texel(static_cast<std::uint32_t>(pass.light_samples_per_texel));
  out.set_num_gathered(pass.num_gathered);
  out.set_num_row_rays(pass.num_row_rays);
  out.set_num_gather_rays(pass.num_gather_rays);
  out.set_num_light_rays(pass.num_light_rays);
  out.set_relative_rmse(pass.relative_rmse);
  out.set_interval_low(pass.interval_low);
  out.set_interval_high(pass.interval_high);
  out.set_gathered_scale(pass.scale.gathered);
  out.set_direct_scale(pass.scale.direct);
  out.set_refines_patches(pass.scale.refines_patches);
  out.set_interpolation_limit(pass.scale.interpolation_limit);
  out.set_is_partial(!pass.is_whole);
  return out;
}

v1::UvSource to_source(radiosity::UvSource source) {
  switch (source) {
    case radiosity::UvSource::kNone: return v1::UV_NONE;
    case radiosity::UvSource::kKept: return v1::UV_KEPT;
    case radiosity::UvSource::kPlaced: return v1::UV_PLACED;
    case radiosity::UvSource::kUnwrapped: return v1::UV_UNWRAPPED;
  }
  return v1::UV_NONE;
}

template <typename T>
void append(const std::vector<T>& values, std::string& data) {
  data.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

v1::BakeState to_state(radiosity::BakeStage stage) {
  switch (stage) {
    case radiosity::BakeStage::kPreparing: return v1::PREPARING;
    case radiosity::BakeStage::kFormFactors: return v1::FORM_FACTORS;
    case radiosity::BakeStage::kSolving: return v1::SOLVING;
    case radiosity::BakeStage::kGathering: return v1::GATHERING;
  }
  return v1::PREPARING;
}

}  // namespace

v1::Plan to_message(const radiosity::BakePlan& plan) {
  v1::Plan out;
  *out.mutable_survey() = to_message(plan.survey);
  out.set_atlas_size(static_cast<std::uint32_t>(plan.atlas_size));
  out.set_atlas_height(static_cast<std::uint32_t>(plan.atlas_height));
  out.set_num_lightmaps(static_cast<std::uint32_t>(plan.num_lightmaps));
  out.set_num_texels(plan.num_texels);
  out.set_num_vertex_groups(plan.num_vertex_groups);
  out.set_num_patches(plan.num_patches);
  out.set_rays_per_texel(static_cast<std::uint64_t>(plan.rays_per_texel));
  out.set_rays_per_row(static_cast<std::uint64_t>(plan.rays_per_row));
  out.set_light_samples_per_texel(static_cast<std::uint64_t>(plan.light_samples_per_texel));
  out.set_estimator(radiosity::form_factors_name(plan.form_factors));
  out.set_transport(radiosity::transport_name(plan.transport));
  out.set_solver(radiosity::solver_name(plan.solver));
  out.set_transport_bytes(plan.transport_bytes);
  out.set_transport_bytes_limit(plan.transport_bytes_limit);
  out.set_texels_per_meter(plan.texels_per_meter);
  for (const radiosity::EffectPlan& effect : plan.effects) *out.add_effects() = to_message(effect);
  out.set_num_channels(static_cast<std::uint32_t>(plan.num_channels));
  out.set_estimator_reason(plan.form_factors_reason);
  out.set_transport_reason(plan.transport_reason);
  out.set_solver_reason(plan.solver_reason);
  for (const Warning& warning : plan.warnings) *out.add_warnings() = to_message(warning);
  return out;
}

v1::Prediction to_message(const radiosity::Prediction& prediction) {
  v1::Prediction out;
  for (const radiosity::StagePrediction& stage : prediction.stages) *out.add_stages() = to_message(stage);
  *out.mutable_total() = to_message(prediction.total);
  for (const radiosity::MeshPrediction& mesh : prediction.costliest) {
    v1::MeshPrediction& to = *out.add_costliest();
    to.set_mesh(mesh.mesh);
    to.set_cpu_seconds(mesh.cpu_seconds);
    to.set_num_texels(mesh.num_texels);
    to.set_num_patches(mesh.num_patches);
  }
  for (const radiosity::EffectSeconds& effect : prediction.effects) {
    v1::EffectSeconds& to = *out.add_effects();
    to.set_effect(std::string(radiosity::effect_name(effect.effect)));
    to.set_cpu_seconds(effect.cpu_seconds);
  }
  out.set_source(prediction.source);
  out.set_pilot_seconds(prediction.pilot_seconds);
  return out;
}

v1::HostCosts to_message(const radiosity::HostCosts& costs) {
  v1::HostCosts out;
  out.set_row_ray(costs.row_ray);
  out.set_texel_ray(costs.texel_ray);
  out.set_light_ray(costs.light_ray);
  out.set_row(costs.row);
  out.set_receiver(costs.receiver);
  out.set_entry_step(costs.entry_step);
  out.set_entry(costs.entry);
  return out;
}

v1::Progress to_message(const radiosity::BakeProgress& progress) {
  v1::Progress out;
  out.set_state(to_state(progress.stage));
  out.set_fraction(progress.fraction);
  out.set_steps_done(progress.steps_done);
  out.set_steps_total(progress.steps_total);
  out.set_seconds_left(progress.seconds_left);
  out.set_residual(progress.residual);
  out.set_pass(static_cast<std::uint32_t>(progress.pass));
  out.set_relative_error(progress.relative_error);
  out.set_relative_error_low(progress.relative_error_low);
  out.set_relative_error_high(progress.relative_error_high);
  out.set_asked_error(progress.asked_error);
  return out;
}

v1::LayerTile to_message(const radiosity::Tile& tile) {
  v1::LayerTile out;
  out.set_layer(static_cast<std::uint32_t>(tile.layer));
  out.set_layer_name(tile.layer_name);
  out.set_layer_width(static_cast<std::uint32_t>(tile.layer_width));
  out.set_layer_height(static_cast<std::uint32_t>(tile.layer_height));
  out.set_channels(static_cast<std::uint32_t>(tile.channels));
  out.set_pass(static_cast<std::uint32_t>(tile.pass));
  out.set_x(static_cast<std::uint32_t>(tile.x));
  out.set_y(static_cast<std::uint32_t>(tile.y));
  out.set_width(static_cast<std::uint32_t>(tile.width));
  out.set_height(static_cast<std::uint32_t>(tile.height));
  out.set_data(tile.values.data(), tile.values.size() * sizeof(float));
  return out;
}

v1::Layer to_message(const radiosity::Layer& layer) {
  v1::Layer out;
  out.set_name(layer.name);
  out.set_quantity(layer.quantity);
  out.set_unit(layer.unit);
  out.set_width(static_cast<std::uint32_t>(layer.width));
  out.set_height(static_cast<std::uint32_t>(layer.height));
  out.set_channels(static_cast<std::uint32_t>(layer.channels));
  return out;
}

v1::MeshResult to_message(const radiosity::MeshOutput& mesh, std::string& data) {
  v1::MeshResult out;
  out.set_lightmap(static_cast<std::uint32_t>(mesh.placement.sheet));
  out.set_uv_source(to_source(mesh.placement.source));
  out.mutable_uv_scale()->set_x(mesh.placement.scale.x);
  out.mutable_uv_scale()->set_y(mesh.placement.scale.y);
  out.mutable_uv_offset()->set_x(mesh.placement.offset.x);
  out.mutable_uv_offset()->set_y(mesh.placement.offset.y);
  out.set_is_split(!mesh.source_vertices.empty());
  out.set_has_irradiance(!mesh.irradiance.empty());
  out.set_num_vertices(mesh.num_vertices);
  out.set_num_triangles(static_cast<std::uint32_t>(mesh.triangles.size()));
  out.set_data_offset(data.size());
  append(mesh.source_vertices, data);
  append(mesh.triangles, data);
  append(mesh.uvs, data);
  append(mesh.irradiance, data);
  return out;
}

v1::BakeReport to_message(const radiosity::BakeReport& report) {
  v1::BakeReport out;
  out.set_instruction_set(report.instruction_set);
  *out.mutable_plan() = to_message(report.plan);
  out.set_num_patches(report.num_patches);
  out.set_num_row_rays(report.num_row_rays);
  out.set_num_gather_rays(report.num_gather_rays);
  out.set_num_light_rays(report.num_light_rays);
  *out.mutable_solver() = to_message(report.solver);
  *out.mutable_energy() = to_message(report.energy);
  *out.mutable_transport() = to_message(report.transport);
  *out.mutable_lightmap() = to_message(report.lightmap);
  *out.mutable_vertices() = to_message(report.vertices);
  if (report.error.num_texels > 0) *out.mutable_error() = to_message(report.error);
  for (const radiosity::PassSummary& pass : report.passes) *out.add_passes() = to_message(pass);
  for (const Warning& warning : report.warnings) *out.add_warnings() = to_message(warning);
  return out;
}

}  // namespace radbake::worker
