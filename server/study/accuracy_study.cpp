#include "server/study/accuracy_study.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <ctime>
#include <map>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "client/image/map_difference.h"
#include "server/radiosity/plan/pass_plan.h"

namespace radbake::study {
namespace {

/// Equal bakes of one setting: as many as fit in this time, from one to the most.
constexpr double kTimedSeconds = 2;
constexpr int kMaxTimedRuns = 3;
constexpr double kNoLimitSeconds = 1e6;

/// The middle of the ranges, which one axis at a time leaves.
constexpr int kMiddleRays = 256, kMiddleSpacing = 4, kMiddleLightSamples = 64;
/// So that elimination and all form factors by formula take part.
constexpr int kPatchesOfMethods = 1000;

/// Every pair of patches has its price by formula: minutes above.
constexpr std::uint64_t kMaxPatchesByFormula = 2000;
/// And every triangle that may hide something of a pair: one pair may take minutes above.
constexpr std::uint64_t kMaxTrianglesByFormula = 2000;

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

bool is_by_formula(radiosity::FormFactors method) {
  return method == radiosity::FormFactors::kAnalytic || method == radiosity::FormFactors::kAdaptive;
}

std::uint64_t num_triangles(const Scene& scene) {
  std::uint64_t num = 0;
  for (const Mesh& mesh : scene.meshes) num += mesh.triangles.size();
  return num;
}

bool is_layer(const std::string& layer, const std::string& start) {
  return layer.rfind(start, 0) == 0 && layer.find_first_not_of("0123456789", start.size()) == std::string::npos;
}
bool is_lightmap(const std::string& layer) { return is_layer(layer, "lightmap_"); }

/// Sheets of one kind, one below the other, with a row between them that nothing covers.
image::Pixels stacked_layers(const std::vector<radiosity::Layer>& layers, const std::string& start) {
  image::Pixels stack;
  for (const radiosity::Layer& layer : layers) {
    if (!is_layer(layer.name, start)) continue;
    if (stack.height > 0) {
      stack.values.insert(stack.values.end(), std::size_t(stack.width) * std::size_t(stack.channels), 0.0F);
      ++stack.height;
    }
    stack.width = layer.width;
    stack.height += layer.height;
    stack.channels = layer.channels;
    stack.values.insert(stack.values.end(), layer.values.begin(), layer.values.end());
  }
  return stack;
}

/// Takes the coverage from texels where another image has none.
void uncover(const image::Pixels& other, image::Pixels& map) {
  for (std::size_t k = 3; k < map.values.size() && k < other.values.size(); k += 4) {
    if (other.values[k] == 0) map.values[k] = 0;
  }
}

/// Keeps the lightmaps as each pass leaves them.
class PassRecorder final : public radiosity::BakeObserver {
 public:
  void on_progress(const radiosity::BakeProgress&) override {}

  void on_tile(const radiosity::Tile& tile) override {
    if (!is_lightmap(tile.layer_name)) return;
    if (tile.pass != pass_) {
      maps_.push_back(stacked());
      pass_ = tile.pass;
    }
    radiosity::Layer& layer = sheets_[tile.layer_name];
    if (layer.values.empty()) {
      layer = {tile.layer_name, "", "", tile.layer_width, tile.layer_height, tile.channels, {}};
      layer.values.resize(std::size_t(layer.width) * std::size_t(layer.height) * std::size_t(layer.channels));
    }
    const auto row = std::size_t(tile.width) * std::size_t(tile.channels);
    for (int y = 0; y < tile.height; ++y) {
      const std::size_t at =
          (std::size_t(tile.y + y) * std::size_t(layer.width) + std::size_t(tile.x)) * std::size_t(layer.channels);
      std::copy_n(tile.values.begin() + std::ptrdiff_t(std::size_t(y) * row), row,
                  layer.values.begin() + std::ptrdiff_t(at));
    }
  }

  /// Of all passes but the last, which the bake itself returns.
  const std::vector<image::Pixels>& maps() const { return maps_; }

 private:
  image::Pixels stacked() const {
    std::vector<radiosity::Layer> layers;
    for (std::size_t k = 0; k < sheets_.size(); ++k) layers.push_back(sheets_.at("lightmap_" + std::to_string(k)));
    return stacked_lightmaps(layers);
  }

  int pass_ = 0;
  std::map<std::string, radiosity::Layer> sheets_;
  std::vector<image::Pixels> maps_;
};

/// A bake and what it took.
struct MeasuredBake {
  radiosity::BakeOutcome outcome;
  std::vector<image::Pixels> passes;  ///< maps of all passes but the last
  double cpu_seconds = 0, seconds = 0;
};

/// Requests a stop when the time is up, unless it goes away before.
class TimeLimit {
 public:
  explicit TimeLimit(double seconds)
      : thread_([this, seconds](const std::stop_token& done) {
          std::unique_lock lock(mutex_);
          wake_.wait_for(lock, done, std::chrono::duration<double>(seconds), [] { return false; });
          if (!done.stop_requested()) bake_.request_stop();
        }) {}

  std::stop_token token() const { return bake_.get_token(); }
  bool is_over() const { return bake_.stop_requested(); }

 private:
  std::stop_source bake_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;  // last: it uses the others
};

Result<MeasuredBake> bake_once(const Scene& scene, const radiosity::BakeOptions& options,
                               double limit_seconds = kNoLimitSeconds) {
  using Clock = std::chrono::steady_clock;
  PassRecorder recorder;
  const auto start = Clock::now();
  const double cpu = cpu_seconds();
  const TimeLimit limit(limit_seconds);
  auto baked = radiosity::bake_scene(scene, options, recorder, limit.token());
  if (!baked.ok() && limit.is_over()) {
    char text[60];
    std::snprintf(text, sizeof text, "it took more than %g s", limit_seconds);
    return Error{ErrorCode::kCancelled, text};
  }
  RADBAKE_ASSIGN_OR_RETURN(radiosity::BakeOutcome outcome, std::move(baked));
  return MeasuredBake{std::move(outcome), recorder.maps(), cpu_seconds() - cpu,
                      std::chrono::duration<double>(Clock::now() - start).count()};
}

/// Bakes again and again, to equal maps, and keeps the cheapest.
Result<MeasuredBake> bake_cheapest(const Scene& scene, const radiosity::BakeOptions& options, double limit_seconds) {
  RADBAKE_ASSIGN_OR_RETURN(MeasuredBake cheapest, bake_once(scene, options, limit_seconds));
  double total = cheapest.seconds;
  for (int run = 1; run < kMaxTimedRuns && total < kTimedSeconds; ++run) {
    RADBAKE_ASSIGN_OR_RETURN(MeasuredBake again, bake_once(scene, options));
    total += again.seconds;
    if (again.cpu_seconds < cheapest.cpu_seconds) cheapest = std::move(again);
  }
  return cheapest;
}

/// Measures maps against the reference, over the same texels each time.
class Ruler {
 public:
  explicit Ruler(const AccuracyReference& reference)
      : reference_(reference), mask_(image::comparable_texels(reference.map, reference.is_ours)) {}

  Result<void> measure(const image::Pixels& map, AccuracyPoint& point) const {
    RADBAKE_ASSIGN_OR_RETURN(const image::MapDifference difference, image::compare_maps({reference_.map, map}, mask_));
    point.difference = difference.relative_rmse;
    const double square = point.difference * point.difference - reference_.error * reference_.error;
    point.error = std::sqrt(std::max(square, 0.0));
    return {};
  }

  std::uint64_t num_texels() const {
    return static_cast<std::uint64_t>(std::count(mask_.begin(), mask_.end(), std::uint8_t{1}));
  }

 private:
  const AccuracyReference& reference_;
  std::vector<std::uint8_t> mask_;
};

Result<AccuracyRun> measured_run(const Ruler& ruler, const MeasuredBake& bake) {
  const radiosity::BakeReport& report = bake.outcome.report;
  AccuracyRun run;
  for (std::size_t k = 0; k < bake.passes.size() && k < report.passes.size(); ++k) {
    const radiosity::PassSummary& pass = report.passes[k];
    AccuracyPoint point{pass.cpu_seconds, pass.seconds, 0, 0, pass.relative_rmse};
    RADBAKE_RETURN_IF_ERROR(ruler.measure(bake.passes[k], point));
    run.points.push_back(point);
  }
  AccuracyPoint last{bake.cpu_seconds, bake.seconds, 0, 0, report.error.relative_rmse};
  RADBAKE_RETURN_IF_ERROR(ruler.measure(stacked_lightmaps(bake.outcome.layers), last));
  run.points.push_back(last);
  return run;
}

}  // namespace

const char* accuracy_axis_name(AccuracyAxis axis) {
  switch (axis) {
    case AccuracyAxis::kRays: return "rays";
    case AccuracyAxis::kInterpolatedRays: return "interpolated_rays";
    case AccuracyAxis::kSpacing: return "spacing";
    case AccuracyAxis::kLightSamples: return "light_samples";
    case AccuracyAxis::kPatches: return "max_patches";
    case AccuracyAxis::kFormFactors: return "form_factors";
    case AccuracyAxis::kSolver: return "solver";
    case AccuracyAxis::kBalanced: return "balanced";
  }
  return "unknown";
}

AccuracySweep default_sweep(const radiosity::BakeOptions& base) {
  AccuracySweep sweep{base, {}, {}, {}};
  sweep.base.rays = sweep.base.light_samples = sweep.base.spacing = 0;
  sweep.base.max_error = sweep.base.time_budget_seconds = 0;
  radiosity::BakeOptions middle = sweep.base;
  middle.rays = kMiddleRays;
  middle.spacing = kMiddleSpacing;
  middle.light_samples = kMiddleLightSamples;
  const auto add = [&](AccuracyAxis axis, const std::string& value, const auto& change) {
    radiosity::BakeOptions options = middle;
    change(options);
    sweep.settings.push_back({axis, value, std::move(options)});
  };

  for (const int rays : {16, 64, 256, 1024}) {
    add(AccuracyAxis::kRays, std::to_string(rays), [&](auto& o) { o.rays = rays, o.spacing = 1; });
  }
  for (const int rays : {16, 64, 256, 1024, 4096}) {
    add(AccuracyAxis::kInterpolatedRays, std::to_string(rays), [&](auto& o) { o.rays = rays; });
  }
  for (const int spacing : {1, 2, 4, 8}) {
    add(AccuracyAxis::kSpacing, std::to_string(spacing), [&](auto& o) { o.spacing = spacing; });
  }
  for (const int samples : {4, 16, 64, 256, 1024}) {
    add(AccuracyAxis::kLightSamples, std::to_string(samples), [&](auto& o) { o.light_samples = samples; });
  }
  for (const int patches : {250, 1000, 4000, 16000}) {
    add(AccuracyAxis::kPatches, std::to_string(patches), [&](auto& o) { o.max_patches = patches; });
  }
  using radiosity::FormFactors;
  for (const FormFactors method :
       {FormFactors::kHemisphere, FormFactors::kHemicube, FormFactors::kAdaptive, FormFactors::kAnalytic}) {
    add(AccuracyAxis::kFormFactors, radiosity::form_factors_name(method),
        [&](auto& o) { o.form_factors = method, o.max_patches = kPatchesOfMethods; });
  }
  for (const radiosity::Solver solver : radiosity::kAllSolvers) {
    add(AccuracyAxis::kSolver, radiosity::solver_name(solver),
        [&](auto& o) { o.solver = solver, o.max_patches = kPatchesOfMethods; });
  }
  for (int rays = 16, samples = 4; rays <= 4096; rays *= 2, samples *= 2) {
    add(AccuracyAxis::kBalanced, std::to_string(rays), [&](auto& o) { o.rays = rays, o.light_samples = samples; });
  }
  sweep.targets = {0.10, 0.05, 0.02, 0.01};
  sweep.budgets = {1, 5, 20};
  return sweep;
}

image::Pixels stacked_lightmaps(const std::vector<radiosity::Layer>& layers) {
  return stacked_layers(layers, "lightmap_");
}

Result<AccuracyReference> make_reference(const Scene& scene, const radiosity::BakeOptions& base,
                                         const ReferenceEffort& effort) {
  radiosity::BakeOptions options = base;
  options.rays = options.light_samples = 0;
  options.max_patches = effort.max_patches;
  options.spacing = 1;
  options.form_factors = radiosity::FormFactors::kAdaptive;
  options.solver = radiosity::Solver::kKrylov;
  options.max_error = options.time_budget_seconds = 0;
  constexpr std::uint64_t kRefined = 16;  // patches in the place of one
  const auto by_formula = radiosity::plan_scene(scene, options);
  const auto most = static_cast<std::uint64_t>(effort.max_patches);
  if (!by_formula.ok() || std::min(kRefined * by_formula->plan.num_patches, most) > kMaxPatchesByFormula) {
    options.form_factors = radiosity::FormFactors::kHemicube;
  }
  // A small pass, and a large one with patches of a quarter of the side.
  const radiosity::PassSettings one = radiosity::pass_of({});
  const double rays = static_cast<double>(effort.rays) / one.rays_per_texel;
  const double samples = static_cast<double>(effort.light_samples) / one.light_samples;
  options.replay = {{1, 1, false}, {1, 1, true}, {rays, samples, true}};
  AccuracyReference reference;
  image::Pixels maps[2];
  for (const std::uint64_t half : {std::uint64_t{0}, std::uint64_t{1}}) {
    // Not the seeds of what is measured.
    options.seed = base.seed + 1000003 * (half + 1);
    RADBAKE_ASSIGN_OR_RETURN(const MeasuredBake bake, bake_once(scene, options));
    maps[half] = stacked_lightmaps(bake.outcome.layers);
    // Filled texels and emitters have no error of their own.
    uncover(stacked_layers(bake.outcome.layers, "error_"), maps[half]);
    reference.cpu_seconds += bake.cpu_seconds;
  }
  reference.map = maps[0];
  for (std::size_t k = 0; k < reference.map.values.size(); ++k) {
    reference.map.values[k] = (maps[0].values[k] + maps[1].values[k]) / 2;
  }
  for (const image::Pixels& map : maps) uncover(map, reference.map);
  const auto mask = image::comparable_texels(reference.map, true);
  // rms(a - b) / 2 = rms(a - (a + b) / 2).
  RADBAKE_ASSIGN_OR_RETURN(const image::MapDifference half, image::compare_maps({reference.map, maps[0]}, mask));
  reference.error = half.relative_rmse;
  char text[400];
  std::snprintf(text, sizeof text,
                "the mean of two bakes with other seeds, of %d rays and %d light samples at every texel, patches of a "
                "quarter of the usual side and at most %d, form factors `%s` and solver `krylov`",
                effort.rays, effort.light_samples, effort.max_patches,
                radiosity::form_factors_name(options.form_factors));
  reference.origin = text;
  return reference;
}

Result<AccuracyStudy> study_accuracy(const Scene& scene, const AccuracySweep& sweep, AccuracyReference reference,
                                     const std::function<void(std::size_t, std::size_t, const std::string&)>& on_bake) {
  AccuracyStudy study;
  study.reference = std::move(reference);
  const Ruler ruler(study.reference);
  study.num_compared = ruler.num_texels();
  const std::size_t total = sweep.settings.size() + sweep.targets.size() + sweep.budgets.size();
  std::size_t done = 0;

  const auto run_one = [&](const radiosity::BakeOptions& options, const std::string& what,
                           AccuracyRun label) -> Result<void> {
    on_bake(done++, total, what);
    // What fits into a budget is not the same again.
    const auto bake =
        label.budget > 0 ? bake_once(scene, options) : bake_cheapest(scene, options, sweep.bake_limit_seconds);
    if (!bake.ok()) {
      study.left_out.push_back(what + ": " + bake.error().message);
      return {};
    }
    RADBAKE_ASSIGN_OR_RETURN(AccuracyRun run, measured_run(ruler, *bake));
    label.points = std::move(run.points);
    study.runs.push_back(std::move(label));
    study.num_texels = bake->outcome.report.lightmap.num_texels;
    study.instruction_set = bake->outcome.report.instruction_set;
    study.threads = options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());
    return {};
  };
  for (const FixedSetting& fixed : sweep.settings) {
    if (is_by_formula(fixed.options.form_factors) && num_triangles(scene) > kMaxTrianglesByFormula) {
      on_bake(done++, total, setting_words(fixed.options));
      study.left_out.push_back(setting_words(fixed.options) + ": by formula, a scene of " +
                               std::to_string(num_triangles(scene)) + " triangles takes hours");
      continue;
    }
    RADBAKE_RETURN_IF_ERROR(run_one(fixed.options, setting_words(fixed.options), {fixed, 0, 0, {}}));
  }
  const auto run_progressive = [&](double target, double budget) {
    radiosity::BakeOptions options = sweep.base;
    options.max_error = target;
    options.time_budget_seconds = budget;
    char what[60];
    std::snprintf(what, sizeof what, budget > 0 ? "progressive, for %g s" : "progressive, to %g %%",
                  budget > 0 ? budget : 100 * target);
    return run_one(options, what, {std::nullopt, target, budget, {}});
  };
  for (const double target : sweep.targets) RADBAKE_RETURN_IF_ERROR(run_progressive(target, 0));
  for (const double budget : sweep.budgets) RADBAKE_RETURN_IF_ERROR(run_progressive(0, budget));
  if (study.runs.empty()) return invalid_argument("no setting could be baked; the first: " + study.left_out.front());
  return study;
}

std::string setting_words(const radiosity::BakeOptions& options) {
  std::string words = "rays " + std::to_string(options.rays);
  if (options.spacing == 1) words += ", every texel";
  if (options.spacing > 1) words += ", spacing " + std::to_string(options.spacing);
  words += ", " + std::to_string(options.light_samples) + " light samples";
  if (options.max_patches > 0) words += ", max " + std::to_string(options.max_patches) + " patches";
  if (options.form_factors != radiosity::FormFactors::kAuto) {
    words += std::string(", ") + radiosity::form_factors_name(options.form_factors);
  }
  if (options.solver) words += std::string(", ") + radiosity::solver_name(*options.solver);
  return words;
}

}  // namespace radbake::study
