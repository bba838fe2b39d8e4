#include "server/radiosity/plan/predict.h"

#include <algorithm>
#include <cmath>

namespace radbake::radiosity {
namespace {

// Measured on bakes of 2 to 60 s of ten scenes, see plan/docs/costs.md.

/// What the model is off by beside the spread of its costs: 95 % of bakes.
constexpr double kModelError = 0.25;
/// Share of the time in which all threads have work.
constexpr double kEfficiency = 0.95;
/// Seconds for each pixel of a layer: filled, seams levelled, sent.
constexpr double kPixelSeconds = 60e-9;
// Bytes.
constexpr double kProcess = 28e6;       ///< the worker before it has a scene
constexpr double kTriangle = 850;       ///< surfaces, tree, layout, patches' maps
constexpr double kPatch = 300;          ///< with its piece of the maps, its light and its row's sums
constexpr double kEstimatedEntry = 17;  ///< kept by rows, collected, transposed
constexpr double kPixel = 36;           ///< of the gather's layer, its state, and its copy in the outcome

double operator_bytes(const BakeWork& work) {
  if (work.num_rows <= 0 || work.transport == Transport::kStreamed) return 0;
  const double entries = work.num_rows * work.entries_per_row;
  const double paired = 8 * std::min(2 * entries, work.num_patches * work.num_patches);
  if (work.transport == Transport::kDense) {
    return std::max(kEstimatedEntry * entries + paired, paired + 8 * work.num_patches * work.num_patches);
  }
  return kEstimatedEntry * entries + paired;
}

StagePrediction stage(const char* name, double seconds, double relative_error, double threads, double bytes) {
  const double factor = std::exp(std::sqrt(4 * relative_error * relative_error + kModelError * kModelError));
  return {name,
          seconds,
          seconds / factor,
          seconds * factor,
          seconds / (threads > 1 ? threads * kEfficiency : 1),
          static_cast<std::uint64_t>(bytes)};
}

}  // namespace

std::vector<StagePrediction> predict_stages(const BakeWork& work, const HostCosts& costs, const CostSpread& spread) {
  const double scene = kProcess + work.scene_bytes + kTriangle * work.num_triangles + kPatch * work.num_patches;
  const auto channels = static_cast<double>(work.num_ray_channels);
  const double row = costs.row + work.rays_per_row * costs.row_ray + work.light_rays_per_row * costs.light_ray;
  const double rows = channels * work.num_rows * row;
  const double entries = channels * work.num_rows * work.entries_per_row;
  const double sweep = work.transport == Transport::kStreamed
                           ? rows
                           : 2 * entries * costs.entry_step * (work.num_solved_channels > 1 ? 1 : kOneChannelShare);
  const double receiver =
      costs.receiver + work.rays_per_receiver * costs.texel_ray + work.light_rays_per_receiver * costs.light_ray;
  const double pixels = work.num_pixels * work.num_layers;
  const double operators = operator_bytes(work);
  return {
      stage("preparing", work.preparing_seconds, 0, 1, scene),
      stage("form_factors", rows + (work.transport == Transport::kStreamed ? 0 : entries * costs.entry), spread.row,
            work.threads, scene + operators),
      stage("solving", work.sweeps * sweep, spread.row, work.threads, scene + operators),
      stage("gathering", channels * work.num_receivers * receiver + pixels * kPixelSeconds, spread.receiver,
            work.threads, scene + kPixel * pixels + 2 * work.num_vertex_bytes),
  };
}

StagePrediction total_of(const std::vector<StagePrediction>& stages) {
  StagePrediction total{"total", 0, 0, 0, 0, 0};
  for (const StagePrediction& own : stages) {
    total.cpu_seconds += own.cpu_seconds;
    total.cpu_seconds_low += own.cpu_seconds_low;
    total.cpu_seconds_high += own.cpu_seconds_high;
    total.wall_seconds += own.wall_seconds;
    total.memory_bytes = std::max(total.memory_bytes, own.memory_bytes);
  }
  return total;
}

double expected_sweeps(double passed_on, double tolerance) {
  constexpr double kLeast = 2, kMost = 10'000;
  if (!(passed_on > 0)) return kLeast;
  if (passed_on >= 1) return kMost;
  // A sweep of Gauss-Seidel is worth two of Jacobi, each of which leaves `passed_on` of the error.
  return std::clamp(std::log(tolerance * (1 - passed_on)) / (2 * std::log(passed_on)), kLeast, kMost);
}

}  // namespace radbake::radiosity
