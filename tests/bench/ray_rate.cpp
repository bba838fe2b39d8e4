// Measures what share of Embree's own rate rows and gather reach: the same rays, in the same order, one thread, one
// run. Embree's side has its packets ready in memory and does nothing with what it finds.

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "client/gltf/read_gltf.h"
#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/form_factor/hemisphere_rows.h"
#include "server/radiosity/form_factor/patch_rows.h"
#include "server/radiosity/gather/gather.h"
#include "tests/bench/embree_rate.h"

namespace radbake::radiosity {
namespace {

/// Runs the work once to record its rays and then, in turn, Embree on them and the work itself; the best of each.
void measure(const char* what, const Visibility& visibility, const Embree& embree, int runs,
             const std::function<void(const Visibility&)>& work) {
  const Recorder recorder(visibility);
  work(recorder);
  double alone = 1e9, ours = 1e9;
  for (int k = 0; k < runs; ++k) {
    alone = std::min(alone, embree.nearest_seconds(recorder.nearest) + embree.shadow_seconds(recorder.shadow));
    ours = std::min(ours, seconds_of([&] { work(visibility); }));
  }
  const double millions = static_cast<double>(recorder.nearest.size() + recorder.shadow.size()) / 1e6;
  std::printf("%-8s %6.2f million rays (%2.0f %% to light): Embree alone %6.2f M/s, ours %6.2f M/s, share %3.0f %%\n",
              what, millions, 100 * static_cast<double>(recorder.shadow.size()) / 1e6 / millions, millions / alone,
              millions / ours, 100 * alone / ours);
}

Result<void> run(const std::string& path, const BakeOptions& options, int runs) {
  const auto grey = [](std::span<const std::byte>, const std::string&, bool) -> Result<TexturePlane> {
    return TexturePlane{.name = "grey", .width = 1, .height = 1, .values = {0.5f, 0.5f, 0.5f}};
  };
  RADBAKE_ASSIGN_OR_RETURN(gltf::GltfScene read, gltf::read_gltf(path, grey, {}));
  if (max_component(read.scene.sky) == 0) read.scene.sky = {1, 1, 1};
  RADBAKE_ASSIGN_OR_RETURN(const auto prepared, prepare_scene(read.scene, options, {}));
  const Surfaces& surfaces = prepared->surveyed.surfaces;
  const Patches& patches = prepared->patches;
  std::printf("%s: %zu triangles, %zu patches, %d rays a row and texel\n", path.c_str(), surfaces.corners.size(),
              patches.size(), prepared->plan.rays_per_row);
  const Embree embree(surfaces.corners);

  measure("rows", *prepared->visibility, embree, runs, [&](const Visibility& visibility) {
    const HemisphereRows estimator(surfaces, patches, visibility, prepared->plan.rays_per_row);
    const DirectLight direct(surfaces, visibility, kLightSamplesPerPatch);
    const PatchSampler sampler(surfaces, patches, estimator, direct, 0);
    sample_patches(sampler, patches.num_cells(), {}, [](std::uint32_t, FormFactorRow&, const PatchSample&) {}, {}, {});
  });
  measure("gather", *prepared->visibility, embree, runs, [&](const Visibility& visibility) {
    const HemisphereEstimator estimator(surfaces, patches, visibility, prepared->plan.rays_per_texel);
    const DirectLight direct(surfaces, visibility, kLightSamplesPerTexel);
    const std::vector<Vec3> radiosity(patches.size(), Vec3{1, 1, 1});
    const SentLight sent{radiosity};
    const GatherScene scene{surfaces, visibility, estimator, direct, std::span(&sent, 1), read.scene.sky, 0};
    LightmapGather gather(surfaces, *prepared->atlas, visibility, 1, false, false);
    GatherCounts counts;
    gather.add_pass({scene, scene, kLightSamplesPerTexel, {}, 1}, {}, {}, {}, counts);
  });
  return {};
}

}  // namespace
}  // namespace radbake::radiosity

int main(int argc, char** argv) {
  CLI::App app("Measures the share of Embree's own ray rate that rows and gather reach, on one thread");
  std::vector<std::string> scenes;
  radbake::radiosity::BakeOptions options;
  options.atlas_size = 64;
  int runs = 3;
  app.add_option("SCENE", scenes, "glTF files; textures count as grey")->required();
  app.add_option("--atlas-size", options.atlas_size)->capture_default_str();
  app.add_option("--max-patches", options.max_patches);
  app.add_option("--rays", options.rays);
  app.add_option("--runs", runs)->check(CLI::PositiveNumber)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  for (const std::string& scene : scenes) {
    const auto measured = radbake::radiosity::run(scene, options, runs);
    if (measured.ok()) continue;
    std::fprintf(stderr, "bench_ray_rate: %s\n", measured.error().message.c_str());
    return 1;
  }
  return 0;
}
