#include "server/radiosity/bake/bake.h"

#include <tbb/task_arena.h>

#include <algorithm>
#include <optional>

#include "server/radiosity/bake/lightmap_layers.h"
#include "server/radiosity/bake/on_threads.h"
#include "server/radiosity/bake/patch_light.h"
#include "server/radiosity/bake/pilot.h"
#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/bake/progress_meter.h"
#include "server/radiosity/error/light_error.h"
#include "server/radiosity/gather/gather.h"
#include "server/radiosity/gather/gather_vertices.h"
#include "server/radiosity/plan/pass_plan.h"

namespace radbake::radiosity {
namespace {

enum Purpose : std::uint64_t { kReplicate = 71, kPass = 72 };

/// Where texels adapt, the most shadow rays one gets, over the mean.
constexpr int kMostLightSamples = 16;

Error cancelled() { return {ErrorCode::kCancelled, "the bake was cancelled"}; }

/// One bake, pass after pass, on the threads of the arena that it runs in.
class Bake {
 public:
  Bake(const Scene& scene, Preparation& prepared, ProgressMeter& progress, std::stop_token stop, std::stop_token finish)
      : scene_(scene),
        options_(prepared.options),
        prepared_(prepared),
        surfaces_(prepared.surveyed.surfaces),
        progress_(progress),
        stop_(stop),
        finish_(finish) {
    if (prepared.atlas) {
      lightmaps_.emplace(surfaces_, *prepared.atlas, prepared.shadows(), prepared.plan.spacing,
                         options_.wants_direct || options_.wants_indirect, options_.wants_ao);
    }
    if (prepared.groups) vertices_.emplace(surfaces_, *prepared.groups);
  }

  Result<BakeOutcome> run() {
    BakeReport& report = outcome_.report;
    report.plan = prepared_.plan;
    report.warnings = prepared_.plan.warnings;
    report.num_patches = prepared_.patches.size();
    report.instruction_set = prepared_.visibility->instruction_set();

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
    const PassScale first = replay.empty() ? first_scale() : replay.front();
    RADBAKE_RETURN_IF_ERROR(run_pass(pass_of(first), first, kFirstShare));
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
        RADBAKE_RETURN_IF_ERROR(run_pass(pass_of(next.scale), next.scale, next.share_of_rest));
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

  /// Patches half as long a side, and nothing gathered from the larger ones.
  void refine_patches() {
    prepared_.patch_edge /= 2;
    prepared_.patches =
        make_patches(surfaces_, *prepared_.visibility, {prepared_.patch_edge, max_refined_patches(), stop_});
    prepared_.reached_backs = find_reached_backs(surfaces_, prepared_.patches, *prepared_.visibility, stop_);
    twice_as_large_.clear();
    outcome_.report.num_patches = prepared_.patches.size();
    if (lightmaps_) lightmaps_->forget_gathered();
    if (vertices_) vertices_->forget_gathered();
    results_.gathered_effort = results_.gathered_rays = 0;
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
    return kLeast + (lightmaps_ ? kPerPixel * static_cast<double>(lightmaps_->facts().size()) : 0);
  }

  /// The light of the patches, and the light that arrives from them.
  Result<void> run_pass(const PassSettings& settings, const PassScale& scale, double share_of_rest) {
    if (scale.refines_patches) refine_patches();
    if (stop_.stop_requested()) return cancelled();
    const int index = results_.num_passes;
    const double began = progress_.seconds();
    const std::uint64_t seed =
        index == 0 ? options_.seed : seed_of(options_.seed, kPass, static_cast<std::uint64_t>(index));
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
    auto light = solve_replicates(settings, seed, summary);
    if (!light.ok() && light.error().code == ErrorCode::kCancelled && index > 0 && !stop_.stop_requested()) {
      // The time was up before the pass had changed anything.
      has_ended_early_ = true;
      return {};
    }
    if (!light.ok()) return light.error();
    if (!gather(settings, seed, *light, summary)) return cancelled();
    has_ended_early_ = !summary.is_whole;

    const LightError error = current_error();
    results_.error = error.relative_rmse;
    results_.direct_sampling = error.direct_sampling;
    results_.gathered_sampling = error.gathered_sampling;
    results_.direct_deviation = lightmaps_ ? error.direct_deviation : 0;
    results_.discretisation = error.discretisation;
    results_.algebraic = error.algebraic;
    ++results_.num_passes;
    results_.direct_effort += scale.direct;
    results_.gathered_effort += scale.gathered;
    results_.last_direct_scale = scale.direct;
    results_.last_gathered_scale = scale.gathered;
    results_.last_seconds = progress_.seconds() - began;
    summary.relative_rmse = error.relative_rmse;
    summary.interval_low = error.low;
    summary.interval_high = error.high;
    summary.seconds = progress_.seconds();
    summary.cpu_seconds = progress_.cpu_seconds();
    outcome_.report.passes.push_back(summary);
    progress_.end_pass(error.relative_rmse, error.low, error.high);
    return {};
  }

  LightError current_error() const {
    const double algebraic = error_bound_;
    if (lightmaps_) return estimate_error(*lightmaps_, algebraic);
    return estimate_error(
        vertices_->estimate(), [&](std::size_t g) { return vertices_->is_known()[g] != 0; },
        [](std::size_t g) { return g; }, algebraic, vertices_->relative_spread());
  }

  /// The replicates of the patches' light: several where rows are sampled.
  Result<std::vector<PatchLight>> solve_replicates(const PassSettings& settings, std::uint64_t seed,
                                                   PassSummary& summary) {
    // Later passes may be given up while nothing of them shows.
    const bool is_first = results_.num_passes == 0;
    std::stop_source end;
    const std::stop_callback on_stop(stop_, [&] { end.request_stop(); });
    const std::stop_callback on_finish(is_first ? std::stop_token{} : finish_, [&] { end.request_stop(); });
    const std::stop_token stop = end.get_token();
    BakeReport& report = outcome_.report;
    const int num = num_replicates_of(report.plan.form_factors);
    const auto total_num = static_cast<std::uint64_t>(num);
    std::vector<ReplicateSystem> systems;
    for (int r = 0; r < num; ++r) {
      const auto index = static_cast<std::uint64_t>(r);
      const SystemSettings own{seed_of(seed, kReplicate, index), settings.rays_per_row / num,
                               settings.patch_light_samples / num, tolerance()};
      const auto on_row = [&](std::uint64_t done, std::uint64_t total) {
        progress_.report(BakeStage::kFormFactors, total * index + done, total * total_num);
        if (!is_first && is_over()) end.request_stop();
      };
      RADBAKE_ASSIGN_OR_RETURN(ReplicateSystem system, estimate_system(prepared_, own, on_row, stop));
      summary.num_row_rays += system.report.num_row_rays;
      summary.num_light_rays += system.report.num_light_rays;
      systems.push_back(std::move(system));
    }
    progress_.report(BakeStage::kSolving, 0, 0);
    results_.gathered_rays += static_cast<double>(summary.num_row_rays + summary.num_light_rays);
    const auto on_step = [&](std::uint64_t steps, double bound) {
      progress_.report(BakeStage::kSolving, steps, 0, bound);
    };
    std::vector<PatchLight> light;
    for (ReplicateSystem& system : systems) {
      RADBAKE_ASSIGN_OR_RETURN(PatchLight own, solve_patch_light(prepared_, system, on_step, stop));
      own.coarser = averaged(own.radiosity);
      light.push_back(std::move(own));
    }
    error_bound_ = 0;
    for (const ReplicateSystem& system : systems)
      error_bound_ = std::max(error_bound_, system.report.solver.error_bound);
    report.num_row_rays += summary.num_row_rays;
    report.num_light_rays += summary.num_light_rays;
    if (results_.num_passes > 0) return light;
    // Of several replicates and passes, the report shows the first.
    const PatchLightReport& first = systems.front().report;
    report.transport = first.transport;
    report.solver = first.solver;
    report.energy = first.energy;
    report.warnings.insert(report.warnings.end(), first.warnings.begin(), first.warnings.end());
    return light;
  }

  /// What counts as no light: what the solver cannot tell from 0, and a thousandth of what patches send in the mean.
  /// A few rays that slip along a contact bring as much into what is closed.
  double darkness_of(const std::vector<PatchLight>& light) const {
    constexpr double kShare = 1e-3;
    double flux = 0, area = 0;
    for (std::uint32_t patch = 0; patch < light.front().radiosity.size(); ++patch) {
      flux += prepared_.patches.area(patch) * max_component(light.front().radiosity[patch]);
      area += prepared_.patches.area(patch);
    }
    return std::max(error_bound_, area > 0 ? kShare * flux / area : 0);
  }

  /// What patches twice as large would send: the mean of their parts, weighted by area.
  std::vector<Vec3> averaged(const std::vector<Vec3>& radiosity) {
    const Patches& patches = prepared_.patches;
    if (twice_as_large_.empty()) twice_as_large_ = patches.twice_as_large();
    std::vector<Vec3> flux(radiosity.size());
    std::vector<double> area(radiosity.size(), 0);
    for (std::uint32_t patch = 0; patch < radiosity.size(); ++patch) {
      flux[twice_as_large_[patch]] += radiosity[patch] * patches.area(patch);
      area[twice_as_large_[patch]] += patches.area(patch);
    }
    std::vector<Vec3> means;
    means.reserve(radiosity.size());
    for (std::uint32_t patch = 0; patch < radiosity.size(); ++patch) {
      const std::uint32_t larger = twice_as_large_[patch];
      means.push_back(area[larger] > 0 ? flux[larger] / area[larger] : radiosity[patch]);
    }
    return means;
  }

  /// The light of the patches -> one more pass of lightmaps and light by vertex; false when it was stopped.
  bool gather(const PassSettings& settings, std::uint64_t seed, const std::vector<PatchLight>& light,
              PassSummary& summary) {
    std::vector<SentLight> sent;
    for (int r = 0; r < kMaxReplicates; ++r) {
      const PatchLight& own = light[static_cast<std::size_t>(r) % light.size()];
      sent.push_back({own.radiosity, own.glow, own.coarser});
    }
    const bool adapts = lightmaps_ && results_.num_passes > 0;
    const int most_samples = settings.light_samples * (adapts ? kMostLightSamples : 1);
    const DirectLight direct(surfaces_, prepared_.shadows(), most_samples, Environment::Part::kBright);
    const double ao_distance = options_.ao_distance > 0 ? options_.ao_distance : kDefaultAoDistance;
    const auto estimators = [&](int rays) {
      std::vector<HemisphereEstimator> of_channel;
      for (int channel = 0; channel < prepared_.num_ray_channels(); ++channel) {
        of_channel.emplace_back(surfaces_, prepared_.patches, prepared_.visibility->channel(channel), rays,
                                options_.wants_ao ? ao_distance / surfaces_.metres_per_unit : 0, kMaxReplicates);
      }
      return of_channel;
    };
    const std::vector<HemisphereEstimator> of_texels = estimators(settings.rays_per_texel);
    const std::vector<HemisphereEstimator> of_nodes = estimators(settings.rays_per_node);
    const double dark = darkness_of(light);
    const auto scene_of = [&](const std::vector<HemisphereEstimator>& rows) {
      return GatherScene{surfaces_, prepared_.shadows(),        rows[0], direct, sent, surfaces_.sky,
                         seed,      std::span(rows).subspan(1), dark};
    };
    const GatherScene alone = scene_of(of_texels), nodes = scene_of(of_nodes);
    std::vector<std::uint8_t> levels;
    if (adapts) levels = light_levels(*lightmaps_, settings.light_samples, most_samples);

    const std::uint64_t num_receivers = prepared_.plan.num_texels + prepared_.plan.num_vertex_groups;
    progress_.report(BakeStage::kGathering, 0, num_receivers);
    GatherCounts counts;
    if (lightmaps_) {
      const Atlas& atlas = *prepared_.atlas;
      const GatherPass pass{alone, nodes, settings.light_samples, levels, settings.gathered_weight};
      const int index = results_.num_passes;
      summary.is_whole = lightmaps_->add_pass(
          pass,
          [&](const GatheredTile& tile) {
            progress_.tile({tile.sheet, index, tile.x, tile.y, tile.width, tile.height, 4, tile.rgba,
                            lightmap_name(tile.sheet), atlas.width(), atlas.height()});
            progress_.report(BakeStage::kGathering, tile.texels_done, num_receivers);
          },
          stop_, [&] { return index > 0 && is_over(); }, counts);
    }
    if (vertices_) {
      // Few receivers: their rays cost little beside the rows'.
      vertices_->add_pass(
          asks_for_result(options_) ? nodes : alone, settings.light_samples, settings.gathered_weight,
          [&](std::uint64_t done) {
            progress_.report(BakeStage::kGathering, prepared_.plan.num_texels + done, num_receivers);
          },
          stop_, counts);
    }
    if (stop_.stop_requested()) return false;
    summary.num_gather_rays = counts.num_rays;
    summary.num_light_rays += counts.num_light_rays;
    summary.num_gathered = counts.num_gathered;
    outcome_.report.num_gather_rays += counts.num_rays;
    outcome_.report.num_light_rays += counts.num_light_rays;
    results_.gathered_rays += static_cast<double>(counts.num_rays);
    results_.direct_rays += static_cast<double>(counts.num_light_rays);
    return true;
  }

  /// Fills and levels what the passes found, and tells what it is off by.
  void complete() {
    BakeReport& report = outcome_.report;
    const LightError error = current_error();
    tell_error(error);
    if (lightmaps_) {
      const std::vector<float> errors = standard_errors(*lightmaps_);
      tell_worst(find_worst(*lightmaps_, errors, error.mean_irradiance));
      report.energy.mean_irradiance = lightmaps_->mean_irradiance();
      report.lightmap =
          append_layers(surfaces_, *lightmaps_, {options_.wants_direct, options_.wants_indirect, options_.wants_ao},
                        errors, outcome_.layers);
    }
    GatheredVertices vertices;
    if (vertices_) vertices = finish_vertices(surfaces_, *prepared_.groups, *vertices_);
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

  void tell_worst(const WorstPlace& place) {
    const Atlas& atlas = lightmaps_->atlas();
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
  std::stop_token stop_, finish_;
  std::optional<LightmapGather> lightmaps_;
  std::optional<VertexGather> vertices_;
  std::vector<std::uint32_t> twice_as_large_;  ///< [patches]
  bool has_ended_early_ = false;
  double error_bound_ = 0;  ///< of the last pass's solutions, lx
  PassResults results_;
  BakeOutcome outcome_;
};

}  // namespace

Result<BakeOutcome> bake_scene(const Scene& scene, const BakeOptions& options, BakeObserver& observer,
                               std::stop_token stop, std::stop_token finish) {
  return on_threads(options.threads, [&]() -> Result<BakeOutcome> {
    const ProgressMeter::Start start;
    observer.on_progress({});
    RADBAKE_ASSIGN_OR_RETURN(const std::unique_ptr<Preparation> prepared, prepare_scene(scene, options, stop));
    Prediction prediction;
    if (!asks_for_result(options))
      prediction = predict_bake(*prepared, process_cpu_seconds() - start.cpu_seconds, stop);
    ProgressMeter progress(observer, start, options.max_error);
    auto outcome = Bake(scene, *prepared, progress, stop, finish).run();
    if (!outcome.ok()) return outcome;
    outcome->report.prediction = prediction;
    outcome->report.costs = measured_costs(outcome->report);
    return outcome;
  });
}

}  // namespace radbake::radiosity
