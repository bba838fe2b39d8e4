#include "server/radiosity/bake/bake.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <optional>
#include <string>

#include "common/base/archive.h"
#include "common/base/version.h"
#include "server/radiosity/bake/keep_report.h"
#include "server/radiosity/bake/lightmap_layers.h"
#include "server/radiosity/bake/on_threads.h"
#include "server/radiosity/bake/pass_runner.h"
#include "server/radiosity/bake/pilot.h"
#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/bake/progress_meter.h"
#include "server/radiosity/error/light_error.h"
#include "server/radiosity/plan/pass_plan.h"

namespace radbake::radiosity {
namespace {

Error cancelled() { return {ErrorCode::kCancelled, "the bake was cancelled"}; }

/// One bake, pass after pass, on the threads of the arena that it runs in.
class Bake {
 public:
  Bake(const Scene& scene, Preparation& prepared, ProgressMeter& progress, std::stop_token stop, std::stop_token finish,
       Checkpoints* checkpoints)
      : scene_(scene),
        options_(prepared.options),
        prepared_(prepared),
        surfaces_(prepared.surveyed.surfaces),
        progress_(progress),
        stop_(stop),
        finish_(finish),
        checkpoints_(checkpoints),
        passes_(
            prepared, progress, stop, finish, [this] { return is_over(); }, checkpoints),
        num_first_patches_(prepared.patches.size()) {
    BakeReport& report = outcome_.report;
    report.plan = prepared_.plan;
    report.warnings = prepared_.plan.warnings;
    report.num_patches = prepared_.patches.size();
    report.instruction_set = prepared_.visibility->instruction_set();
  }

  /// Takes up the passes that an earlier attempt kept, where there are any. False: they do not fit, and this object is
  /// of no more use.
  bool resume() {
    if (checkpoints_ == nullptr) return true;
    double edge = prepared_.patch_edge;
    try {
      const std::optional<std::string> bytes = checkpoints_->load(kPassName);
      if (!bytes) return true;
      ArchiveReader archive(*bytes);
      std::string theirs;
      archive(theirs);
      if (theirs != fingerprint()) {
        checkpoints_->warn("the kept passes are of another engine or bake: they are made again");
        return true;
      }
      keep(archive, edge);
      if (!archive.is_at_end()) {
        checkpoints_->warn("the kept passes cannot be read: they are made again");
        return false;
      }
    } catch (const std::bad_alloc&) {
      checkpoints_->warn("no memory to recall the passes: they are made again");
      return false;
    }
    passes_.take_patches(edge, max_refined_patches());
    return true;
  }

  Result<BakeOutcome> run() {
    BakeReport& report = outcome_.report;
    if (is_progressive()) {
      RADBAKE_RETURN_IF_ERROR(refine());
    } else {
      RADBAKE_RETURN_IF_ERROR(run_pass(prepared_.plan.first_pass, {}, 1));
    }
    complete();
    report.stages = progress_.stage_times();
    return std::move(outcome_);
  }

 private:
  bool is_progressive() const { return asks_for_result(options_); }

  /// Passes until the target holds or the time is up.
  Result<void> refine() {
    // A first pass is a third of a bake, or so: nobody knows before it has told its error.
    constexpr double kFirstShare = 0.3;
    const std::vector<PassScale>& replay = options_.replay;
    if (results_.num_passes == 0) {
      const PassScale first = replay.empty() ? first_scale() : replay.front();
      RADBAKE_RETURN_IF_ERROR(run_pass(pass_of(first), first, kFirstShare));
    }
    for (;;) {
      results_.seconds_left =
          options_.time_budget_seconds > 0
              ? std::max(0.0, options_.time_budget_seconds - progress_.seconds() - seconds_to_complete())
              : -1;
      results_.can_refine_patches = 2 * prepared_.patches.size() <= max_refined_patches();
      NextPass next;
      if (!replay.empty()) {
        const auto index = static_cast<std::size_t>(results_.num_passes);
        if (index == replay.size()) return {};
        next.scale = replay[index];
        next.share_of_rest = 1 / static_cast<double>(replay.size() - index);
      } else {
        NoPass no_pass;
        const auto planned = plan_next_pass(results_, options_.max_error, no_pass);
        outcome_.report.error.limited_by = no_pass.limited_by;
        if (!planned) return {};
        next = *planned;
        outcome_.report.error.predicted = next.predicted_error;
      }
      if (!finish_.stop_requested()) {
        if (next.scale.interpolation_limit > 0) {
          passes_.stop_interpolating_above(next.scale.interpolation_limit * mean_irradiance_);
        }
        if (next.scale.refines_patches) refine_patches();
        const double growth = static_cast<double>(prepared_.patches.size()) / static_cast<double>(num_first_patches_);
        RADBAKE_RETURN_IF_ERROR(run_pass(pass_of(next.scale, growth), next.scale, next.share_of_rest));
      }
      if (finish_.stop_requested() || has_ended_early_) {
        outcome_.report.error.limited_by = finish_.stop_requested() ? "stopped" : "time";
        return {};
      }
    }
  }

  /// Whether what was not begun is left out: somebody asked for what there is, or the time is up.
  bool is_over() const {
    return finish_.stop_requested() || (options_.time_budget_seconds > 0 &&
                                        progress_.seconds() > options_.time_budget_seconds - seconds_to_complete());
  }

  void refine_patches() {
    passes_.refine_patches(max_refined_patches());
    outcome_.report.num_patches = prepared_.patches.size();
    results_.gathered_effort = results_.gathered_rays = 0;
  }

  /// What would be gained where texels that interpolation puts off the most gathered alone.
  void look_for_interpolation(const LightError& error) {
    // Second differences of nodes tell it once their noise is not far above what is asked.
    constexpr double kShare = 0.4, kNoise = 1.25, kWorth = 0.05;
    // Where more is off by the patches and by interpolation than is asked, the worst of that goes first.
    const double aim =
        options_.max_error > 0 ? std::max(options_.max_error, error.discretisation) : error.relative_rmse;
    const double limit = kShare * aim;
    results_.refinable_interpolation = results_.interpolation_limit = 0;
    results_.num_refinable_texels = 0;
    results_.num_texels = error.num_receivers;
    if (error.gathered_sampling > kNoise * aim || error.num_receivers == 0) return;
    const LightmapGather::Interpolation above = passes_.interpolation_above(limit * error.mean_irradiance);
    const double square = std::max(0.0, above.squares) / static_cast<double>(error.num_receivers) /
                          (error.mean_irradiance * error.mean_irradiance);
    if (square < kWorth * aim * aim) return;
    results_.refinable_interpolation = std::sqrt(square);
    results_.interpolation_limit = limit;
    results_.num_refinable_texels = above.num_texels;
  }

  /// Smaller than 1 where the first pass might take most of the time budget.
  PassScale first_scale() const {
    if (!(options_.time_budget_seconds > 0)) return {};
    constexpr double kRaySeconds = 0.4e-6;  // a usual host's, with all that belongs to a ray
    constexpr double kMostOfBudget = 0.4, kLeastScale = 0.25;
    const PassSettings one = pass_of({});
    const double rays = static_cast<double>(prepared_.patches.size()) * (one.rays_per_row + one.patch_light_samples) +
                        static_cast<double>(prepared_.plan.num_texels + prepared_.plan.num_vertex_groups) *
                            (one.rays_per_texel + one.light_samples);
    const double seconds = rays * kRaySeconds / std::max(1, tbb::this_task_arena::max_concurrency());
    const double left = options_.time_budget_seconds - progress_.seconds();
    const double scale = std::clamp(kMostOfBudget * left / seconds, kLeastScale, 1.0);
    return {scale, scale};
  }

  std::size_t max_refined_patches() const {
    return static_cast<std::size_t>(options_.max_patches > 0 ? options_.max_patches : kDefaultMaxRefinedPatches);
  }

  /// What row sums and solutions may be off by: well below what sampling leaves, where there are targets. What rows are
  /// off by counts 1 / (1 - rho) times.
  double tolerance() const {
    constexpr double kMost = 1e-3, kShareOfTarget = 0.05;
    const double wanted = options_.max_error > 0 ? std::min(kMost, kShareOfTarget * options_.max_error) : kMost;
    return is_progressive() ? wanted * std::max(1 - prepared_.plan.survey.max_reflectance, 0.01) : 0;
  }

  /// What filling, levelling and writing may take after the last pass, wall seconds.
  double seconds_to_complete() const {
    constexpr double kLeast = 0.03, kPerPixel = 0.3e-6;
    const auto& lightmaps = passes_.lightmaps();
    return kLeast + (lightmaps ? kPerPixel * static_cast<double>(lightmaps->facts().size()) : 0);
  }

  /// The light of the patches, and the light that arrives from them.
  Result<void> run_pass(const PassSettings& settings, const PassScale& scale, double share_of_rest) {
    if (stop_.stop_requested()) return cancelled();
    const int index = results_.num_passes;
    const double began = progress_.seconds();
    const auto num_patches = static_cast<double>(prepared_.patches.num_cells());
    const auto num_receivers = static_cast<double>(prepared_.plan.num_texels + prepared_.plan.num_vertex_groups);
    progress_.begin_pass(index, share_of_rest, num_patches * (settings.rays_per_row + settings.patch_light_samples),
                         num_receivers * (settings.rays_per_texel + settings.light_samples));

    PassSummary summary;
    summary.num_patches = prepared_.patches.size();
    summary.scale = scale;
    summary.rays_per_row = settings.rays_per_row;
    summary.rays_per_texel = settings.rays_per_texel;
    summary.light_samples_per_texel = settings.light_samples;
    RADBAKE_ASSIGN_OR_RETURN(const auto rays, passes_.run({index, settings, tolerance()}, outcome_.report, summary));
    has_ended_early_ = !rays || !summary.is_whole;
    if (!rays) return {};
    results_.gathered_rays += rays->gathered;
    results_.direct_rays += rays->direct;

    const LightError error = passes_.error();
    results_.error = error.relative_rmse;
    results_.direct_sampling = error.direct_sampling;
    results_.gathered_sampling = error.gathered_sampling;
    results_.direct_deviation = passes_.lightmaps() ? error.direct_deviation : 0;
    results_.discretisation = error.discretisation;
    results_.algebraic = error.algebraic;
    mean_irradiance_ = error.mean_irradiance;
    look_for_interpolation(error);
    ++results_.num_passes;
    results_.direct_effort += scale.direct;
    results_.gathered_effort += scale.gathered;
    results_.last_direct_scale = scale.direct;
    results_.last_gathered_scale = scale.gathered;
    results_.last_seconds = progress_.seconds() - began;
    // Of the first pass, which is small; what it needs that is no ray, others need again.
    constexpr double kFixedShare = 0.3;
    if (index == 0) results_.fixed_seconds = kFixedShare * results_.last_seconds;
    summary.relative_rmse = error.relative_rmse;
    summary.interval_low = error.low;
    summary.interval_high = error.high;
    summary.seconds = progress_.seconds();
    summary.cpu_seconds = progress_.cpu_seconds();
    outcome_.report.passes.push_back(summary);
    progress_.end_pass(error.relative_rmse, error.low, error.high);
    if (!has_ended_early_ && is_progressive()) keep_pass();
    return {};
  }

  /// Of what the passes depend on, for one scene and set of options.
  std::string fingerprint() const {
    return std::string("radpass ") + kEngineVersion + ' ' + std::to_string(kArchiveLayout) + ' ' +
           outcome_.report.instruction_set + ' ' + std::to_string(num_first_patches_);
  }

  /// Where the passes stand.
  template <typename Archive>
  void keep(Archive& archive, double& patch_edge) {
    archive(patch_edge);
    archive(results_);
    archive(mean_irradiance_);
    keep_report(archive, outcome_.report);
    passes_.keep(archive);
  }

  template <typename Archive>
  void keep_all(Archive& archive) {
    archive(fingerprint());
    keep(archive, prepared_.patch_edge);
  }

  void keep_pass() {
    if (checkpoints_ == nullptr || progress_.seconds() - kept_at_ < checkpoints_->interval()) return;
    try {
      ArchiveSize size;
      keep_all(size);
      ArchiveWriter archive(size.bytes());
      keep_all(archive);
      checkpoints_->save(kPassName, archive.take());
    } catch (const std::bad_alloc&) {
      return checkpoints_->warn("no memory to keep the passes: another attempt makes them again");
    }
    // The rows of this pass and of those before it have served.
    std::vector<std::string> names;
    for (std::string& name : checkpoints_->names()) {
      if (name.starts_with("rows/")) names.push_back(std::move(name));
    }
    if (!names.empty()) checkpoints_->drop(names);
    kept_at_ = progress_.seconds();
  }

  /// Fills and levels what the passes found, and tells what it is off by.
  void complete() {
    BakeReport& report = outcome_.report;
    const LightError error = passes_.error();
    tell_error(error);
    if (const auto& lightmaps = passes_.lightmaps()) {
      const std::vector<float> errors = standard_errors(*lightmaps);
      tell_worst(find_worst(*lightmaps, errors, error.mean_irradiance), lightmaps->atlas());
      report.energy.mean_irradiance = lightmaps->mean_irradiance();
      report.lightmap =
          append_layers(surfaces_, *lightmaps, {options_.wants_direct, options_.wants_indirect, options_.wants_ao},
                        errors, outcome_.layers);
    }
    GatheredVertices vertices;
    if (passes_.vertices()) vertices = finish_vertices(surfaces_, *prepared_.groups, *passes_.vertices());
    describe_meshes(vertices);
  }

  void tell_error(const LightError& error) {
    ErrorSummary& summary = outcome_.report.error;
    summary.relative_rmse = error.relative_rmse;
    summary.interval_low = error.low;
    summary.interval_high = error.high;
    summary.algebraic = error.algebraic;
    summary.sampling = error.sampling;
    summary.discretisation = error.discretisation;
    summary.asked = options_.max_error;
    summary.is_reached = options_.max_error > 0 && error.relative_rmse <= options_.max_error;
    if (summary.is_reached) summary.limited_by.clear();
    summary.num_texels = error.num_receivers;
  }

  void tell_worst(const WorstPlace& place, const Atlas& atlas) {
    const auto width = static_cast<std::size_t>(atlas.width()), height = static_cast<std::size_t>(atlas.height());
    ErrorSummary::Worst& worst = outcome_.report.error.worst;
    worst.error = place.error;
    worst.lightmap = static_cast<int>(place.texel / width / height);
    worst.x = static_cast<int>(place.texel % width);
    worst.y = static_cast<int>(place.texel / width % height);
    Footprint footprint;
    atlas.footprint(worst.x, static_cast<int>(place.texel / width), footprint);
    if (!footprint.is_empty()) worst.mesh = surfaces_.mesh(footprint.pieces.front().triangle).name;
  }

  void describe_meshes(const GatheredVertices& vertices) {
    BakeReport& report = outcome_.report;
    const Layout* layout = prepared_.atlas ? &prepared_.atlas->layout() : nullptr;
    std::optional<VertexLight> light;
    if (prepared_.groups) {
      light.emplace(VertexLight{*prepared_.groups, vertices.irradiance});
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
  Preparation& prepared_;
  const Surfaces& surfaces_;
  ProgressMeter& progress_;
  static constexpr const char* kPassName = "pass";

  std::stop_token stop_, finish_;
  Checkpoints* const checkpoints_;
  PassRunner passes_;
  const std::size_t num_first_patches_;
  double kept_at_ = 0;  ///< seconds since the bake began
  bool has_ended_early_ = false;
  PassResults results_;
  double mean_irradiance_ = 0;  ///< of the map so far, lx
  BakeOutcome outcome_;
};

}  // namespace

Result<BakeOutcome> bake_scene(const Scene& scene, const BakeOptions& options, BakeObserver& observer,
                               std::stop_token stop, std::stop_token finish, Checkpoints* checkpoints) {
  return on_threads(options.threads, [&]() -> Result<BakeOutcome> {
    const ProgressMeter::Start start;
    observer.on_progress({});
    RADBAKE_ASSIGN_OR_RETURN(const std::unique_ptr<Preparation> prepared, prepare_scene(scene, options, stop));
    Prediction prediction;
    if (!asks_for_result(options))
      prediction = predict_bake(*prepared, process_cpu_seconds() - start.cpu_seconds, stop);
    ProgressMeter progress(observer, start, options.max_error);
    auto bake = std::make_unique<Bake>(scene, *prepared, progress, stop, finish, checkpoints);
    if (!bake->resume()) {
      bake.reset();  // there may be no room for two
      bake = std::make_unique<Bake>(scene, *prepared, progress, stop, finish, checkpoints);
    }
    auto outcome = bake->run();
    if (!outcome.ok()) return outcome;
    outcome->report.prediction = prediction;
    // Small passes take more by the ray than what is predicted by these.
    if (!asks_for_result(options)) outcome->report.costs = measured_costs(outcome->report);
    return outcome;
  });
}

}  // namespace radbake::radiosity
