#include "tests/unit/worker/fake_bake.h"

#include <chrono>
#include <new>
#include <thread>

#include "server/radiosity/bake/bake.h"

namespace radbake {

std::atomic<int> num_fake_tiles;
std::atomic<bool> fake_saw_stop;
std::atomic<double> fake_time_budget_seconds;

namespace radiosity {
namespace {

using namespace std::chrono_literals;

BakePlan fake_plan(const Scene& scene) {
  BakePlan plan;
  plan.survey.num_meshes = scene.meshes.size();
  plan.survey.num_triangles = scene.meshes.at(0).triangles.size();
  plan.atlas_size = kFakeAtlasSize;
  return plan;
}

/// Says what the library was told of costs.
Prediction fake_prediction(const BakeOptions& options) {
  Prediction prediction;
  prediction.total.cpu_seconds = 1000 * options.costs.row_ray;
  return prediction;
}

Tile fake_tile(int index) {
  Tile tile{0, 0, 64 * (index % 2), 0, 64, 64, 4, std::vector<float>(64 * 64 * 4, static_cast<float>(index))};
  tile.layer_name = "lightmap_0";
  tile.layer_width = tile.layer_height = kFakeAtlasSize;
  return tile;
}

}  // namespace

Result<PlannedBake> plan_scene(const Scene& scene, const BakeOptions& options, std::stop_token) {
  return PlannedBake{fake_plan(scene), fake_prediction(options)};
}

Result<BakeOutcome> bake_scene(const Scene& scene, const BakeOptions& options, BakeObserver& observer,
                               std::stop_token stop, std::stop_token finish, Checkpoints*) {
  num_fake_tiles = 0;
  fake_saw_stop = false;
  fake_time_budget_seconds = options.time_budget_seconds;
  int num_tiles = 2;
  switch (options.seed) {
    case kWaitsForFinish:
      while (!finish.stop_requested() && !stop.stop_requested()) std::this_thread::sleep_for(1ms);
      if (!stop.stop_requested()) break;
      [[fallthrough]];
    case kWaitsForStop:
      while (!stop.stop_requested()) std::this_thread::sleep_for(1ms);
      fake_saw_stop = true;
      return Error{ErrorCode::kCancelled, "the bake was stopped"};
    case kFails: return internal_error("the solver did not converge");
    case kTakesAllMemory: throw std::bad_alloc();
    case kIsSilent: std::this_thread::sleep_for(3s); break;
    case kFloods: num_tiles = kNumFloodTiles; break;
    default: break;
  }
  double fraction = 0;
  for (const BakeStage stage :
       {BakeStage::kPreparing, BakeStage::kFormFactors, BakeStage::kSolving, BakeStage::kGathering}) {
    for (std::uint64_t step = 0; step < 50; ++step) {
      fraction += 1.0 / 200;
      observer.on_progress({.stage = stage, .fraction = fraction, .steps_done = step, .steps_total = 50});
    }
  }
  for (int i = 0; i < num_tiles; ++i) {
    observer.on_tile(fake_tile(i));
    ++num_fake_tiles;
  }
  BakeOutcome outcome;
  Layer layer{"lightmap_0", "irradiance", "lx", kFakeAtlasSize, kFakeAtlasSize, 4, {}};
  for (int i = 0; i < kFakeAtlasSize * kFakeAtlasSize * 4; ++i) layer.values.push_back(0.5F * static_cast<float>(i));
  outcome.layers.push_back(std::move(layer));
  outcome.report.plan = fake_plan(scene);
  outcome.report.num_gather_rays = 1000;
  outcome.report.stages = {{"preparing", 0.25, 0.375}, {"gathering", 0.5, 0.75}};
  outcome.report.passes.resize(2);
  outcome.report.passes[1].seconds = 1.5;
  outcome.report.passes[1].cpu_seconds = 2.5;
  outcome.report.prediction = fake_prediction(options);
  outcome.report.costs = options.costs;
  outcome.report.costs.texel_ray = 0.125;
  return outcome;
}

}  // namespace radiosity
}  // namespace radbake
