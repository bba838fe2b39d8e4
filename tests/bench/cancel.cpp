// Measures how soon a bake stops: in the library, asked at random moments of each stage, and of a job, from the request
// to CANCELLED. Times to compare with what is promised, 100 ms; nothing asserts one.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <map>
#include <random>
#include <thread>

#include "client/api/client.h"
#include "client/api/private_server.h"
#include "client/gltf/read_gltf.h"
#include "client/options/bake_options.h"
#include "client/options/scene_light.h"
#include "common/codec/scene_codec.h"
#include "server/radiosity/bake/bake.h"
#include "server/settings/to_options.h"

namespace radbake {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds(Clock::duration duration) { return std::chrono::duration<double, std::milli>(duration).count(); }

/// Knows the stage that a bake is in.
class StageWatch final : public radiosity::BakeObserver {
 public:
  void on_progress(const radiosity::BakeProgress& progress) override { stage_ = static_cast<int>(progress.stage); }
  void on_tile(const radiosity::Tile&) override {}
  int stage() const { return stage_; }

 private:
  std::atomic<int> stage_ = 0;
};

void print(const char* what, std::vector<double> times) {
  if (times.empty()) return;
  std::sort(times.begin(), times.end());
  const auto at = [&](double share) { return times[static_cast<std::size_t>(share * (times.size() - 1) + 0.5)]; };
  std::printf("%-24s %4zu cancels: median %6.1f ms, 95 %% %6.1f ms, worst %6.1f ms\n", what, times.size(), at(0.5),
              at(0.95), times.back());
}

/// The library's answer, by the stage that it was in when it was asked.
void measure_library(const Scene& scene, const radiosity::BakeOptions& options, int runs, double whole_seconds) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> moment(0, whole_seconds);
  std::map<int, std::vector<double>> by_stage;
  for (int k = 0; k < runs; ++k) {
    StageWatch watch;
    std::stop_source stop;
    std::atomic<bool> was_cancelled = false;
    Clock::time_point ended;
    std::thread bake([&] {
      const auto outcome = radiosity::bake_scene(scene, options, watch, stop.get_token());
      was_cancelled = !outcome.ok() && outcome.error().code == ErrorCode::kCancelled;
      ended = Clock::now();
    });
    std::this_thread::sleep_for(std::chrono::duration<double>(moment(random)));
    const int stage = watch.stage();
    const Clock::time_point asked = Clock::now();
    stop.request_stop();
    bake.join();
    if (was_cancelled) by_stage[stage].push_back(milliseconds(ended - asked));
  }
  const char* names[] = {"library, preparing", "library, form factors", "library, solving", "library, gathering"};
  for (const auto& [stage, times] : by_stage) print(names[stage], times);
}

/// A job's: from the call to the state.
Result<void> measure_jobs(const Scene& scene, const options::BakeChoices& choices, const std::string& bin, int runs,
                          double whole_seconds) {
  RADBAKE_ASSIGN_OR_RETURN(const EncodedScene encoded, encode_scene(scene, {}));
  RADBAKE_ASSIGN_OR_RETURN(const api::PrivateServer server,
                           api::PrivateServer::start({.program = bin + "/radbaked", .costs = {}}));
  RADBAKE_ASSIGN_OR_RETURN(api::Client client, api::Client::connect(server.address()));
  std::vector<api::BlobView> blobs;
  for (const EncodedBlob& blob : encoded.blobs) blobs.push_back({blob.digest, blob.bytes});
  RADBAKE_RETURN_IF_ERROR(client.upload_missing(blobs));
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> moment(0, whole_seconds);
  std::vector<double> times;
  int killed = 0;
  for (int k = 0; k < runs; ++k) {
    v1::SubmitBakeRequest request;
    request.set_request_id(api::make_request_id());
    request.mutable_manifest()->set_sha256(encoded.manifest.sha256);
    request.mutable_manifest()->set_size_bytes(encoded.manifest.size_bytes);
    *request.mutable_settings() = options::to_settings(choices);
    RADBAKE_ASSIGN_OR_RETURN(const v1::Bake bake, client.submit(request));
    std::this_thread::sleep_for(std::chrono::duration<double>(moment(random)));
    const Clock::time_point asked = Clock::now();
    RADBAKE_RETURN_IF_ERROR(client.cancel(bake.name()));
    std::string detail;
    RADBAKE_ASSIGN_OR_RETURN(const v1::Bake ended,
                             client.watch(bake.name(), {}, [&](const v1::WatchBakeResponse& message) {
                               if (message.has_event()) detail = message.event().message();
                             }));
    if (ended.state() != v1::CANCELLED) continue;
    times.push_back(milliseconds(Clock::now() - asked));
    killed += detail.find("did not stop") != std::string::npos;
  }
  print("job, request to CANCELLED", times);
  std::printf("%-24s %4d of them by killing the worker\n", "", killed);
  return {};
}

}  // namespace
}  // namespace radbake

int main(int argc, char** argv) {
  CLI::App app("Measures how soon a bake stops when it is cancelled");
  std::string scene_path, bin;
  int runs = 60;
  double seconds = 2;
  radbake::options::BakeChoices choices;
  app.add_option("SCENE", scene_path, "A .glb or .gltf file without textures")->required();
  app.add_option("--bin", bin, "Folder of radbaked and radbake-worker: jobs are measured too");
  app.add_option("--runs", runs)->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--seconds", seconds, "Cancels come at random up to here: how long the bake takes")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  radbake::options::add_bake_options(app, choices);
  CLI11_PARSE(app, argc, argv);

  const auto no_images = [](std::span<const std::byte>, const std::string& name,
                            bool) -> radbake::Result<radbake::TexturePlane> {
    return radbake::invalid_argument("image '" + name + "': this benchmark bakes scenes without textures");
  };
  auto read = radbake::gltf::read_gltf(scene_path, no_images, {});
  if (!read.ok()) {
    std::fprintf(stderr, "bench_cancel: %s\n", read.error().message.c_str());
    return 1;
  }
  const auto no_sky_images = [](const std::filesystem::path& file, double) -> radbake::Result<radbake::TexturePlane> {
    return radbake::invalid_argument(file.string() + ": this benchmark bakes scenes without images");
  };
  const auto lit = radbake::options::add_sky_and_sun(choices, no_sky_images, read->scene);
  if (!lit.ok()) {
    std::fprintf(stderr, "bench_cancel: %s\n", lit.error().message.c_str());
    return 1;
  }
  const auto options =
      radbake::settings::to_options(radbake::options::to_settings(choices), radbake::options::to_run_options(choices));
  radbake::measure_library(read->scene, options, runs, seconds);
  if (bin.empty()) return 0;
  const auto measured = radbake::measure_jobs(read->scene, choices, bin, runs, seconds);
  if (measured.ok()) return 0;
  std::fprintf(stderr, "bench_cancel: %s\n", measured.error().message.c_str());
  return 1;
}
