// Measures what share of Embree's own rate rows and gather reach: the same rays, in the same order, one thread, one
// run. Embree's side has its packets ready in memory and does nothing with what it finds.

#include <embree3/rtcore.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>

#include "client/gltf/read_gltf.h"
#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/form_factor/hemisphere_rows.h"
#include "server/radiosity/form_factor/patch_rows.h"
#include "server/radiosity/gather/gather.h"

namespace radbake::radiosity {
namespace {

constexpr std::size_t kPacket = 16;

double seconds_of(const std::function<void()>& work) {
  // Of the processor: all is on one thread, and other programs do not count.
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// Passes all questions on and remembers the rays.
class Recorder final : public Visibility {
 public:
  explicit Recorder(const Visibility& inner) : inner_(inner) {}
  void trace(std::span<const Ray> rays, std::span<Hit> hits) const override {
    nearest.insert(nearest.end(), rays.begin(), rays.end());
    inner_.trace(rays, hits);
  }
  void blocked(std::span<const Ray> segments, std::span<std::uint8_t> blocked) const override {
    shadow.insert(shadow.end(), segments.begin(), segments.end());
    inner_.blocked(segments, blocked);
  }
  void transmitted(std::span<const Ray> segments, std::span<Vec3> shares) const override {
    shadow.insert(shadow.end(), segments.begin(), segments.end());
    inner_.transmitted(segments, shares);
  }
  void triangles_near(Vec3 point, double distance, std::vector<std::uint32_t>& triangles) const override {
    inner_.triangles_near(point, distance, triangles);
  }
  void triangles_in(const Shaft& shaft, std::vector<std::uint32_t>& triangles) const override {
    inner_.triangles_in(shaft, triangles);
  }
  std::string instruction_set() const override { return inner_.instruction_set(); }

  mutable std::vector<Ray> nearest, shadow;

 private:
  const Visibility& inner_;
};

/// Embree alone, on a tree of the same triangles.
class Embree {
 public:
  explicit Embree(std::span<const Corners> triangles) : device_(rtcNewDevice(nullptr)), scene_(rtcNewScene(device_)) {
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, 3 * triangles.size()));
    auto* indices = static_cast<unsigned*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size()));
    for (std::size_t at = 0; at < 3 * triangles.size(); ++at) {
      for (int axis = 0; axis < 3; ++axis)
        vertices[3 * at + axis] = static_cast<float>(triangles[at / 3][at % 3][axis]);
      indices[at] = static_cast<unsigned>(at);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene_);
  }
  ~Embree() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;

  double nearest_seconds(const std::vector<Ray>& rays) const {
    std::vector<RTCRayHit16> packets(rays.size() / kPacket);
    for (std::size_t k = 0; k < packets.size() * kPacket; ++k) {
      set(packets[k / kPacket].ray, k % kPacket, rays[k]);
      packets[k / kPacket].hit.geomID[k % kPacket] = RTC_INVALID_GEOMETRY_ID;
      packets[k / kPacket].hit.instID[0][k % kPacket] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    return seconds_of([&] {
      for (RTCRayHit16& packet : packets) rtcIntersect16(kAll, scene_, &context, &packet);
    });
  }
  double shadow_seconds(const std::vector<Ray>& rays) const {
    std::vector<RTCRay16> packets(rays.size() / kPacket);
    for (std::size_t k = 0; k < packets.size() * kPacket; ++k) set(packets[k / kPacket], k % kPacket, rays[k]);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    return seconds_of([&] {
      for (RTCRay16& packet : packets) rtcOccluded16(kAll, scene_, &context, &packet);
    });
  }

 private:
  static void set(RTCRay16& packet, std::size_t k, const Ray& ray) {
    packet.org_x[k] = ray.origin[0], packet.org_y[k] = ray.origin[1], packet.org_z[k] = ray.origin[2];
    packet.dir_x[k] = ray.direction[0], packet.dir_y[k] = ray.direction[1], packet.dir_z[k] = ray.direction[2];
    packet.tnear[k] = 0, packet.tfar[k] = ray.max_distance, packet.time[k] = 0;
    packet.mask[k] = 0xffffffffu, packet.id[k] = 0, packet.flags[k] = 0;
  }
  alignas(64) static constexpr int kAll[kPacket] = {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
  RTCDevice device_;
  RTCScene scene_;
};

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
    sample_patches(sampler, patches.num_cells(), [](std::uint32_t, FormFactorRow&, const PatchSample&) {}, {}, {});
  });
  measure("gather", *prepared->visibility, embree, runs, [&](const Visibility& visibility) {
    const HemisphereEstimator estimator(surfaces, patches, visibility, prepared->plan.rays_per_texel);
    const DirectLight direct(surfaces, visibility, kLightSamplesPerTexel);
    const std::vector<Vec3> radiosity(patches.size(), Vec3{1, 1, 1});
    const GatherScene scene{surfaces, visibility, estimator, direct, radiosity, {}, read.scene.sky, 0};
    gather_lightmap(scene, *prepared->atlas, {}, {}, {});
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
