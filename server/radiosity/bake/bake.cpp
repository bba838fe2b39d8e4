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
#include "server/radiosity/gather/gather_vertices.h"
#include "server/radiosity/lightmap/level_seams.h"
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

    const DirectLight receiver_direct(surfaces_, visibility, kLightSamplesPerTexel);
    const GatherScene scene{surfaces_, visibility, estimator, receiver_direct, radiosity, scene_.sky, options_.seed};
    if (!gather(scene)) return cancelled();
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
        scene, atlas,
        [&](const GatheredTile& tile) {
          progress_.tile({tile.sheet, 0, tile.x, tile.y, tile.width, tile.height, 4, tile.rgba, layer_name(tile.sheet),
                          atlas.width(), atlas.height()});
          progress_.report(BakeStage::kGathering, tile.texels_done, num_receivers);
        },
        stop_);
    if (map.is_cancelled) return false;
    report.num_gather_rays += map.num_rays;
    report.num_light_rays += map.num_light_rays;
    report.energy.mean_irradiance = map.mean_irradiance;

    LightmapSummary& summary = report.lightmap;
    const auto sheet_texels = static_cast<std::size_t>(atlas.width()) * atlas.height();
    for (int sheet = 0; sheet < atlas.num_sheets(); ++sheet) {
      const std::size_t first = sheet_texels * static_cast<std::size_t>(sheet);
      std::span<float> rgba = std::span(map.rgba).subspan(4 * first, 4 * sheet_texels);
      const FillCounts counts =
          fill_from_neighbours(std::span(map.states).subspan(first, sheet_texels), atlas.width(), kPadding, rgba);
      summary.num_texels_filled += counts.num_filled;
      summary.num_texels_dilated += counts.num_dilated;
    }
    const SeamReport seams = level_seams(surfaces_, atlas.layout(), map.states, map.rgba);
    summary.num_seam_samples = seams.num_samples;
    summary.seam_difference_before = seams.difference_before;
    summary.seam_difference = seams.difference;
    for (int sheet = 0; sheet < atlas.num_sheets(); ++sheet) {
      const auto first = map.rgba.begin() + static_cast<std::ptrdiff_t>(4 * sheet_texels) * sheet;
      outcome_.layers.push_back({layer_name(sheet), "irradiance", "lx", atlas.width(), atlas.height(), 4,
                                 std::vector<float>(first, first + static_cast<std::ptrdiff_t>(4 * sheet_texels))});
    }
    summary.atlas_size = atlas.width();
    summary.atlas_height = atlas.height();
    summary.num_lightmaps = atlas.num_sheets();
    summary.num_texels = atlas.num_texels();
    summary.texels_per_meter = atlas.texels_per_meter();
    summary.fill = atlas.fill();
    summary.num_charts = atlas.layout().num_charts;
    summary.max_stretch = atlas.layout().max_stretch;
    for (const MeshPlacement& mesh : atlas.layout().meshes) {
      summary.num_meshes_kept += mesh.source == UvSource::kKept;
      summary.num_meshes_placed += mesh.source == UvSource::kPlaced;
      summary.num_meshes_unwrapped += mesh.source == UvSource::kUnwrapped;
    }
    return true;
  }

  static std::string layer_name(int sheet) { return "lightmap_" + std::to_string(sheet); }

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
