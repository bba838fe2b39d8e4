// Bakes six scenes at three settings, each in a worker of its own, and prints what was predicted of CPU time and memory
// beside what was measured: by the plan, and by the bake itself before it began.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "client/api/client.h"
#include "client/api/private_server.h"
#include "client/gltf/read_gltf.h"
#include "client/image/decode_image.h"
#include "common/codec/scene_codec.h"
#include "tests/scenes/rooms.h"
#include "tests/scenes/solids.h"

namespace radbake {
namespace {

namespace fs = std::filesystem;

struct Case {
  std::string name;
  Scene scene;
  double texels_per_meter;  ///< for bakes of some seconds
};

Result<Scene> read_scene(const fs::path& path) {
  const auto decode = [](std::span<const std::byte> bytes, const std::string& name, bool is_srgb) {
    return image::decode_image(bytes, name, is_srgb);
  };
  RADBAKE_ASSIGN_OR_RETURN(gltf::GltfScene read, gltf::read_gltf(path, decode, {}));
  return std::move(read.scene);
}

/// Vases in rows on the floor of a room, more than 50,000 triangles, under a sun and two lamps.
Scene room_of_vases() {
  tests::RoomBuilder builder(5);
  const int wall = builder.add_material("wall", {0.7, 0.65, 0.6});
  builder.add_box("room", {0, 0, 0}, {6, 3, 5}, wall, true);
  Scene scene = builder.scene();
  scene.meshes.erase(scene.meshes.begin() + 1);  // no ceiling
  const Mesh vase = tests::make_vase(64);
  for (int i = 0; i < 24; ++i) {
    Mesh own = vase;
    own.name += std::to_string(i);
    own.material = wall;
    for (Vec3& p : own.positions) p += Vec3{0.7 + 0.9 * (i % 6), 0, 0.8 + 1.1 * (i / 6)};
    scene.meshes.push_back(own);
  }
  for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
    scene.meshes[m].object = static_cast<int>(m);
    scene.meshes[m].texcoord1.clear();
  }
  scene.lights.push_back({"sun", DirectionalLight{normalized(Vec3{0.3, -1, 0.2}), {5e4, 5e4, 4.5e4}, 0.00925}});
  scene.lights.push_back({"lamp 1", PointLight{{2, 2.5, 2}, {300, 280, 250}}});
  scene.lights.push_back({"lamp 2", PointLight{{4, 2.5, 3}, {300, 280, 250}}});
  return scene;
}

/// The furnished hall, closed, with three lamps.
Scene hall_with_lamps() {
  Scene scene = tests::make_furnished_hall();
  scene.sky = {};
  for (int i = 0; i < 3; ++i) {
    scene.lights.push_back({"lamp", PointLight{{4.0 + 6 * i, 5.5, 4.0 + 3 * i}, {900, 800, 700}}});
  }
  return scene;
}

/// The furnished hall, grey, under a sky with a bright spot.
Scene hall_under_a_sky() {
  Scene scene = tests::make_furnished_hall();
  scene.meshes[0].triangles.resize(2);  // one side of the hall: the rest is open
  scene.sky = {};
  TexturePlane sky{"noon", 64, 32, 3, Wrap::kRepeat, Wrap::kClamp, std::vector<float>(64 * 32 * 3, 1000.0F)};
  for (std::size_t c = 0; c < 3; ++c) sky.values[(5 * 64 + 20) * 3 + c] = 1e7F;
  scene.environment = sky;
  return scene;
}

Result<std::vector<Case>> make_cases(const fs::path& scenes) {
  RADBAKE_ASSIGN_OR_RETURN(const Scene cornell, read_scene(scenes / "cornell.glb"));
  RADBAKE_ASSIGN_OR_RETURN(Scene game, read_scene(scenes / "tile-game-room6.glb"));
  game.sky = {1000, 1000, 1000};
  return std::vector<Case>{{"cornell", cornell, 0},
                           {"tile-game-room6", game, 16},
                           {"furnished hall", hall_with_lamps(), 4},
                           {"room with a panel", tests::small_emitter_room(0.5), 20},
                           {"vases", room_of_vases(), 12},
                           {"hall under a sky", hall_under_a_sky(), 5}};
}

struct Settings {
  const char* name;
  unsigned rays;
  double density;  ///< over that of the case
  unsigned max_patches;
};
constexpr Settings kSettings[] = {{"usual", 256, 1, 0}, {"more rays", 1024, 0.75, 0}, {"finer", 128, 2, 32768}};

struct Ratios {
  std::vector<double> cpu, memory;
};

double off_by(double ratio) { return std::max(ratio, 1 / ratio); }

Result<void> run_case(api::Client& client, const Case& scene, const Settings& settings, Ratios& ratios) {
  RADBAKE_ASSIGN_OR_RETURN(const EncodedScene encoded, encode_scene(scene.scene, {}));
  std::vector<api::BlobView> blobs;
  for (const EncodedBlob& blob : encoded.blobs) blobs.push_back({blob.digest, blob.bytes});
  RADBAKE_RETURN_IF_ERROR(client.upload_missing(blobs));

  v1::SubmitBakeRequest request;
  request.mutable_manifest()->set_sha256(encoded.manifest.sha256);
  request.mutable_manifest()->set_size_bytes(encoded.manifest.size_bytes);
  v1::BakeSettings& wanted = *request.mutable_settings();
  wanted.set_rays(settings.rays);
  wanted.set_max_patches(settings.max_patches);
  if (scene.texels_per_meter > 0) wanted.set_texels_per_meter(scene.texels_per_meter * settings.density);
  if (scene.texels_per_meter == 0) wanted.set_atlas_size(settings.density > 1 ? 512 : 256);
  v1::PlanBakeRequest asked;
  *asked.mutable_manifest() = request.manifest();
  *asked.mutable_settings() = wanted;
  RADBAKE_ASSIGN_OR_RETURN(const v1::Plan plan, client.plan(asked));
  request.set_request_id(api::make_request_id());
  RADBAKE_ASSIGN_OR_RETURN(const v1::Bake submitted, client.submit(request));
  RADBAKE_ASSIGN_OR_RETURN(const v1::Bake bake,
                           client.watch(submitted.name(), {}, [](const v1::WatchBakeResponse&) {}));
  if (bake.state() != v1::SUCCEEDED) return internal_error(scene.name + ": " + bake.error().message());

  const v1::BakeReport& report = bake.result().report();
  const v1::RunReport& run = report.run();
  const v1::StagePrediction &before = run.prediction().total(), &planned = plan.prediction().total();
  const double mega = 1e-6;
  const double memory = static_cast<double>(run.peak_memory_bytes());
  std::printf("%-18s %-10s %8.2f %8.2f %8.2f %6.2f  [%5.2f %6.2f] %7.0f %7.0f %6.2f  %5.3f %6.2f %6.2f\n",
              scene.name.c_str(), settings.name, planned.cpu_seconds(), before.cpu_seconds(), run.cpu_seconds(),
              before.cpu_seconds() / run.cpu_seconds(), before.cpu_seconds_low(), before.cpu_seconds_high(),
              mega * static_cast<double>(before.memory_bytes()), mega * memory,
              static_cast<double>(before.memory_bytes()) / memory, run.prediction().pilot_seconds(),
              before.wall_seconds(), run.wall_seconds());
  for (const v1::StagePrediction& stage : run.prediction().stages()) {
    for (const v1::StageSeconds& actual : run.cpu_stages()) {
      if (actual.stage() == stage.stage()) {
        std::printf("    %-14s %8.2f %8.2f %8.0f MB\n", stage.stage().c_str(), stage.cpu_seconds(), actual.seconds(),
                    mega * static_cast<double>(stage.memory_bytes()));
      }
    }
  }
  std::printf(
      "    %llu triangles, %llu patches, %llu rows, %llu texels, %llu form factors, %u sweeps, %u of the scaling; %s\n",
      static_cast<unsigned long long>(report.plan().survey().num_triangles()),
      static_cast<unsigned long long>(report.num_patches()),
      static_cast<unsigned long long>(report.num_row_rays() / settings.rays),
      static_cast<unsigned long long>(report.lightmap().num_texels()),
      static_cast<unsigned long long>(report.transport().num_entries()), report.solver().sweeps(),
      report.transport().scaling_sweeps(), run.prediction().source().c_str());
  std::fflush(stdout);
  ratios.cpu.push_back(off_by(before.cpu_seconds() / run.cpu_seconds()));
  ratios.memory.push_back(off_by(static_cast<double>(before.memory_bytes()) / memory));
  return {};
}

Result<void> run(const std::string& bin, const fs::path& scenes, const std::string& only) {
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Case> cases, make_cases(scenes));
  api::PrivateServer::Options options;
  options.program = bin + "/radbaked";
  RADBAKE_ASSIGN_OR_RETURN(const api::PrivateServer server, api::PrivateServer::start(options));
  RADBAKE_ASSIGN_OR_RETURN(api::Client client, api::Client::connect(server.address()));
  std::printf("%-18s %-10s %8s %8s %8s %6s  %14s %7s %7s %6s  %5s %6s %6s\n", "scene", "settings", "plan s", "bake s",
              "CPU s", "ratio", "[low high]", "MB", "is MB", "ratio", "pilot", "wall", "is");
  Ratios ratios;
  for (const Case& scene : cases) {
    if (!only.empty() && scene.name.find(only) == std::string::npos) continue;
    for (const Settings& settings : kSettings) RADBAKE_RETURN_IF_ERROR(run_case(client, scene, settings, ratios));
  }
  const auto within = [](const std::vector<double>& values, double bound) {
    return std::count_if(values.begin(), values.end(), [=](double value) { return value <= bound; });
  };
  std::printf("CPU: %ld of %zu within x1.5, %ld within x2.5; memory: %ld of %zu within x1.3\n", within(ratios.cpu, 1.5),
              ratios.cpu.size(), within(ratios.cpu, 2.5), within(ratios.memory, 1.3), ratios.memory.size());
  return {};
}

}  // namespace
}  // namespace radbake

int main(int argc, char** argv) {
  CLI::App app("Compares predicted with actual CPU seconds and memory of 18 bakes.");
  std::string bin, scenes, only;
  app.add_option("SCENES", scenes, "Folder of cornell.glb and tile-game-room6.glb")->required();
  app.add_option("--bin", bin, "Folder of radbaked and radbake-worker")->required();
  app.add_option("--only", only, "Scenes whose names contain this");
  CLI11_PARSE(app, argc, argv);
  const auto done = radbake::run(bin, scenes, only);
  if (done.ok()) return 0;
  std::fprintf(stderr, "bench_predictions: %s\n", done.error().message.c_str());
  return 1;
}
