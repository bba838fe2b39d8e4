#pragma once

#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene.h"
#include "server/radiosity/bake/checkpoints.h"
#include "server/radiosity/gather/mesh_output.h"
#include "server/radiosity/plan/plan.h"
#include "server/radiosity/plan/prediction.h"

namespace radbake::radiosity {

enum class BakeStage { kPreparing, kFormFactors, kSolving, kGathering };

struct BakeProgress {
  BakeStage stage = BakeStage::kPreparing;
  double fraction = 0;            ///< of the whole bake, 0..1, never decreases
  std::uint64_t steps_done = 0;   ///< of this stage: rows, sweeps, texels
  std::uint64_t steps_total = 0;  ///< 0: not known
  double seconds_left = -1;       ///< estimate; negative: not known yet
  double residual = 0;            ///< kSolving: relative error bound so far
  int pass = 0;
  double relative_error = 0;  ///< estimated relative RMSE of the map as the passes so far left it; 0: not known yet
  double relative_error_low = 0, relative_error_high = 0;  ///< its 95 % interval
  double asked_error = 0;
};

/// A finished rectangle of a layer. Shapes: values [height * width * channels], rows from the top.
struct Tile {
  int layer = 0;
  int pass = 0;
  int x = 0, y = 0, width = 0, height = 0;
  int channels = 4;
  std::vector<float> values;
  std::string layer_name = {};  ///< of the layer that it is a part of
  int layer_width = 0, layer_height = 0;
};

/// One named image. Shapes: values [height * width * channels], rows from the top.
struct Layer {
  std::string name;      ///< lightmap_0
  std::string quantity;  ///< irradiance
  std::string unit;      ///< lx
  int width = 0, height = 0, channels = 4;
  std::vector<float> values;
};

/// How a solve ended. Field for field radbake.v1.SolverReport, where the fields are explained.
struct SolverSummary {
  std::string solver;
  std::string status;
  int sweeps = 0;
  double residual = 0, error_bound = 0, relative_error_bound = 0, tolerance = 0;
  struct Point {
    std::uint64_t steps = 0, rows = 0;
    double residual = 0, relative_error_bound = 0;
  };
  std::vector<Point> history;
};

/// Field for field radbake.v1.EnergyAudit, where the fields are explained.
struct EnergyAudit {
  bool is_closed = false;
  double emitted = 0, absorbed = 0, gap = 0, gap_standard_error = 0, escaped = 0;
  double transported_relative_gap = 0, mean_irradiance = 0;
};

/// Field for field radbake.v1.TransportReport, where the fields are explained.
struct TransportSummary {
  std::uint64_t num_entries = 0;
  double raw_reciprocity_rms = 0, raw_closure_max = 0, paired_row_error_rms = 0, repaired_row_error_max = 0;
  int scaling_sweeps = 0;
  double escape_share = 0, absorbed_share = 0;
  double row_error_max = 0;
  std::uint64_t num_rows_clipped = 0;
};

/// Field for field radbake.v1.LightmapReport, where the fields are explained.
struct LightmapSummary {
  int atlas_size = 0;
  std::uint64_t num_texels = 0, num_texels_filled = 0, num_texels_dilated = 0;
  double texels_per_meter = 0;
  int atlas_height = 0, num_lightmaps = 0;
  double fill = 0;
  std::uint64_t num_meshes_kept = 0, num_meshes_placed = 0, num_meshes_unwrapped = 0, num_charts = 0;
  double max_stretch = 0;
  std::uint64_t num_seam_samples = 0;
  double seam_difference_before = 0, seam_difference = 0;
};

/// Field for field radbake.v1.VertexReport, where the fields are explained.
struct VertexSummary {
  std::uint64_t num_groups = 0, num_groups_filled = 0, num_copies = 0;
};

/// Field for field radbake.v1.ErrorReport, where the fields are explained.
struct ErrorSummary {
  double relative_rmse = 0, interval_low = 0, interval_high = 0;
  double algebraic = 0, sampling = 0, discretisation = 0;
  struct Worst {
    double error = 0;
    int lightmap = 0, x = 0, y = 0;
    std::string mesh;
  };
  Worst worst;
  double asked = 0, predicted = 0;
  bool is_reached = false;
  std::string limited_by;
  std::uint64_t num_texels = 0;
};

/// Field for field radbake.v1.PassReport and PassSeconds, where the fields are explained.
struct PassSummary {
  std::uint64_t num_patches = 0;
  int rays_per_row = 0, rays_per_texel = 0, light_samples_per_texel = 0;
  std::uint64_t num_gathered = 0, num_row_rays = 0, num_gather_rays = 0, num_light_rays = 0;
  double relative_rmse = 0, interval_low = 0, interval_high = 0;
  PassScale scale;
  bool is_whole = true;  ///< every texel has it: else the bake was asked to finish meanwhile, and cannot be replayed
  double seconds = 0, cpu_seconds = 0;  ///< since the bake began; may differ between equal bakes
};

struct StageTime {
  std::string stage;
  double seconds = 0;
  double cpu_seconds = 0;  ///< of the whole process
};

/// What a bake did. Everything but `stages`, `prediction` and `costs` is the same for equal bakes.
struct BakeReport {
  std::string instruction_set;
  BakePlan plan;
  std::uint64_t num_patches = 0, num_row_rays = 0, num_gather_rays = 0, num_light_rays = 0;
  SolverSummary solver;
  EnergyAudit energy;
  TransportSummary transport;
  LightmapSummary lightmap;
  VertexSummary vertices;
  ErrorSummary error;
  std::vector<PassSummary> passes;
  std::vector<Warning> warnings;
  std::vector<StageTime> stages;
  Prediction prediction;
  HostCosts costs;  ///< as this bake measured them
};

/// What a bake would do, and what it is expected to take.
struct PlannedBake {
  BakePlan plan;
  Prediction prediction;
};

struct BakeOutcome {
  std::vector<Layer> layers;
  std::vector<MeshOutput> meshes;  ///< [scene meshes]
  BakeReport report;
};

/// Watches a bake. Calls come from the bake's threads, one at a time; they must be quick.
class BakeObserver {
 public:
  virtual ~BakeObserver() = default;
  virtual void on_progress(const BakeProgress& progress) = 0;
  virtual void on_tile(const Tile& tile) = 0;
};

/// Checks a scene and says what a bake of it would do: layout, patches, counts. Traces no ray.
///
/// Errors: kInvalidArgument names the mesh, index or material and the value.
Result<PlannedBake> plan_scene(const Scene& scene, const BakeOptions& options, std::stop_token stop = {});

/// Bakes a scene: plan, patches, direct light, rows, solve, gather.
///
/// The result is a function of scene and options alone, bit for bit, for any number of threads; with a time budget, or
/// when `finish` is requested, of the passes too that the report tells.
/// Units:  metres, nit, cd, lx in; irradiance in lx out.
/// Errors: as plan_scene; kCancelled when stop was requested; kInternal when the solver did not converge.
/// `finish`, when requested, ends the bake with the best that it has: at the end of the first pass, or at once later.
/// `checkpoints`: where to keep, and find, what another attempt goes on from; null: nowhere. A bake that goes on tells
/// the seconds of its own attempt.
Result<BakeOutcome> bake_scene(const Scene& scene, const BakeOptions& options, BakeObserver& observer,
                               std::stop_token stop = {}, std::stop_token finish = {},
                               Checkpoints* checkpoints = nullptr);

}  // namespace radbake::radiosity
