// Measures how long a user waits: the start of the embedded server, the start of a worker, and the time from submit to
// the last tile of a bake (server running, content known), of its first pass and of all.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include "client/api/client.h"
#include "client/api/private_server.h"
#include "client/gltf/read_gltf.h"
#include "common/codec/scene_codec.h"

namespace radbake {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

/// One run: seconds from submit to the worker's first progress, to the first tile, to the last tile of the first pass
/// and of all, and to the end; and what the worker says.
struct Run {
  double begun = 0, first_tile = 0, first_map = 0, last_tile = 0, finished = 0, worker_start = 0, cpu = 0;
  double first_error = 0, error = 0;
  int tiles = 0, passes = 0;
};

Result<Run> run_once(api::Client& client, const v1::SubmitBakeRequest& prepared) {
  Run run;
  v1::SubmitBakeRequest request = prepared;
  request.set_request_id(api::make_request_id());
  const Clock::time_point start = Clock::now();
  RADBAKE_ASSIGN_OR_RETURN(const v1::Bake submitted, client.submit(request));
  api::WatchOptions options;
  options.include_tiles = true;
  RADBAKE_ASSIGN_OR_RETURN(const v1::Bake finished,
                           client.watch(submitted.name(), options, [&](const v1::WatchBakeResponse& message) {
                             if (message.has_progress() && run.begun == 0) run.begun = seconds_since(start);
                             if (!message.has_tile()) return;
                             run.last_tile = seconds_since(start);
                             if (message.tile().pass() == 0) run.first_map = run.last_tile;
                             if (run.tiles++ == 0) run.first_tile = run.last_tile;
                           }));
  run.finished = seconds_since(start);
  if (finished.state() != v1::SUCCEEDED) return internal_error(finished.error().message());
  run.worker_start = finished.result().report().run().worker_start_seconds();
  const v1::BakeReport& report = finished.result().report();
  run.cpu = report.run().cpu_seconds();
  run.passes = report.passes_size();
  run.first_error = run.passes > 0 ? report.passes(0).relative_rmse() : 0;
  run.error = report.error().relative_rmse();
  return run;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

Result<void> measure(const std::string& scene_path, const std::string& bin, const v1::BakeSettings& settings,
                     int runs) {
  const auto no_images = [](std::span<const std::byte>, const std::string& name, bool) -> Result<TexturePlane> {
    return invalid_argument("image '" + name + "': this benchmark bakes scenes without textures");
  };
  RADBAKE_ASSIGN_OR_RETURN(const gltf::GltfScene scene, gltf::read_gltf(scene_path, no_images, {}));
  RADBAKE_ASSIGN_OR_RETURN(const EncodedScene encoded,
                           encode_scene(scene.scene, {.atlas_size = static_cast<int>(settings.atlas_size())}));

  const Clock::time_point start = Clock::now();
  RADBAKE_ASSIGN_OR_RETURN(const api::PrivateServer server,
                           api::PrivateServer::start({.program = bin + "/radbaked", .costs = {}}));
  RADBAKE_ASSIGN_OR_RETURN(api::Client client, api::Client::connect(server.address()));
  std::printf("embedded server, start to connected: %.0f ms\n", 1e3 * seconds_since(start));
  std::vector<api::BlobView> blobs;
  for (const EncodedBlob& blob : encoded.blobs) blobs.push_back({blob.digest, blob.bytes});
  RADBAKE_ASSIGN_OR_RETURN(const std::uint64_t sent, client.upload_missing(blobs));
  std::printf("content: %llu bytes\n", static_cast<unsigned long long>(sent));

  v1::SubmitBakeRequest request;
  request.mutable_manifest()->set_sha256(encoded.manifest.sha256);
  request.mutable_manifest()->set_size_bytes(encoded.manifest.size_bytes);
  *request.mutable_settings() = settings;
  std::vector<double> begun, first, map, last, finished, worker, cpu, first_error, error, passes;
  int tiles = 0;
  for (int i = 0; i < runs; ++i) {
    // As people do, with time for the server to make the next worker ready.
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    RADBAKE_ASSIGN_OR_RETURN(const Run run, run_once(client, request));
    begun.push_back(run.begun);
    first.push_back(run.first_tile);
    map.push_back(run.first_map);
    first_error.push_back(run.first_error);
    error.push_back(run.error);
    passes.push_back(run.passes);
    last.push_back(run.last_tile);
    finished.push_back(run.finished);
    worker.push_back(run.worker_start);
    cpu.push_back(run.cpu);
    tiles = run.tiles;
  }
  std::printf(
      "median of %d bakes: worker start %.0f ms; submit to first progress %.0f ms, to first tile %.0f ms, to last tile "
      "of the first pass %.0f ms (error %.2f %%), to last of %d tiles %.0f ms (slowest %.0f ms; %.0f passes, error "
      "%.2f "
      "%%), to the end %.0f ms; worker's CPU %.0f ms\n",
      runs, 1e3 * median(worker), 1e3 * median(begun), 1e3 * median(first), 1e3 * median(map),
      100 * median(first_error), tiles, 1e3 * median(last), 1e3 * *std::max_element(last.begin(), last.end()),
      median(passes), 100 * median(error), 1e3 * median(finished), 1e3 * median(cpu));
  return {};
}

}  // namespace
}  // namespace radbake

int main(int argc, char** argv) {
  CLI::App app("Measures the start of server and worker, and the time from submit to the last tile of a bake.");
  std::string scene, bin;
  unsigned atlas_size = 64, rays = 32, max_patches = 512;
  double max_error = 0;
  std::uint64_t time_budget_ms = 0;
  int runs = 11;
  app.add_option("SCENE", scene, "A .glb or .gltf file without textures")->required();
  app.add_option("--bin", bin, "Folder of radbaked and radbake-worker")->required();
  app.add_option("--atlas-size", atlas_size)->capture_default_str();
  app.add_option("--rays", rays, "Not with a target or a budget")->capture_default_str();
  app.add_option("--max-error", max_error, "Target, a fraction");
  app.add_option("--time-budget-ms", time_budget_ms);
  app.add_option("--max-patches", max_patches)->capture_default_str();
  app.add_option("--runs", runs)->check(CLI::PositiveNumber)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  radbake::v1::BakeSettings settings;
  settings.set_atlas_size(atlas_size);
  settings.set_max_patches(max_patches);
  settings.set_max_error(max_error);
  settings.set_time_budget_ms(time_budget_ms);
  if (max_error == 0 && time_budget_ms == 0) settings.set_rays(rays);
  const auto measured = radbake::measure(scene, bin, settings, runs);
  if (measured.ok()) return 0;
  std::fprintf(stderr, "bench_first_bake: %s\n", measured.error().message.c_str());
  return 1;
}
