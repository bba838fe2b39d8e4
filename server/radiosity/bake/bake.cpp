#include "server/radiosity/bake/bake.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <limits>
#include <optional>
#include <thread>

#include "server/radiosity/bake/lightmap_layers.h"
#include "server/radiosity/bake/pilot.h"
#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/bake/progress_meter.h"
#include "server/radiosity/bake/radiosity_system.h"
#include "server/radiosity/error/energy.h"
#include "server/radiosity/gather/gather.h"
#include "server/radiosity/gather/gather_vertices.h"
#include "server/radiosity/solve/solve.h"

namespace radbake::radiosity {
namespace {

Error cancelled() { return {ErrorCode::kCancelled, "the bake was cancelled"}; }

/// The course of a solve in so many points that a plot looks the same.
std::vector<SolverSummary::Point> thinned(const std::vector<SolveStep>& history) {
  constexpr std::size_t kMostPoints = 100;
  std::vector<SolverSummary::Point> points;
  const std::size_t step = history.size() / kMostPoints + 1;
  for (std::size_t k = 0; k < history.size(); ++k) {
    if (k % step != 0 && k + 1 != history.size()) continue;
    points.push_back({static_cast<std::uint64_t>(history[k].steps), static_cast<std::uint64_t>(history[k].work),
                      history[k].residual, history[k].relative_error_bound});
  }
  return points;
}

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
    RADBAKE_ASSIGN_OR_RETURN(auto systems, make_systems());
    std::vector<Vec3> radiosity(prepared_.patches.size()), glow(radiosity);
    for (int channel = 0; channel < num_channels; ++channel) {
      const auto system = std::move(systems[static_cast<std::size_t>(channel)]);
      RADBAKE_ASSIGN_OR_RETURN(const std::vector<Vec3> own, radiosity_of(*system));
      for (std::size_t i = 0; i < radiosity.size(); ++i) {
        for (int c = channel; c < (num_channels == 1 ? 3 : channel + 1); ++c) {
          radiosity[i][c] = own[i][c];
          glow[i][c] = system->glow[i][c];
        }
      }
    }
    if (!options_.wants_direct && !options_.wants_indirect) glow = {};

    const DirectLight direct(surfaces_, prepared_.shadows(), kLightSamplesPerTexel, Environment::Part::kBright);
    const double ao_distance = options_.ao_distance > 0 ? options_.ao_distance : kDefaultAoDistance;
    std::vector<HemisphereEstimator> rows;
    for (int channel = 0; channel < num_channels; ++channel) {
      rows.emplace_back(surfaces_, prepared_.patches, prepared_.visibility->channel(channel),
                        prepared_.plan.rays_per_texel, options_.wants_ao ? ao_distance / surfaces_.metres_per_unit : 0);
    }
    const GatherScene scene{surfaces_,
                            prepared_.shadows(),
                            rows[0],
                            direct,
                            radiosity,
                            glow,
                            surfaces_.sky,
                            options_.seed,
                            std::span(rows).subspan(1),
                            outcome_.report.solver.error_bound};
    if (!gather(scene)) return cancelled();
    outcome_.report.stages = progress_.stage_times();
    return std::move(outcome_);
  }

 private:
  /// The rows of each channel that see-through surfaces tell apart.
  Result<std::vector<std::unique_ptr<RadiositySystem>>> make_systems() {
    BakeReport& report = outcome_.report;
    std::vector<std::unique_ptr<RadiositySystem>> systems;
    for (int channel = 0; channel < num_ray_channels_; ++channel) {
      const auto on_row = [&](std::uint64_t done, std::uint64_t total) {
        const auto before = total * static_cast<std::uint64_t>(channel);
        progress_.report(BakeStage::kFormFactors, before + done, total * static_cast<std::uint64_t>(num_ray_channels_));
      };
      RADBAKE_ASSIGN_OR_RETURN(auto system, make_radiosity_system(prepared_, options_.seed, channel, on_row, stop_));
      if (num_ray_channels_ > 1) keep_channel(channel, *system);
      report.num_row_rays += system->num_row_rays;
      report.num_light_rays += system->num_light_rays;
      systems.push_back(std::move(system));
    }
    // Of several channels, the report shows the first.
    report.transport = systems.front()->summary;
    const std::vector<Warning>& warnings = systems.front()->warnings;
    report.warnings.insert(report.warnings.end(), warnings.begin(), warnings.end());
    return systems;
  }

  /// What the patches send. Shapes: [patches], lx.
  Result<std::vector<Vec3>> radiosity_of(const RadiositySystem& system) {
    if (system.transport) return solve(system);
    outcome_.report.solver.solver = "none";
    outcome_.report.solver.status = "converged";
    return system.glow;
  }

  /// The system of a channel: the other two become copies of it.
  static void keep_channel(int channel, RadiositySystem& system) {
    for (auto* values : {&system.problem.source, &system.problem.reflectance, &system.glow, &system.direct}) {
      for (Vec3& value : *values) value = Vec3{1, 1, 1} * value[channel];
    }
  }

  /// System -> radiosity, with the report's transport, solver and energy.
  Result<std::vector<Vec3>> solve(const RadiositySystem& system) {
    BakeReport& report = outcome_.report;
    progress_.report(BakeStage::kSolving, 0, 0);
    SolveOptions options;
    options.max_sweeps = max_sweeps_of(report.plan.survey.max_reflectance, options.relative_tolerance);
    options.max_lu_patches = std::numeric_limits<std::size_t>::max();  // never chosen but by name
    std::vector<Vec3> radiosity = system.problem.source;
    const auto show = [this](const auto& view) {
      progress_.report(BakeStage::kSolving, static_cast<std::uint64_t>(view.step.steps), 0,
                       view.step.relative_error_bound);
    };
    // Where all is grey, and where each channel has rows of its own, one stands for three.
    const bool is_grey = report.plan.num_channels == 1 || num_ray_channels_ > 1;
    const Solver solver = report.plan.solver;
    RADBAKE_ASSIGN_OR_RETURN(
        const SolveReport solved,
        is_grey ? solve_grey(solver, *system.transport, system.problem, options, radiosity, show, stop_)
                : radiosity::solve(solver, *system.transport, system.problem, options, radiosity, show, stop_));
    report.solver = {solver_name(solved.solver),
                     solve_status_name(solved.status),
                     solved.sweeps,
                     solved.residual,
                     solved.error_bound,
                     solved.relative_error_bound,
                     options.relative_tolerance,
                     thinned(solved.history)};
    if (stop_.stop_requested() || solved.status == SolveStatus::kCancelled) return cancelled();
    if (solved.status != SolveStatus::kConverged) {
      return internal_error("the solver " + report.solver.solver + " did not converge (" + report.solver.status +
                            " after " + std::to_string(solved.sweeps) + " sweeps, residual " +
                            std::to_string(solved.residual) +
                            " lx): the scene passes on nearly all of its light; lower the largest reflectance, " +
                            std::to_string(report.plan.survey.max_reflectance) + ", or choose another --solver");
    }
    EnergyTerms terms{radiosity, system.problem.reflectance, system.glow, system.direct, system.direct_variances};
    terms.light_flux = system.emitted_lumens;
    // Of a channel by itself the flux of the lights is not known.
    terms.is_closed =
        report.transport.escape_share == 0 && report.transport.absorbed_share == 0 && num_ray_channels_ == 1;
    const EnergyBalance balance = audit_energy(*system.transport, terms);
    report.energy = {balance.is_closed,
                     balance.emitted,
                     balance.absorbed,
                     balance.gap,
                     balance.gap_standard_error,
                     balance.escaped,
                     balance.transported_relative_gap,
                     0};
    return radiosity;
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
