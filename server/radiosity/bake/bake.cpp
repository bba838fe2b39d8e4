#include "server/radiosity/bake/bake.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <numbers>
#include <optional>
#include <thread>

#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/bake/progress_meter.h"
#include "server/radiosity/error/energy.h"
#include "server/radiosity/form_factor/patch_rows.h"
#include "server/radiosity/gather/gather.h"
#include "server/radiosity/solve/solve.h"
#include "server/radiosity/transport/sparse_operator.h"

namespace radbake::radiosity {
namespace {

constexpr int kPadding = 2;  ///< texels around charts that get their neighbours' mean

Error cancelled() { return {ErrorCode::kCancelled, "the bake was cancelled"}; }

/// The rows of all patches as counts, areas in metres.
SampledRows collected_rows(const Patches& patches, double square_metres, std::vector<PatchRow>& rows) {
  SampledRows sampled;
  const std::size_t n = rows.size();
  sampled.first.assign(1, 0);
  for (std::uint32_t i = 0; i < n; ++i) {
    for (const PatchRow::Entry& entry : rows[i].entries) sampled.entries.push_back({entry.patch, entry.count});
    sampled.first.push_back(sampled.entries.size());
    sampled.counted.push_back(rows[i].counted);
    sampled.escaped.push_back(rows[i].escaped);
    sampled.absorbed.push_back(rows[i].absorbed);
    sampled.areas.push_back(rows[i].counted > 0 ? patches.area(i) * rows[i].visible_share * square_metres : 0);
    rows[i].entries = {};
  }
  return sampled;
}

/// The light on each patch and what it does with it. Shapes: all [patches].
struct PatchLight {
  RadiosityProblem problem;
  std::vector<Vec3> glow, direct;
  std::vector<double> direct_variances;
};

PatchLight patch_light(const std::vector<PatchRow>& rows, Vec3 sky) {
  PatchLight light;
  for (const PatchRow& row : rows) {
    // The sky's part: what of the row escaped sees it.
    const Vec3 from_sky = row.counted > 0 ? sky * (std::numbers::pi * row.escaped / row.counted) : Vec3{};
    const Vec3 direct = row.direct + from_sky;
    light.problem.source.push_back(row.glow + scaled_by(row.reflectance, direct));
    light.problem.reflectance.push_back(row.reflectance);
    light.glow.push_back(row.glow);
    light.direct.push_back(direct);
    light.direct_variances.push_back(row.direct_variance);
  }
  return light;
}

TransportSummary summary_of(const TransportRepair& repair) {
  return {repair.num_entries,          repair.raw_reciprocity_rms,    repair.raw_closure_max,
          repair.paired_row_error_rms, repair.repaired_row_error_max, repair.scaling_sweeps,
          repair.escape_share,         repair.absorbed_share};
}

/// One bake, stage after stage, on the threads of the arena that it runs in.
class Bake {
 public:
  Bake(const Scene& scene, const BakeOptions& options, const Preparation& prepared, ProgressMeter& progress,
       std::stop_token stop)
      : scene_(scene),
        options_(options),
        prepared_(prepared),
        surfaces_(prepared.surveyed.surfaces),
        progress_(progress),
        stop_(stop) {}

  Result<BakeOutcome> run() {
    outcome_.report.plan = prepared_.plan;
    outcome_.report.warnings = prepared_.plan.warnings;
    outcome_.report.num_patches = prepared_.patches.size();

    const Visibility& visibility = *prepared_.visibility;
    outcome_.report.instruction_set = visibility.instruction_set();
    const HemisphereEstimator estimator(surfaces_, prepared_.patches, visibility, prepared_.plan.rays_per_row);
    const DirectLight patch_direct(surfaces_, visibility, kLightSamplesPerPatch);

    std::vector<PatchRow> rows = sample_patch_rows(
        surfaces_, prepared_.patches, estimator, patch_direct, options_.seed,
        [this](std::uint64_t done, std::uint64_t total) { progress_.report(BakeStage::kFormFactors, done, total); },
        stop_);
    if (stop_.stop_requested()) return cancelled();
    RADBAKE_ASSIGN_OR_RETURN(const std::vector<Vec3> radiosity, solve(rows, patch_direct.emitted_lumens()));
    rows = {};

    const DirectLight texel_direct(surfaces_, visibility, kLightSamplesPerTexel);
    if (!gather(estimator, texel_direct, radiosity)) return cancelled();
    outcome_.report.stages = progress_.stage_times();
    return std::move(outcome_);
  }

 private:
  /// Rows -> operator -> radiosity, with the report's transport, solver and energy.
  Result<std::vector<Vec3>> solve(std::vector<PatchRow>& rows, double light_flux) {
    BakeReport& report = outcome_.report;
    progress_.report(BakeStage::kSolving, 0, 0);
    for (const PatchRow& row : rows) {
      report.num_row_rays += row.traced;
      report.num_light_rays += row.light_rays;
    }
    const double square_metres = surfaces_.metres_per_unit * surfaces_.metres_per_unit;
    const SparseOperator transport(collected_rows(prepared_.patches, square_metres, rows));
    report.transport = summary_of(transport.repair());

    const PatchLight light = patch_light(rows, scene_.sky);
    std::vector<Vec3> radiosity = light.problem.source;
    const SolveOptions options;
    const SolveReport solved = solve_gauss_seidel(
        transport, light.problem, options, radiosity,
        [this](int sweep, double bound) { progress_.report(BakeStage::kSolving, sweep, 0, bound); }, stop_);
    report.solver = {"gauss-seidel",
                     solve_status_name(solved.status),
                     solved.sweeps,
                     solved.residual,
                     solved.error_bound,
                     solved.relative_error_bound,
                     options.relative_tolerance};
    if (solved.status == SolveStatus::kCancelled) return cancelled();
    if (solved.status != SolveStatus::kConverged) {
      return internal_error("the solver did not converge (" + report.solver.status + " after " +
                            std::to_string(solved.sweeps) + " sweeps, residual " + std::to_string(solved.residual) +
                            " lx): the scene passes on nearly all of its light; lower the largest reflectance, " +
                            std::to_string(report.plan.survey.max_reflectance));
    }
    EnergyTerms terms{radiosity, light.problem.reflectance, light.glow, light.direct, light.direct_variances};
    terms.light_flux = light_flux;
    terms.is_closed = report.transport.escape_share == 0 && report.transport.absorbed_share == 0;
    const EnergyBalance balance = audit_energy(transport, terms);
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

  /// Radiosity -> lightmap; false when it was stopped.
  bool gather(const HemisphereEstimator& estimator, const DirectLight& direct, std::span<const Vec3> radiosity) {
    BakeReport& report = outcome_.report;
    const std::uint64_t num_texels = prepared_.plan.num_texels;
    progress_.report(BakeStage::kGathering, 0, num_texels);
    const GatherScene scene{surfaces_, prepared_.atlas, estimator, direct, radiosity, scene_.sky, options_.seed};
    GatheredMap map = gather_lightmap(
        scene,
        [&](const GatheredTile& tile) {
          progress_.tile({0, 0, tile.x, tile.y, tile.width, tile.height, 4, tile.rgba, "lightmap_0",
                          prepared_.atlas.size(), prepared_.atlas.size()});
          progress_.report(BakeStage::kGathering, tile.texels_done, num_texels);
        },
        stop_);
    if (map.is_cancelled) return false;
    report.num_gather_rays = map.num_rays;
    report.num_light_rays += map.num_light_rays;
    report.energy.mean_irradiance = map.mean_irradiance;

    const int size = prepared_.atlas.size();
    const FillCounts counts = fill_from_neighbours(map.states, size, kPadding, map.rgba);
    report.lightmap = {size, num_texels, counts.num_filled, counts.num_dilated, prepared_.atlas.texels_per_meter()};
    outcome_.layers.push_back({"lightmap_0", "irradiance", "lx", size, size, 4, std::move(map.rgba)});
    return true;
  }

  const Scene& scene_;
  const BakeOptions& options_;
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
  return static_cast<double>(plan.num_texels) * (plan.rays_per_texel + plan.light_samples_per_texel);
}

}  // namespace

Result<BakeOutcome> bake_scene(const Scene& scene, const BakeOptions& options, BakeObserver& observer,
                               std::stop_token stop) {
  const int threads = options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());
  // An arena of more threads than cores is allowed: results do not depend on the number.
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  std::optional<Result<BakeOutcome>> outcome;
  arena.execute([&] {
    const auto start = ProgressMeter::Clock::now();
    observer.on_progress({});
    auto prepared = prepare_scene(scene, options, stop);
    if (!prepared.ok()) {
      outcome.emplace(prepared.error());
      return;
    }
    const Preparation& ready = **prepared;
    ProgressMeter progress(observer, start, row_rays(ready.plan, ready.patches), gather_rays(ready.plan));
    outcome.emplace(Bake(scene, options, ready, progress, stop).run());
  });
  return std::move(*outcome);
}

}  // namespace radbake::radiosity
