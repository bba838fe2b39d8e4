#include "server/radiosity/bake/bake_work.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>

namespace radbake::radiosity {
namespace {

/// Of a shadow ray's time, the part that Embree takes; the rest draws and weighs the sample. Measured, see
/// plan/docs/costs.md.
constexpr double kTracedShare = 0.4;
/// What rays cost more where all surfaces are see-through. Measured there too.
constexpr double kSeeThroughExcess = 0.65;

double bytes_of(const Scene& scene) {
  double bytes = 0;
  for (const Mesh& mesh : scene.meshes) {
    bytes += static_cast<double>(mesh.positions.size() * sizeof(Vec3) + mesh.normals.size() * sizeof(Vec3) +
                                 mesh.colors.size() * sizeof(Vec3) + mesh.texcoord0.size() * sizeof(Vec2) +
                                 mesh.texcoord1.size() * sizeof(Vec2) + mesh.triangles.size() * 12);
  }
  for (const TexturePlane& texture : scene.textures) bytes += static_cast<double>(texture.values.size() * 4);
  if (scene.environment) bytes += static_cast<double>(scene.environment->values.size() * 4);
  return bytes;
}

/// Shadow rays of a receiver, by effect: Effect::kEmitters ... kHdri.
std::array<double, kNumEffects> light_rays_of(const Preparation& prepared, double samples, double sites) {
  const Surfaces& surfaces = prepared.surveyed.surfaces;
  const Survey& survey = prepared.surveyed.survey;
  std::array<double, kNumEffects> rays{};
  const auto of = [&rays](Effect effect) -> double& { return rays[static_cast<std::size_t>(effect)]; };
  if (survey.num_emitter_triangles > 0) of(Effect::kEmitters) = samples;
  of(Effect::kPoint) = sites * static_cast<double>(survey.point.num_facing);
  of(Effect::kSpot) = sites * static_cast<double>(survey.spot.num_facing);
  of(Effect::kIes) = sites * static_cast<double>(survey.ies.num_facing);
  of(Effect::kDirectional) = sites * static_cast<double>(survey.directional.num_facing);
  of(Effect::kSun) = samples / 2 * static_cast<double>(survey.sun.num_facing);
  if (surfaces.scene->environment) of(Effect::kHdri) = samples;
  return rays;
}

double sum_of_on(const std::array<double, kNumEffects>& rays, const EffectSet& on) {
  double sum = 0;
  for (int e = 0; e < kNumEffects; ++e) {
    if (on.has(static_cast<Effect>(e))) sum += rays[static_cast<std::size_t>(e)];
  }
  return sum;
}

/// As HemisphereEstimator::num_sites().
double num_sites(int rays) {
  int sites = 1;
  while (2 * sites <= 64 && 16 * sites <= rays) sites *= 2;
  return sites;
}

double seconds_of(const std::vector<StagePrediction>& stages, const char* name) {
  const auto found = std::find_if(stages.begin(), stages.end(), [&](const auto& stage) { return stage.stage == name; });
  return found == stages.end() ? 0 : found->cpu_seconds;
}

}  // namespace

BakeWork count_work(const Preparation& prepared, double preparing_seconds) {
  const BakePlan& plan = prepared.plan;
  const Surfaces& surfaces = prepared.surveyed.surfaces;
  const bool is_reflected = surfaces.effects.has(Effect::kInterreflection);
  BakeWork work;
  work.preparing_seconds = preparing_seconds;
  work.num_rows = is_reflected ? static_cast<double>(plan.num_patches) : 0;
  work.rays_per_row = plan.rays_per_row;
  work.transport = plan.transport;
  work.entries_per_row = std::min<double>(static_cast<double>(plan.num_patches), plan.rays_per_row);
  work.sweeps = expected_sweeps(std::min(plan.survey.max_reflectance, 0.9) * (1 - plan.survey.escape_share), 1e-6);
  work.num_receivers = static_cast<double>(plan.num_texels + plan.num_vertex_groups);
  work.rays_per_receiver = plan.rays_per_texel;
  const double sites = num_sites(plan.rays_per_texel);
  const EffectSet& on = surfaces.effects;
  work.light_rays_per_receiver = sum_of_on(light_rays_of(prepared, kLightSamplesPerTexel, sites), on);
  work.light_rays_per_row = sum_of_on(light_rays_of(prepared, kLightSamplesPerPatch, sites), on);
  work.num_ray_channels = prepared.num_ray_channels();
  work.num_solved_channels = work.num_ray_channels > 1 ? 1 : plan.num_channels;
  work.scene_bytes = bytes_of(*surfaces.scene);
  work.num_triangles = static_cast<double>(surfaces.size());
  work.num_patches = static_cast<double>(plan.num_patches);
  work.num_pixels = static_cast<double>(plan.atlas_size) * plan.atlas_height * plan.num_lightmaps;
  const BakeOptions& options = prepared.options;
  work.num_layers = 1 + (options.wants_direct ? 1 : 0) + (options.wants_indirect ? 1 : 0) + (options.wants_ao ? 1 : 0);
  work.num_vertex_bytes =
      static_cast<double>(plan.num_vertex_groups) * sizeof(Vec3) + static_cast<double>(plan.survey.num_triangles) * 48;
  const auto cores = static_cast<int>(std::thread::hardware_concurrency());
  work.threads = options.threads > 0 ? std::min(options.threads, std::max(cores, 1)) : std::max(cores, 1);
  return work;
}

HostCosts or_usual(const HostCosts& own) {
  const auto either = [](double cost, double usual) { return cost > 0 ? cost : usual; };
  return {either(own.row_ray, kUsualCosts.row_ray),
          either(own.texel_ray, kUsualCosts.texel_ray),
          either(own.light_ray, kUsualCosts.light_ray),
          own.row,
          own.receiver,
          either(own.entry_step, kUsualCosts.entry_step),
          either(own.entry, kUsualCosts.entry)};
}

std::vector<MeshPrediction> costliest_meshes(const Preparation& prepared, const BakeWork& work,
                                             const HostCosts& costs) {
  const Surfaces& surfaces = prepared.surveyed.surfaces;
  const std::size_t num_meshes = surfaces.scene->meshes.size();
  std::vector<double> texels(num_meshes, 0);
  std::vector<MeshPrediction> meshes(num_meshes);
  if (prepared.atlas) {
    // Texels in proportion to the area that a mesh has in the lightmaps.
    const Layout& layout = prepared.atlas->layout();
    double all = 0;
    for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
      const auto& c = layout.corners[t];
      const double area = std::fabs((c[1].x - c[0].x) * (c[2].y - c[0].y) - (c[2].x - c[0].x) * (c[1].y - c[0].y)) / 2;
      texels[surfaces.meshes[t]] += area;
      all += area;
    }
    for (double& own : texels) own *= all > 0 ? static_cast<double>(prepared.atlas->num_texels()) / all : 0;
  }
  for (std::uint32_t i = 0; i < prepared.patches.size(); ++i) {
    ++meshes[surfaces.meshes[prepared.patches.pieces(prepared.patches.front_of(i)).front().triangle]].num_patches;
  }
  const auto channels = static_cast<double>(work.num_ray_channels);
  const double receiver = channels * (costs.receiver + work.rays_per_receiver * costs.texel_ray +
                                      work.light_rays_per_receiver * costs.light_ray);
  const double row = work.num_rows > 0
                         ? channels * (costs.row + work.rays_per_row * costs.row_ray +
                                       work.light_rays_per_row * costs.light_ray + work.entries_per_row * costs.entry)
                         : 0;
  for (std::size_t m = 0; m < num_meshes; ++m) {
    meshes[m].mesh = surfaces.scene->meshes[m].name;
    meshes[m].num_texels = static_cast<std::uint64_t>(std::lround(texels[m]));
    meshes[m].cpu_seconds = texels[m] * receiver + static_cast<double>(meshes[m].num_patches) * row;
  }
  std::stable_sort(meshes.begin(), meshes.end(),
                   [](const auto& a, const auto& b) { return a.cpu_seconds > b.cpu_seconds; });
  constexpr std::size_t kMost = 3;
  meshes.resize(std::min(meshes.size(), kMost));
  return meshes;
}

std::vector<EffectSeconds> seconds_by_effect(const Preparation& prepared, const BakeWork& work,
                                             const HostCosts& costs) {
  const EffectSet& on = prepared.surveyed.surfaces.effects;
  const Survey& survey = prepared.surveyed.survey;
  const std::vector<StagePrediction> stages = predict_stages(work, costs, {});
  const double rows = seconds_of(stages, "form_factors"), solve = seconds_of(stages, "solving");
  const double gather = seconds_of(stages, "gathering");
  const auto channels = static_cast<double>(work.num_ray_channels);

  // Shadow rays as counted, scaled to what was traced in fact: many contributions are zero and need no ray.
  const double sites = num_sites(prepared.plan.rays_per_texel);
  const auto of_receiver = light_rays_of(prepared, kLightSamplesPerTexel, sites);
  const auto of_row = light_rays_of(prepared, kLightSamplesPerPatch, sites);
  const double counted_receiver = sum_of_on(of_receiver, on), counted_row = sum_of_on(of_row, on);
  const double traced_receiver = counted_receiver > 0 ? work.light_rays_per_receiver / counted_receiver : 1;
  const double traced_row = counted_row > 0 ? work.light_rays_per_row / counted_row : 1;
  double shadows = 0;
  std::array<double, kNumEffects> seconds{};
  const auto of = [&seconds](Effect effect) -> double& { return seconds[static_cast<std::size_t>(effect)]; };
  for (std::size_t e = 0; e < of_receiver.size(); ++e) {
    seconds[e] = channels * costs.light_ray *
                 (work.num_receivers * of_receiver[e] * traced_receiver + work.num_rows * of_row[e] * traced_row);
    if (on.has(static_cast<Effect>(e))) shadows += seconds[e];
  }

  of(Effect::kOcclusion) = kTracedShare * shadows;
  of(Effect::kInterreflection) = rows + solve;
  of(Effect::kColor) =
      work.num_solved_channels > 1 ? solve * (1 - kOneChannelShare) : solve * (1 / kOneChannelShare - 1);
  if (prepared.patches.size() > 0) {
    const auto backs = static_cast<double>(prepared.patches.size() - prepared.patches.num_cells());
    of(Effect::kTwoSided) = rows * backs / static_cast<double>(prepared.patches.size());
  }
  // A row and a receiver on the other side.
  of(Effect::kDiffuseTransmission) = (rows + gather) * survey.area_translucent_m2 / survey.area_m2;
  const double traced = rows + gather;
  of(Effect::kAlphaMask) = kSeeThroughExcess * traced * survey.area_masked_m2 / survey.area_m2;
  of(Effect::kTint) = kSeeThroughExcess * traced * survey.area_tinted_m2 / survey.area_m2;
  if (work.num_ray_channels > 1) of(Effect::kTint) += (1 - 1 / channels) * (traced + solve);
  of(Effect::kVertices) =
      channels * static_cast<double>(prepared.plan.num_vertex_groups) *
      (costs.receiver + work.rays_per_receiver * costs.texel_ray + work.light_rays_per_receiver * costs.light_ray);

  std::vector<EffectSeconds> effects;
  for (const EffectPlan& effect : prepared.plan.effects) {
    if (effect.state != EffectState::kOn && effect.state != EffectState::kOff) continue;
    effects.push_back({effect.effect, of(effect.effect)});
  }
  return effects;
}

}  // namespace radbake::radiosity
