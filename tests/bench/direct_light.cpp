// What direct light costs and how sharp it is: microseconds a shadow ray, the share of Embree's own rate on the same
// rays, and the relative RMSE over the texels of a lightmap against 4096 samples; one thread.

#include "server/radiosity/lights/direct_light.h"

#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "client/gltf/read_gltf.h"
#include "server/radiosity/bake/preparation.h"
#include "tests/bench/embree_rate.h"
#include "tests/scenes/effect_rooms.h"
#include "tests/scenes/rooms.h"
#include "tests/scenes/solids.h"

namespace radbake::radiosity {
namespace {

constexpr int kReferenceSamples = 4096, kReferenceSites = 64;
constexpr int kReplicates = 4;

/// A flat of three rooms in a row, doors between: six windows in the outer wall, a lamp under each ceiling.
Scene flat() {
  tests::RoomBuilder builder(10);
  const int grey = builder.add_material("grey", {0.6, 0.6, 0.6});
  const int window = builder.add_material("window", {0, 0, 0}, {3000, 3200, 3500});
  const int lamp = builder.add_material("lamp", {0, 0, 0}, {8000, 7000, 6000});
  builder.add_box("walls", {0, 0, 0}, {12, 2.7, 5}, grey, true);
  for (int room = 0; room < 3; ++room) {
    for (int k = 0; k < 2; ++k) {
      const double x = 4 * room + 0.6 + 1.8 * k;
      builder.add_quad("window", {x, 0.9, 0.02}, {1.2, 0, 0}, {0, 1.3, 0}, window);
    }
    builder.add_box("lamp", {4 * room + 1.9, 2.2, 2.4}, {4 * room + 2.1, 2.3, 2.6}, lamp, false);
    builder.add_box("table", {4 * room + 1.2, 0.4, 1.5}, {4 * room + 2.6, 0.8, 2.4}, grey, false);
    if (room > 0) builder.add_box("partition", {4.0 * room - 0.1, 0, 0}, {4.0 * room + 0.1, 2.7, 3.9}, grey, false);
  }
  return builder.scene();
}

/// A hall with 80 glowing spheres of 256 triangles each, and 40 bright signs on its walls.
Scene hall_of_lights() {
  tests::RoomBuilder builder(11);
  const int grey = builder.add_material("grey", {0.6, 0.6, 0.6});
  const int sign = builder.add_material("sign", {0, 0, 0}, {5000, 2000, 1000});
  const int globe = builder.add_material("globe", {0, 0, 0}, {3000, 3000, 3000});
  builder.add_box("walls", {0, 0, 0}, {40, 6, 20}, grey, true);
  for (int k = 0; k < 20; ++k) {
    builder.add_quad("sign", {2.0 * k + 0.5, 2, 0.01}, {1, 0, 0}, {0, 0.5, 0}, sign);
    builder.add_quad("sign", {2.0 * k + 0.5, 2, 19.99}, {0, 0.5, 0}, {1, 0, 0}, sign);
  }
  for (int k = 0; k < 10; ++k) {
    builder.add_box("block", {4.0 * k + 1, 0.1, 6}, {4.0 * k + 2, 3, 7.5}, grey, false);
  }
  const Mesh sphere = tests::make_sphere(8);
  for (int k = 0; k < 80; ++k) {
    Mesh mesh = sphere;
    mesh.name = "globe";
    mesh.material = globe;
    mesh.normals.clear();
    for (Vec3& p : mesh.positions) p = p * 0.12 + Vec3{2.0 * (k % 20) + 1, 4.5, 4.0 * (k / 20) + 4};
    builder.scene().meshes.push_back(mesh);
  }
  for (Mesh& mesh : builder.scene().meshes) mesh.texcoord1.clear();
  return builder.scene();
}

/// Texels of an atlas as receivers: their sites for one number of samples.
class Receivers {
 public:
  Receivers(const Preparation& prepared, int most) : prepared_(prepared) {
    const Atlas& atlas = *prepared.atlas;
    Footprint footprint;
    std::vector<std::pair<int, int>> covered;
    for (int y = 0; y < atlas.num_rows(); ++y) {
      for (int x = 0; x < atlas.width(); ++x) {
        atlas.footprint(x, y, footprint);
        if (footprint.is_empty() || prepared.surveyed.surfaces.is_emitter[footprint.pieces[0].triangle]) continue;
        covered.emplace_back(x, y);
      }
    }
    const std::size_t step = std::max<std::size_t>(1, covered.size() / static_cast<std::size_t>(most));
    // As long runs as a tile's rows have.
    for (std::size_t k = 0; k < covered.size(); ++k) {
      if (k / 16 % step == 0) texels_.push_back(covered[k]);
    }
  }
  std::size_t size() const { return texels_.size(); }

  std::vector<std::vector<Site>> sites(int num_sites, std::uint64_t seed) const {
    const Surfaces& surfaces = prepared_.surveyed.surfaces;
    const SobolPoints points(num_sites);
    std::vector<std::vector<Site>> all;
    Footprint footprint;
    for (const auto& [x, y] : texels_) {
      prepared_.atlas->footprint(x, y, footprint);
      const auto seeds = SobolPoints::seeds_of(seed_of(seed, 1, all.size()));
      std::vector<Site>& sites = all.emplace_back();
      for (int s = 0; s < num_sites; ++s) {
        const SurfacePoint p = footprint.sample(points.coordinate(s, 0, seeds), points.coordinate(s, 1, seeds));
        sites.push_back(front_site(surfaces, p, surfaces.shading_normal(p)));
      }
    }
    return all;
  }

 private:
  const Preparation& prepared_;
  std::vector<std::pair<int, int>> texels_;
};

/// Mean of the replicates, by receiver.
std::vector<Vec3> estimates(const DirectLight& direct, const std::vector<std::vector<Site>>& receivers,
                            std::uint64_t seed, int num_replicates, std::uint64_t* num_rays = nullptr) {
  DirectLight::Scratch scratch;
  std::vector<Vec3> means, replicates(static_cast<std::size_t>(num_replicates));
  const std::vector<std::uint8_t> none(receivers[0].size(), 0);
  for (const std::vector<Site>& sites : receivers) {
    const std::uint64_t rays = direct.estimate(sites, none, seed_of(seed, 2, means.size()), scratch, replicates);
    if (num_rays != nullptr) *num_rays += rays;
    Vec3 sum;
    for (const Vec3 replicate : replicates) sum += replicate;
    means.push_back(sum / num_replicates);
  }
  return means;
}

double relative_rmse(const std::vector<Vec3>& values, const std::vector<Vec3>& exact) {
  double squares = 0, sum = 0;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const Vec3 d = values[k] - exact[k];
    squares += dot(d, d) / 3;
    sum += mean_component(exact[k]);
  }
  const auto n = static_cast<double>(values.size());
  return std::sqrt(squares / n) / (sum / n);
}

struct Options {
  int atlas_size = 256, most_texels = 4000, runs = 3;
  std::vector<int> samples = {4, 16, 64};
};

Result<void> run(const std::string& name, const Scene& scene, const Options& asked) {
  BakeOptions options;
  options.atlas_size = asked.atlas_size;
  RADBAKE_ASSIGN_OR_RETURN(const auto prepared, prepare_scene(scene, options, {}));
  const Surfaces& surfaces = prepared->surveyed.surfaces;
  const Embree embree(surfaces.corners);
  const Receivers receivers(*prepared, asked.most_texels);
  const auto num_emitters = std::count(surfaces.is_emitter.begin(), surfaces.is_emitter.end(), 1);
  std::printf("%s: %zu triangles, %td of them emitters, %zu lamps; %zu texels\n", name.c_str(), surfaces.size(),
              num_emitters, surfaces.lights.size(), receivers.size());

  const Visibility& visibility = prepared->shadows();
  const auto of_all = Environment::Part::kBright;
  const DirectLight reference(surfaces, visibility, kReferenceSamples, of_all);
  const std::vector<Vec3> exact = estimates(reference, receivers.sites(kReferenceSites, 1), 1, 1);
  for (const int samples : asked.samples) {
    const auto sites = receivers.sites(std::min(samples, kReferenceSites), 7);
    const DirectLight direct(surfaces, visibility, samples, of_all);
    const double whole = relative_rmse(estimates(direct, sites, 3, 1), exact);
    const double split = relative_rmse(estimates(direct, sites, 3, kReplicates), exact);

    const Recorder recorder(visibility);
    std::uint64_t rays = 0;
    estimates(DirectLight(surfaces, recorder, samples, of_all), sites, 3, kReplicates, &rays);
    double alone = 1e9, ours = 1e9;
    for (int k = 0; k < asked.runs; ++k) {
      alone = std::min(alone, embree.shadow_seconds(recorder.shadow));
      ours = std::min(ours, seconds_of([&] { estimates(direct, sites, 3, kReplicates); }));
    }
    const auto texels = static_cast<double>(receivers.size()), traced = static_cast<double>(rays);
    std::printf(
        "  %2d samples: RMSE %6.2f %% (%6.2f %% in %d replicates); %5.1f rays and %6.3f us a texel, %6.4f us a ray, "
        "Embree %6.4f us: share %3.0f %%\n",
        samples, 100 * whole, 100 * split, kReplicates, traced / texels, 1e6 * ours / texels, 1e6 * ours / traced,
        1e6 * alone / traced, 100 * alone / ours);
    std::fflush(stdout);
  }
  return {};
}

Result<void> run_file(const std::string& path, const Options& asked) {
  const auto grey = [](std::span<const std::byte>, const std::string&, bool) -> Result<TexturePlane> {
    return TexturePlane{.name = "grey", .width = 1, .height = 1, .values = {0.5f, 0.5f, 0.5f}};
  };
  RADBAKE_ASSIGN_OR_RETURN(const gltf::GltfScene read, gltf::read_gltf(path, grey, {}));
  return run(path, read.scene, asked);
}

}  // namespace
}  // namespace radbake::radiosity

int main(int argc, char** argv) {
  using namespace radbake;
  CLI::App app("Measures direct light: time a shadow ray, share of Embree's rate, error by number of samples");
  std::vector<std::string> files;
  radiosity::Options asked;
  bool is_files_only = false;
  app.add_option("SCENE", files, "glTF files, before the rooms built in; textures count as grey");
  app.add_option("--atlas-size", asked.atlas_size)->capture_default_str();
  app.add_option("--texels", asked.most_texels, "at most about that many are measured")->capture_default_str();
  app.add_option("--runs", asked.runs)->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--samples", asked.samples, "of a texel, multiples of 4")->capture_default_str();
  app.add_flag("--files-only", is_files_only, "leave out the rooms built in");
  CLI11_PARSE(app, argc, argv);
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  std::vector<Result<void>> results;
  for (const std::string& file : files) results.push_back(radiosity::run_file(file, asked));
  if (!is_files_only) {
    for (const tests::EffectRoom& room : tests::rooms_with_effects()) {
      if (room.name == "emitters" || room.name == "sun" || room.name == "hdri" || room.name == "all") {
        results.push_back(radiosity::run("effect room " + room.name, room.scene, asked));
      }
    }
    results.push_back(radiosity::run("flat", radiosity::flat(), asked));
    results.push_back(radiosity::run("hall of lights", radiosity::hall_of_lights(), asked));
  }
  for (const Result<void>& result : results) {
    if (result.ok()) continue;
    std::fprintf(stderr, "bench_direct_light: %s\n", result.error().message.c_str());
    return 1;
  }
  return 0;
}
