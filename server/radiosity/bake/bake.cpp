#include "server/radiosity/bake/bake.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <optional>
#include <thread>

#include "server/radiosity/bake/lightmap_layers.h"
#include "server/radiosity/bake/patch_light.h"
#include "server/radiosity/bake/pilot.h"
#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/bake/progress_meter.h"
#include "server/radiosity/gather/gather.h"
#include "server/radiosity/gather/gather_vertices.h"

namespace radbake::radiosity {
namespace {

enum Purpose : std::uint64_t { kReplicate = 71 };

Error cancelled() { return {ErrorCode::kCancelled, "the bake was cancelled"}; }

/// One bake, stage after stage, on the threads of the arena that it runs in.
class Bake {
 public:
  Bake(const Scene& scene, const Preparation& prepared, ProgressMeter& progress, std::stop_token stop)
      : scene_(scene),
        options_(prepared.options),
        num_ray_channels_(prepared.num_ray_channels()),
        prepared_(prepared),
        surfaces_(prepared.surveyed.surfaces),
        progress_(progress),
        stop_(stop) {}

  Result<BakeOutcome> run() {
    outcome_.report.plan = prepared_.plan;
    outcome_.report.warnings = prepared_.plan.warnings;
    outcome_.report.num_patches = prepared_.patches.size();

    outcome_.report.instruction_set = prepared_.visibility->instruction_set();
    const int num_channels = num_ray_channels_;
    RADBAKE_ASSIGN_OR_RETURN(const std::vector<PatchLight> patch_light, solve_replicates());
    std::vector<SentLight> sent;
    for (int r = 0; r < kMaxReplicates; ++r) {
      const PatchLight& own = patch_light[static_cast<std::size_t>(r) % patch_light.size()];
      sent.push_back(
          {own.radiosity, options_.wants_direct || options_.wants_indirect ? own.glow : std::span<const Vec3>{}});
    }

    const DirectLight direct(surfaces_, prepared_.shadows(), kLightSamplesPerTexel, Environment::Part::kBright);
    const double ao_distance = options_.ao_distance > 0 ? options_.ao_distance : kDefaultAoDistance;
    std::vector<HemisphereEstimator> rows;
    for (int channel = 0; channel < num_channels; ++channel) {
      rows.emplace_back(surfaces_, prepared_.patches, prepared_.visibility->channel(channel),
                        prepared_.plan.rays_per_texel, options_.wants_ao ? ao_distance / surfaces_.metres_per_unit : 0,
                        kMaxReplicates);
    }
    const GatherScene scene{surfaces_,
                            prepared_.shadows(),
                            rows[0],
                            direct,
                            sent,
                            surfaces_.sky,
                            options_.seed,
                            std::span(rows).subspan(1),
                            outcome_.report.solver.error_bound};
    if (!gather(scene)) return cancelled();
    outcome_.report.stages = progress_.stage_times();
    return std::move(outcome_);
  }

 private:
  /// The replicates of the patches' light: several where rows are sampled.
  Result<std::vector<PatchLight>> solve_replicates() {
    BakeReport& report = outcome_.report;
    const int num = num_replicates_of(report.plan.form_factors);
    const auto total_num = static_cast<std::uint64_t>(num);
    std::vector<ReplicateSystem> systems;
    for (int r = 0; r < num; ++r) {
      const auto index = static_cast<std::uint64_t>(r);
      const SystemSettings settings{seed_of(options_.seed, kReplicate, index), report.plan.rays_per_row / num,
                                    kLightSamplesPerPatch / num};
      RADBAKE_ASSIGN_OR_RETURN(ReplicateSystem system, estimate_system(
                                                           prepared_, settings,
                                                           [&](std::uint64_t done, std::uint64_t total) {
                                                             progress_.report(BakeStage::kFormFactors,
                                                                              total * index + done, total * total_num);
                                                           },
                                                           stop_));
      report.num_row_rays += system.report.num_row_rays;
      report.num_light_rays += system.report.num_light_rays;
      systems.push_back(std::move(system));
    }
    progress_.report(BakeStage::kSolving, 0, 0);
    std::vector<PatchLight> light;
    for (ReplicateSystem& system : systems) {
      RADBAKE_ASSIGN_OR_RETURN(PatchLight own, solve_patch_light(
                                                   prepared_, system,
                                                   [&](std::uint64_t steps, double bound) {
                                                     progress_.report(BakeStage::kSolving, steps, 0, bound);
                                                   },
                                                   stop_));
      light.push_back(std::move(own));
    }
    // Of several replicates, the report shows the first.
    const PatchLightReport& first = systems.front().report;
    report.transport = first.transport;
    report.solver = first.solver;
    report.energy = first.energy;
    report.warnings.insert(report.warnings.end(), first.warnings.begin(), first.warnings.end());
    return light;
  }

  /// Radiosity -> lightmaps and light by vertex; false when it was stopped.
  bool gather(const GatherScene& scene) {
    const std::uint64_t num_receivers = prepared_.plan.num_texels + prepared_.plan.num_vertex_groups;
    progress_.report(BakeStage::kGathering, 0, num_receivers);
    if (prepared_.atlas && !gather_texels(scene, *prepared_.atlas, num_receivers)) return false;
    GatheredVertices vertices;
    if (prepared_.groups) {
      vertices = gather_vertices(
          scene, *prepared_.groups,
          [&](std::uint64_t done) {
            progress_.report(BakeStage::kGathering, prepared_.plan.num_texels + done, num_receivers);
          },
          stop_);
      if (vertices.is_cancelled) return false;
    }
    describe_meshes(vertices);
    return true;
  }

  bool gather_texels(const GatherScene& scene, const Atlas& atlas, std::uint64_t num_receivers) {
    BakeReport& report = outcome_.report;
    GatheredMap map = gather_lightmap(
        scene, atlas, {options_.wants_direct, options_.wants_indirect, options_.wants_ao},
        [&](const GatheredTile& tile) {
          progress_.tile({tile.sheet, 0, tile.x, tile.y, tile.width, tile.height, 4, tile.rgba,
                          lightmap_name(tile.sheet), atlas.width(), atlas.height()});
          progress_.report(BakeStage::kGathering, tile.texels_done, num_receivers);
        },
        stop_);
    if (map.is_cancelled) return false;
    report.num_gather_rays += map.num_rays;
    report.num_light_rays += map.num_light_rays;
    report.energy.mean_irradiance = map.mean_irradiance;

    report.lightmap = append_layers(surfaces_, atlas, map, outcome_.layers);
    return true;
  }

  void describe_meshes(const GatheredVertices& vertices) {
    BakeReport& report = outcome_.report;
    const Layout* layout = prepared_.atlas ? &prepared_.atlas->layout() : nullptr;
    std::optional<VertexLight> light;
    if (prepared_.groups) {
      light.emplace(VertexLight{*prepared_.groups, vertices.irradiance});
      report.num_gather_rays += vertices.num_rays;
      report.num_light_rays += vertices.num_light_rays;
      report.vertices.num_groups = prepared_.groups->size();
      report.vertices.num_groups_filled = vertices.num_filled;
      if (!prepared_.atlas) report.energy.mean_irradiance = vertices.mean_irradiance;
    }
    outcome_.meshes = make_mesh_outputs(surfaces_, layout, light ? &*light : nullptr);
    for (std::size_t m = 0; m < outcome_.meshes.size(); ++m) {
      report.vertices.num_copies += outcome_.meshes[m].num_vertices - scene_.meshes[m].positions.size();
    }
  }

  const Scene& scene_;
  const BakeOptions& options_;
  const int num_ray_channels_;
  const Preparation& prepared_;
  const Surfaces& surfaces_;
  ProgressMeter& progress_;
  std::stop_token stop_;
  BakeOutcome outcome_;
};

/// Rays that the two traced stages will take, to share the progress between them.
double row_rays(const BakePlan& plan, const Patches& patches) {
  return static_cast<double>(patches.num_cells()) * (plan.rays_per_row + kLightSamplesPerPatch);
}
double gather_rays(const BakePlan& plan) {
  return static_cast<double>(plan.num_texels + plan.num_vertex_groups) *
         (plan.rays_per_texel + plan.light_samples_per_texel);
}

}  // namespace

Result<BakeOutcome> bake_scene(const Scene& scene, const BakeOptions& options, BakeObserver& observer,
                               std::stop_token stop, std::stop_token finish) {
  const int threads = options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());
  // An arena of more threads than cores is allowed: results do not depend on the number.
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  std::optional<Result<BakeOutcome>> outcome;
  arena.execute([&] {
    const ProgressMeter::Start start;
    observer.on_progress({});
    auto prepared = prepare_scene(scene, options, stop);
    if (!prepared.ok()) {
      outcome.emplace(prepared.error());
      return;
    }
    const Preparation& ready = **prepared;
    const Prediction prediction = predict_bake(ready, process_cpu_seconds() - start.cpu_seconds, stop);
    ProgressMeter progress(observer, start, row_rays(ready.plan, ready.patches), gather_rays(ready.plan));
    outcome.emplace(Bake(scene, ready, progress, stop).run());
    if (!outcome->ok()) return;
    BakeReport& report = (*outcome)->report;
    report.prediction = prediction;
    report.costs = measured_costs(report);
  });
  return std::move(*outcome);
}

}  // namespace radbake::radiosity
