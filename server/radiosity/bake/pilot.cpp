#include "server/radiosity/bake/pilot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "server/radiosity/bake/bake_work.h"
#include "server/radiosity/bake/cpu_clock.h"
#include "server/radiosity/bake/radiosity_system.h"
#include "server/radiosity/gather/receive.h"
#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

/// Numbers that keep the pilot's seeds apart from those of the bake.
enum Purpose : std::uint64_t { kSites = 91, kRays = 92, kLight = 93 };

/// What a row or receiver took and had, mean over a run of neighbours.
struct Trial {
  double seconds = 0, light_seconds = 0;
  double rays = 0, light_rays = 0, entries = 0;
  double passed_on = 0;                   ///< reflectance times the share of the row that meets surfaces
  std::vector<std::uint32_t> backs = {};  ///< among the patches that it met
};

constexpr std::array kProperties = {&Trial::seconds,    &Trial::light_seconds, &Trial::rays,
                                    &Trial::light_rays, &Trial::entries,       &Trial::passed_on};

/// The mean of something over trials, with those few left down that were interrupted.
struct Mean {
  double value = 0, error = 0;
};
Mean mean_of(const std::vector<Trial>& trials, const std::function<double(const Trial&)>& property) {
  if (trials.empty()) return {};
  std::vector<double> values;
  for (const Trial& trial : trials) values.push_back(property(trial));
  std::vector<double> sorted = values;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  constexpr double kInterrupted = 8;
  const double limit = kInterrupted * sorted[sorted.size() / 2];
  const auto n = static_cast<double>(values.size());
  double sum = 0, squares = 0;
  for (double& value : values) sum += value = limit > 0 ? std::min(value, limit) : value;
  const double mean = sum / n;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return {mean, n > 1 ? std::sqrt(squares / (n - 1) / n) : mean};
}

/// Item k of a pattern that is spread evenly over n at any length: multiples of the golden section.
std::size_t spread_index(std::size_t k, std::size_t n) {
  constexpr double kGolden = 0.61803398874989485;
  const double place = std::fmod((static_cast<double>(k) + 0.5) * kGolden, 1.0);
  return std::min(static_cast<std::size_t>(place * static_cast<double>(n)), n - 1);
}

/// Neighbours that are tried one after the other: as in a bake, all but the first find in the caches what the one
/// before has read. The first is not counted.
constexpr std::size_t kRun = 4;

/// Tries the run of items at place `index` of the pattern, with try_item(k) -> optional<Trial>. Empty: there were none.
template <typename TryItem>
std::optional<Trial> try_run(std::size_t index, std::size_t num_items, const TryItem& try_item) {
  const std::size_t first = std::min(spread_index(index, num_items), num_items - std::min(num_items, kRun));
  Trial sum;
  int num = 0;
  for (std::size_t k = first; k < std::min(first + kRun, num_items); ++k) {
    const std::optional<Trial> trial = try_item(k);
    if (!trial || (k == first && num_items >= kRun)) continue;
    for (const auto property : kProperties) {
      sum.*property += (*trial).*property;
    }
    sum.backs.insert(sum.backs.end(), trial->backs.begin(), trial->backs.end());
    ++num;
  }
  if (num == 0) return std::nullopt;
  for (const auto property : kProperties) {
    sum.*property /= num;
  }
  return sum;
}

/// Rows and receivers of a prepared scene, one at a time, as its bake makes them.
class Pilot {
 public:
  explicit Pilot(const Preparation& prepared)
      : prepared_(prepared),
        surfaces_(prepared.surveyed.surfaces),
        rows_(surfaces_, prepared.patches, *prepared.visibility, prepared.plan.rays_per_texel, 0, kMaxReplicates),
        patch_light_(surfaces_, prepared.shadows(), kLightSamplesPerPatch),
        texel_light_(surfaces_, prepared.shadows(), kLightSamplesPerTexel, Environment::Part::kBright),
        // Light everywhere: none would take the path of what is sealed.
        radiosity_(prepared.patches.size(), Vec3{1, 1, 1}),
        site_points_(rows_.num_sites()) {
    if (surfaces_.effects.has(Effect::kInterreflection)) {
      row_estimator_ = make_row_estimator(prepared, prepared.plan.rays_per_row, 0);
      sampler_.emplace(surfaces_, prepared.patches, *row_estimator_, patch_light_, prepared.options.seed);
    }
  }

  std::size_t num_rows() const { return sampler_ ? prepared_.patches.num_cells() : 0; }
  std::size_t num_receivers() const {
    return prepared_.atlas ? static_cast<std::size_t>(prepared_.atlas->num_rows()) * prepared_.atlas->width()
                           : prepared_.groups->size();
  }

  Trial try_row(std::size_t index, PatchScratch& scratch) const {
    const auto patch = static_cast<std::uint32_t>(index);
    FormFactorRow row;
    const double start = thread_cpu_seconds();
    sampler_->sample_row(patch, scratch, {}, row);
    const double lit = thread_cpu_seconds();
    const PatchSample sample = sampler_->sample_light(patch, scratch);
    const double end = thread_cpu_seconds();
    Trial trial{end - start, end - lit, static_cast<double>(row.traced), static_cast<double>(sample.light_rays),
                static_cast<double>(row.entries.size())};
    for (const FormFactorRow::Entry& entry : row.entries) {
      if (prepared_.patches.is_back(entry.patch)) trial.backs.push_back(entry.patch);
    }
    if (row.counted > 0) {
      trial.passed_on = mean_component(sample.reflectance + sample.diffuse_transmittance) *
                        (1 - (row.escaped + row.absorbed) / row.counted);
    }
    return trial;
  }

  PatchScratch make_row_scratch() const { return sampler_->make_scratch(); }

  /// Empty: the texel covers nothing.
  std::optional<Trial> try_receiver(std::size_t index, Footprint& footprint, ReceiveScratch& scratch) const {
    const std::vector<SentLight> sent(kMaxReplicates, {radiosity_});
    const GatherScene scene{surfaces_,     prepared_.shadows(),   rows_, texel_light_, sent,
                            surfaces_.sky, prepared_.options.seed};
    const double start = thread_cpu_seconds();
    if (!place_sites(index, footprint, scratch)) return std::nullopt;
    Receiver receiver{index, [&](double u, double v) { return site_at(index, footprint, u, v); }};
    const Reception reception = receive(scene, receiver, seed_of(prepared_.options.seed, kRays, index),
                                        seed_of(prepared_.options.seed, kLight, index), scratch);
    return Trial{thread_cpu_seconds() - start, 0, static_cast<double>(reception.rays),
                 static_cast<double>(reception.light_rays)};
  }

 private:
  bool place_sites(std::size_t index, Footprint& footprint, ReceiveScratch& scratch) const {
    const auto seeds = SobolPoints::seeds_of(seed_of(prepared_.options.seed, kSites, index));
    scratch.sites.clear();
    if (prepared_.atlas) {
      const auto width = static_cast<std::size_t>(prepared_.atlas->width());
      prepared_.atlas->footprint(static_cast<int>(index % width), static_cast<int>(index / width), footprint);
      if (footprint.is_empty()) return false;
    }
    for (int s = 0; s < site_points_.size(); ++s) {
      scratch.sites.push_back(
          site_at(index, footprint, site_points_.coordinate(s, 0, seeds), site_points_.coordinate(s, 1, seeds)));
    }
    return true;
  }

  Site site_at(std::size_t index, const Footprint& footprint, double u, double v) const {
    if (prepared_.atlas) return front_site(surfaces_, footprint.sample(u, v));
    // Somewhere on the first triangle of the vertex: rays cost the same there.
    if (u + v > 1) u = 1 - u, v = 1 - v;
    return front_site(surfaces_, {prepared_.groups->corners[prepared_.groups->first_corner[index]] / 3, u, v});
  }

  const Preparation& prepared_;
  const Surfaces& surfaces_;
  HemisphereEstimator rows_;
  DirectLight patch_light_, texel_light_;
  std::vector<Vec3> radiosity_;
  SobolPoints site_points_;
  std::unique_ptr<RowEstimator> row_estimator_;
  std::optional<PatchSampler> sampler_;
};

/// What the trials so far tell.
struct Sounding {
  std::vector<Trial> rows, receivers;
  double seconds = 0;

  HostCosts costs(const HostCosts& known) const {
    HostCosts found = known;
    const auto value = [](const std::vector<Trial>& trials, double Trial::*property) {
      return mean_of(trials, [=](const Trial& trial) { return trial.*property; }).value;
    };
    const double light_rays = value(rows, &Trial::light_rays);
    if (light_rays > 0) found.light_ray = value(rows, &Trial::light_seconds) / light_rays;
    const double row_rays = value(rows, &Trial::rays), row_seconds = value(rows, &Trial::seconds);
    // What was not told apart goes to the rays, or where there are none to the row.
    const double beside = std::max(0.0, row_seconds - light_rays * found.light_ray);
    found.row = row_rays > 0 ? 0 : beside;
    if (row_rays > 0) found.row_ray = beside / row_rays;
    const double rays = value(receivers, &Trial::rays), shadow_rays = value(receivers, &Trial::light_rays);
    const double seconds = value(receivers, &Trial::seconds);
    found.receiver = 0;
    // A receiver's shadow rays cost no more than a patch's; at least a tenth of its time goes to its other rays.
    constexpr double kLeast = 0.1;
    if (shadow_rays > 0) found.light_ray = std::min(found.light_ray, (1 - kLeast) * seconds / shadow_rays);
    if (rays > 0) found.texel_ray = (seconds - shadow_rays * found.light_ray) / rays;
    return found;
  }
  CostSpread spread() const {
    const auto relative = [](const std::vector<Trial>& trials) {
      const Mean mean = mean_of(trials, [](const Trial& trial) { return trial.seconds; });
      return mean.value > 0 ? mean.error / mean.value : 0;
    };
    return {relative(rows), relative(receivers)};
  }
  /// Backs that the rows of all fronts may meet, from those that a few have met once and twice: a patch has a row of
  /// its own only where another meets it. Source: Chao 1984 (the number of species, bias-corrected).
  double backs_reached() const {
    std::vector<std::uint32_t> met;
    for (const Trial& row : rows) met.insert(met.end(), row.backs.begin(), row.backs.end());
    std::sort(met.begin(), met.end());
    double num = 0, once = 0, twice = 0;
    for (std::size_t i = 0; i < met.size();) {
      const std::size_t begin = i;
      while (i < met.size() && met[i] == met[begin]) ++i;
      ++num;
      once += i - begin == 1 ? 1 : 0;
      twice += i - begin == 2 ? 1 : 0;
    }
    return num + once * (once - 1) / (2 * (twice + 1));
  }
  /// What the work leaves open until it is tried.
  void complete(double num_fronts, BakeWork& work) const {
    const auto mean = [](const std::vector<Trial>& trials, double Trial::*property) {
      return mean_of(trials, [=](const Trial& trial) { return trial.*property; }).value;
    };
    if (!rows.empty()) {
      work.rays_per_row = mean(rows, &Trial::rays);
      work.light_rays_per_row = mean(rows, &Trial::light_rays);
      work.entries_per_row = mean(rows, &Trial::entries);
      work.num_rows = num_fronts + std::min(backs_reached(), work.num_patches - num_fronts);
    }
    if (!receivers.empty()) {
      work.rays_per_receiver = mean(receivers, &Trial::rays);
      work.light_rays_per_receiver = mean(receivers, &Trial::light_rays);
    }
  }
};

/// Tries rows and receivers in growing rounds, on all threads, until they have taken their share of what they predict.
Sounding sound(const Preparation& prepared, const BakeWork& counted, const HostCosts& known,
               const std::stop_token& stop) {
  constexpr std::size_t kFirst = 2, kMost = 2048;
  constexpr double kExact = 0.02;  // standard error over mean: more trials would tell no more than the model
  const double start = process_cpu_seconds();
  const Pilot pilot(prepared);
  Sounding sounding;
  std::size_t next_row = 0, next_receiver = 0;
  for (std::size_t size = kFirst; size <= kMost && !stop.stop_requested(); size *= 2) {
    std::vector<std::optional<Trial>> rows(std::min(size, pilot.num_rows()));
    std::vector<std::optional<Trial>> receivers(std::min(2 * size, pilot.num_receivers()));
    for_each_range(rows.size(), 1, [&](std::size_t begin, std::size_t end) {
      PatchScratch scratch = pilot.make_row_scratch();
      for (std::size_t k = begin; k < end && !stop.stop_requested(); ++k) {
        rows[k] = try_run(next_row + k, pilot.num_rows(),
                          [&](std::size_t row) -> std::optional<Trial> { return pilot.try_row(row, scratch); });
      }
    });
    for_each_range(receivers.size(), 1, [&](std::size_t begin, std::size_t end) {
      Footprint footprint;
      ReceiveScratch scratch;
      for (std::size_t k = begin; k < end && !stop.stop_requested(); ++k) {
        receivers[k] = try_run(next_receiver + k, pilot.num_receivers(),
                               [&](std::size_t receiver) { return pilot.try_receiver(receiver, footprint, scratch); });
      }
    });
    next_row += rows.size();
    next_receiver += receivers.size();
    // The first round finds nothing in the caches: it counts only until there is another.
    if (size == 2 * kFirst) sounding.rows.clear(), sounding.receivers.clear();
    for (const std::optional<Trial>& trial : rows) {
      if (trial) sounding.rows.push_back(*trial);
    }
    for (const std::optional<Trial>& trial : receivers) {
      if (trial) sounding.receivers.push_back(*trial);
    }
    sounding.seconds = process_cpu_seconds() - start;

    // Another round takes about twice of what this one took.
    BakeWork work = counted;
    sounding.complete(static_cast<double>(pilot.num_rows()), work);
    const double whole = total_of(predict_stages(work, sounding.costs(known), {})).cpu_seconds;
    const CostSpread spread = sounding.spread();
    const bool is_exact = sounding.receivers.size() > kFirst && spread.row < kExact && spread.receiver < kExact;
    if (is_exact || 3 * sounding.seconds > std::min(kPilotSeconds, kPilotShare * whole)) break;
  }
  return sounding;
}

}  // namespace

Prediction predict_bake(const Preparation& prepared, double preparing_seconds, const std::stop_token& stop) {
  BakeWork work = count_work(prepared, preparing_seconds);
  const HostCosts known = or_usual(prepared.options.costs);
  CostSpread spread;
  Prediction prediction;
  prediction.source = "stored";
  HostCosts costs = known;
  const bool has_stored = prepared.options.costs.texel_ray > 0;
  if (!has_stored || total_of(predict_stages(work, known, spread)).cpu_seconds >= kNoPilotSeconds) {
    const Sounding sounding = sound(prepared, work, known, stop);
    sounding.complete(static_cast<double>(prepared.patches.num_cells()), work);
    costs = sounding.costs(known);
    spread = sounding.spread();
    prediction.source = "pilot";
    prediction.pilot_seconds = sounding.seconds;
  }
  work.preparing_seconds += prediction.pilot_seconds;
  prediction.stages = predict_stages(work, costs, spread);
  prediction.total = total_of(prediction.stages);
  prediction.costliest = costliest_meshes(prepared, work, costs);
  prediction.effects = seconds_by_effect(prepared, work, costs);
  return prediction;
}

HostCosts measured_costs(const BakeReport& report) {
  HostCosts costs;
  const auto seconds_of = [&](const char* name) {
    for (const StageTime& stage : report.stages) {
      if (stage.stage == name) return stage.cpu_seconds;
    }
    return 0.0;
  };
  const double rows = seconds_of("form_factors"), texels = seconds_of("gathering"), solve = seconds_of("solving");
  const auto num_row_rays = static_cast<double>(report.num_row_rays);
  const auto num_texel_rays = static_cast<double>(report.num_gather_rays);

  // Share the shadow rays out as they were asked for; in the gather a ray is a ray.
  const BakePlan& plan = report.plan;
  const double of_rows = num_row_rays > 0 ? static_cast<double>(plan.num_patches) * kLightSamplesPerPatch : 0;
  const double of_texels = static_cast<double>(plan.num_texels + plan.num_vertex_groups) * kLightSamplesPerTexel;
  const double num_light_rays = static_cast<double>(report.num_light_rays) / std::max(of_rows + of_texels, 1.0);
  if (num_texel_rays > 0) {
    costs.texel_ray = costs.light_ray = texels / (num_texel_rays + num_light_rays * of_texels);
  }
  if (num_row_rays > 0) {
    const double beside = num_light_rays * of_rows * costs.light_ray +
                          static_cast<double>(report.transport.num_entries) / 2 * kUsualCosts.entry;
    costs.row_ray = std::max(rows - beside, rows / 4) / num_row_rays;
  }
  const double steps = report.solver.sweeps * static_cast<double>(report.transport.num_entries);
  if (steps > 0 && plan.transport != Transport::kStreamed) {
    costs.entry_step = solve / steps / (plan.num_channels > 1 ? 1 : kOneChannelShare);
  }
  return costs;
}

}  // namespace radbake::radiosity
