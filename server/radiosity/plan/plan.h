#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene.h"
#include "server/radiosity/lightmap/layout.h"
#include "server/radiosity/plan/effect_plan.h"
#include "server/radiosity/plan/pass_plan.h"
#include "server/radiosity/plan/prediction.h"
#include "server/radiosity/plan/transport_choice.h"
#include "server/radiosity/solve/solve.h"
#include "server/radiosity/survey/survey.h"

namespace radbake::radiosity {

/// What receives the light. Field for field radbake.v1.Output.
enum class Output { kLightmap, kVertices, kBoth };

/// How the form factors between patches are found. Field for field radbake.v1.FormFactors.
enum class FormFactors { kAuto, kAnalytic, kHemicube, kHemisphere, kAdaptive };
/// "auto", "analytic", "hemicube", "hemisphere", "adaptive".
inline const char* form_factors_name(FormFactors method) {
  switch (method) {
    case FormFactors::kAuto: return "auto";
    case FormFactors::kAnalytic: return "analytic";
    case FormFactors::kHemicube: return "hemicube";
    case FormFactors::kHemisphere: return "hemisphere";
    case FormFactors::kAdaptive: return "adaptive";
  }
  return "unknown";
}

/// What a user may ask for. Zero means: choose.
struct BakeOptions {
  int atlas_size = 0;           ///< texels along a side, 64..4096; 0: as small as holds the scene at texels_per_meter
  double texels_per_meter = 0;  ///< 0: 32
  int rays = 0;                 ///< hemisphere rays a texel; a patch's row gets the same
  int light_samples = 0;        ///< shadow rays to emitters, a texel
  int spacing = 0;              ///< texels from one that gathers indirect light to the next; 1: all do
  int max_patches = 0;
  std::uint64_t seed = 0;
  LightmapUv lightmap_uv = LightmapUv::kAuto;
  Output output = Output::kLightmap;
  FormFactors form_factors = FormFactors::kAuto;
  Transport transport = Transport::kAuto;
  std::optional<Solver> solver = std::nullopt;
  std::uint64_t transport_memory = 0;  ///< bytes; bounds what Transport::kAuto picks
  EffectOverrides effects = {};
  bool wants_direct = false, wants_indirect = false, wants_ao = false;  ///< lightmaps beside the one of all light
  double ao_distance = 0;                                               ///< metres; 0: 1
  int threads = 0;                                                      ///< 0: all cores; changes no result
  double max_error = 0;            ///< relative RMSE to reach, as a fraction; 0: none asked
  double time_budget_seconds = 0;  ///< from the start of the bake to the last tile; 0: none
  /// Exactly these passes, as a report told them, in the place of those that an error or a time asks for.
  std::vector<PassScale> replay = {};
  HostCosts costs = {};  ///< as earlier bakes measured them; changes no result
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
  PassSettings first_pass = {};  ///< the only one where neither an error nor a time is asked
  int spacing = 1;               ///< texels from one that gathers indirect light to the next, where surfaces are plain
  FormFactors form_factors = FormFactors::kHemisphere;  ///< never kAuto
  Transport transport = Transport::kSparse;             ///< never kAuto
  Solver solver = Solver::kGaussSeidel;
  std::uint64_t transport_bytes = 0;        ///< that the form factors may take while they are put together
  std::uint64_t transport_bytes_limit = 0;  ///< what kAuto had to keep
  double texels_per_meter = 0;              ///< median over the lit triangles
  std::vector<EffectPlan> effects = {};     ///< every effect once
  int num_channels = 3;                     ///< that are solved; 1 where everything is grey
  std::string form_factors_reason = {}, transport_reason = {}, solver_reason = {};
  std::vector<Warning> warnings;
};

inline constexpr double kDefaultAoDistance = 1;  ///< metres
inline constexpr int kMinAtlasSize = kMinSheet;
inline constexpr int kMaxAtlasSize = kMaxSheet;
inline constexpr double kDefaultTexelsPerMeter = 32;
inline constexpr double kMinTexelsPerMeter = 1e-6;
inline constexpr int kDefaultRays = 256;
inline constexpr int kMinRays = 8;
inline constexpr int kMaxRays = 65536;
inline constexpr int kDefaultMaxPatches = 16384;
inline constexpr int kMinMaxPatches = 64;
/// Bound on patches that passes refine, where none is asked for.
inline constexpr int kDefaultMaxRefinedPatches = 65536;
/// By formula every pair of patches has its price.
inline constexpr int kDefaultMaxPatchesByFormula = 1024;
inline constexpr std::uint64_t kDefaultTransportMemory = std::uint64_t{4} << 30;

/// Shadow rays to emitters, a texel and a patch. A patch's estimate is averaged over many patches by every texel.
inline constexpr int kLightSamplesPerTexel = 128;
inline constexpr int kLightSamplesPerPatch = 64;
/// Texels from one that gathers indirect light to the next, where a bake is asked by error or by time.
inline constexpr int kProgressiveSpacing = 4;

/// Whether a bake is asked by error or by time, or to repeat one that was: it is made in passes.
inline bool asks_for_result(const BakeOptions& options) {
  return options.max_error > 0 || options.time_budget_seconds > 0 || !options.replay.empty();
}

/// Errors: kInvalidArgument naming the option and the value. Zero is always right: it means choose.
Result<void> check_options(const BakeOptions& options);

/// The bound on patches that is asked for, or the default of the method.
int max_patches_of(const BakeOptions& options);

/// Independent replicates that a system is estimated in: one where rows are not sampled by rays.
int num_replicates_of(FormFactors method);

/// Chooses what options leave open: form factors, transport, solver. Needs the plan's survey, rays and patches.
///
/// Form factors: hemisphere rays. Solver: Gauss-Seidel; Krylov above a reflectance of 0.95, where sweeps grow in number
/// like 1/(1 - rho), and where each sweep traces all rows again.
void choose_methods(const BakeOptions& options, BakePlan& plan);

/// Steps that a method may take: sweeps shrink the error by rho each, and as many again are allowed.
/// max_sweeps of SolveOptions, at least its default. Units: tolerance relative.
int max_sweeps_of(double max_reflectance, double tolerance);

/// The wanted length of a patch's side: four texels (the second solve's detail comes from the texels), but at least
/// kMinPatches on the whole scene and no more than asked for.
/// Units: scene units in and out.
double patch_edge(double texel_edge, double area, std::size_t max_patches);

}  // namespace radbake::radiosity
