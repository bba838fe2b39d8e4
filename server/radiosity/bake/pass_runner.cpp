#include "server/radiosity/bake/pass_runner.h"

#include <algorithm>
#include <utility>

#include "server/radiosity/bake/lightmap_layers.h"

namespace radbake::radiosity {
namespace {

enum Purpose : std::uint64_t { kReplicate = 71, kPass = 72 };

/// Where texels adapt, the most shadow rays one gets, over the mean.
constexpr int kMostLightSamples = 16;

/// Of the names of all rows of a pass.
std::string rows_prefix(int pass) { return "rows/" + std::to_string(pass) + '/'; }

Error cancelled() { return {ErrorCode::kCancelled, "the bake was cancelled"}; }

}  // namespace

PassRunner::PassRunner(Preparation& prepared, ProgressMeter& progress, std::stop_token stop, std::stop_token finish,
                       std::function<bool()> is_over, Checkpoints* checkpoints)
    : prepared_(prepared),
      options_(prepared.options),
      surfaces_(prepared.surveyed.surfaces),
      progress_(progress),
      stop_(std::move(stop)),
      finish_(std::move(finish)),
      is_over_(std::move(is_over)),
      checkpoints_(checkpoints) {
  if (prepared.atlas) {
    lightmaps_.emplace(surfaces_, *prepared.atlas, prepared.shadows(), prepared.plan.spacing,
                       options_.wants_direct || options_.wants_indirect, options_.wants_ao);
  }
  if (prepared.groups) vertices_.emplace(surfaces_, *prepared.groups);
}

Result<std::optional<PassRunner::Rays>> PassRunner::run(const Pass& pass, BakeReport& report, PassSummary& summary) {
  const std::uint64_t seed =
      pass.index == 0 ? options_.seed : seed_of(options_.seed, kPass, static_cast<std::uint64_t>(pass.index));
  auto light = solve_replicates(pass, seed, report, summary);
  if (!light.ok() && light.error().code == ErrorCode::kCancelled && pass.index > 0 && !stop_.stop_requested()) {
    return std::optional<Rays>();
  }
  if (!light.ok()) return light.error();
  const auto of_rows = static_cast<double>(summary.num_row_rays + summary.num_light_rays);
  GatherCounts counts;
  if (!gather(pass, seed, *light, counts, summary)) return cancelled();
  report.num_gather_rays += counts.num_rays;
  report.num_light_rays += counts.num_light_rays;
  return std::optional(
      Rays{of_rows + static_cast<double>(counts.num_rays), static_cast<double>(counts.num_light_rays)});
}

void PassRunner::refine_patches(std::size_t max_patches) {
  take_patches(prepared_.patch_edge / 2, max_patches);
  if (lightmaps_) lightmaps_->forget_gathered();
  if (vertices_) vertices_->forget_gathered();
}

void PassRunner::take_patches(double edge, std::size_t max_patches) {
  if (edge == prepared_.patch_edge) return;
  prepared_.patch_edge = edge;
  prepared_.patches = make_patches(surfaces_, *prepared_.visibility, {prepared_.patch_edge, max_patches, stop_});
  prepared_.reached_backs = find_reached_backs(surfaces_, prepared_.patches, *prepared_.visibility, stop_);
  twice_as_large_.clear();
}

LightError PassRunner::error() const {
  if (lightmaps_) return estimate_error(*lightmaps_, error_bound_);
  return estimate_error(
      vertices_->estimate(), [&](std::size_t g) { return vertices_->is_known()[g] != 0; },
      [](std::size_t g) { return g; }, error_bound_, vertices_->relative_spread());
}

/// The replicates of the patches' light: several where rows are sampled.
Result<std::vector<PatchLight>> PassRunner::solve_replicates(const Pass& pass, std::uint64_t seed, BakeReport& report,
                                                             PassSummary& summary) {
  const PassSettings& settings = pass.settings;
  // Later passes may be given up while nothing of them shows.
  const bool is_first = pass.index == 0;
  std::stop_source end;
  const std::stop_callback on_stop(stop_, [&] { end.request_stop(); });
  const std::stop_callback on_finish(is_first ? std::stop_token{} : finish_, [&] { end.request_stop(); });
  const std::stop_token stop = end.get_token();
  const int num = num_replicates_of(report.plan.form_factors);
  const auto total_num = static_cast<std::uint64_t>(num);
  std::vector<ReplicateSystem> systems;
  for (int r = 0; r < num; ++r) {
    const auto index = static_cast<std::uint64_t>(r);
    const SystemSettings own{seed_of(seed, kReplicate, index),
                             settings.rays_per_row / num,
                             settings.patch_light_samples / num,
                             pass.tolerance,
                             checkpoints_,
                             rows_prefix(pass.index) + std::to_string(r) + '/'};
    const auto on_row = [&](std::uint64_t done, std::uint64_t total, bool is_new) {
      if (!is_new) progress_.recall_rows(1 / static_cast<double>(total * total_num));
      progress_.report(BakeStage::kFormFactors, total * index + done, total * total_num);
      if (!is_first && is_over_()) end.request_stop();
    };
    RADBAKE_ASSIGN_OR_RETURN(ReplicateSystem system, estimate_system(prepared_, own, on_row, stop));
    summary.num_row_rays += system.report.num_row_rays;
    summary.num_light_rays += system.report.num_light_rays;
    systems.push_back(std::move(system));
  }
  progress_.report(BakeStage::kSolving, 0, 0);
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
  for (const ReplicateSystem& system : systems) error_bound_ = std::max(error_bound_, system.report.solver.error_bound);
  report.num_row_rays += summary.num_row_rays;
  report.num_light_rays += summary.num_light_rays;
  if (!is_first) return light;
  // Of several replicates and passes, the report shows the first.
  const PatchLightReport& first = systems.front().report;
  report.transport = first.transport;
  report.solver = first.solver;
  report.energy = first.energy;
  report.warnings.insert(report.warnings.end(), first.warnings.begin(), first.warnings.end());
  return light;
}

/// What counts as no light: what the solver cannot tell from 0, and a thousandth of what patches send in the mean.
/// A ray in millions that slips along an edge brings as much into what is closed.
double PassRunner::darkness_of(const std::vector<PatchLight>& light) const {
  constexpr double kShare = 1e-3;
  double flux = 0, area = 0;
  for (std::uint32_t patch = 0; patch < light.front().radiosity.size(); ++patch) {
    flux += prepared_.patches.area(patch) * max_component(light.front().radiosity[patch]);
    area += prepared_.patches.area(patch);
  }
  return std::max(error_bound_, area > 0 ? kShare * flux / area : 0);
}

/// What patches twice as large would send: the mean of their parts, weighted by area.
std::vector<Vec3> PassRunner::averaged(const std::vector<Vec3>& radiosity) {
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
bool PassRunner::gather(const Pass& of, std::uint64_t seed, const std::vector<PatchLight>& light, GatherCounts& counts,
                        PassSummary& summary) {
  const PassSettings& settings = of.settings;
  std::vector<SentLight> sent;
  for (int r = 0; r < kMaxReplicates; ++r) {
    const PatchLight& own = light[static_cast<std::size_t>(r) % light.size()];
    sent.push_back({own.radiosity, own.glow, own.coarser});
  }
  const bool adapts = lightmaps_ && of.index > 0;
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
  if (lightmaps_) {
    const Atlas& atlas = *prepared_.atlas;
    const GatherPass pass{alone, nodes, settings.light_samples, levels, settings.gathered_weight};
    const int index = of.index;
    summary.is_whole = lightmaps_->add_pass(
        pass,
        [&](const GatheredTile& tile) {
          progress_.tile({tile.sheet, index, tile.x, tile.y, tile.width, tile.height, 4, tile.rgba,
                          lightmap_name(tile.sheet), atlas.width(), atlas.height()});
          progress_.report(BakeStage::kGathering, tile.texels_done, num_receivers);
        },
        stop_, [&] { return index > 0 && is_over_(); }, counts);
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
  return true;
}

}  // namespace radbake::radiosity
