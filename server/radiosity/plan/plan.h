#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene.h"
#include "server/radiosity/lightmap/layout.h"
#include "server/radiosity/survey/survey.h"

namespace radbake::radiosity {

/// What receives the light. Field for field radbake.v1.Output.
enum class Output { kLightmap, kVertices, kBoth };

/// What a user may ask for. Zero means: choose.
struct BakeOptions {
  int atlas_size = 0;           ///< texels along a side, 64..4096; 0: as small as holds the scene at texels_per_meter
  double texels_per_meter = 0;  ///< 0: 32
  int rays = 0;                 ///< hemisphere rays a texel; a patch's row gets the same
  int max_patches = 0;
  std::uint64_t seed = 0;
  LightmapUv lightmap_uv = LightmapUv::kAuto;
  Output output = Output::kLightmap;
  int threads = 0;  ///< 0: all cores; changes no result
};

/// What a bake will do. Field for field radbake.v1.Plan.
struct BakePlan {
  Survey survey;
  int atlas_size = 0;    ///< width of each lightmap; 0: vertices only
  int atlas_height = 0;  ///< of each lightmap
  int num_lightmaps = 0;
  std::uint64_t num_texels = 0;         ///< inside charts
  std::uint64_t num_vertex_groups = 0;  ///< vertices that receive light, counted once where they lie together
  std::uint64_t num_patches = 0;
  int rays_per_texel = 0;
  int rays_per_row = 0;
  int light_samples_per_texel = 0;
  std::string estimator;
  std::string transport;
  std::string solver;
  double texels_per_meter = 0;  ///< median over the lit triangles
  std::vector<Warning> warnings;
};

inline constexpr int kMinAtlasSize = kMinSheet;
inline constexpr int kMaxAtlasSize = kMaxSheet;
inline constexpr double kDefaultTexelsPerMeter = 32;
inline constexpr int kDefaultRays = 256;
inline constexpr int kMinRays = 8;
inline constexpr int kMaxRays = 65536;
inline constexpr int kDefaultMaxPatches = 16384;
inline constexpr int kMinMaxPatches = 64;

/// Shadow rays to emitters, a texel and a patch. A patch's estimate is averaged over many patches by every texel.
inline constexpr int kLightSamplesPerTexel = 128;
inline constexpr int kLightSamplesPerPatch = 64;

/// Errors: kInvalidArgument naming the option and the value. Zero is always right: it means choose.
Result<void> check_options(const BakeOptions& options);

/// The wanted length of a patch's side: four texels (the second solve's detail comes from the texels), but at least
/// kMinPatches on the whole scene and no more than asked for.
/// Units: scene units in and out.
double patch_edge(double texel_edge, double area, std::size_t max_patches);

}  // namespace radbake::radiosity
