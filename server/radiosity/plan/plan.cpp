#include "server/radiosity/plan/plan.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "server/radiosity/form_factor/hemicube_rows.h"

namespace radbake::radiosity {
namespace {

constexpr double kTexelsPerPatchEdge = 4;
constexpr double kMinPatches = 1024;

template <typename T>
Result<void> check_range(const char* name, T value, T low, T high) {
  if (value == T{} || (value >= low && value <= high)) return {};
  std::ostringstream out;
  out << name << " " << value << " is not within " << low << ".." << high;
  return invalid_argument(out.str());
}

}  // namespace

Result<void> check_options(const BakeOptions& options) {
  RADBAKE_RETURN_IF_ERROR(check_range("atlas size", options.atlas_size, kMinAtlasSize, kMaxAtlasSize));
  RADBAKE_RETURN_IF_ERROR(check_range("texels per metre", options.texels_per_meter, 1e-6, 1e9));
  RADBAKE_RETURN_IF_ERROR(check_range("rays", options.rays, kMinRays, kMaxRays));
  RADBAKE_RETURN_IF_ERROR(check_range("max patches", options.max_patches, kMinMaxPatches, 1 << 24));
  RADBAKE_RETURN_IF_ERROR(check_range("ambient occlusion distance", options.ao_distance, 1e-6, 1e9));
  RADBAKE_RETURN_IF_ERROR(check_range("threads", options.threads, 1, 4096));
  RADBAKE_RETURN_IF_ERROR(
      check_range("transport memory", options.transport_memory, std::uint64_t{1} << 10, std::uint64_t{1} << 50));
  return {};
}

int max_patches_of(const BakeOptions& options) {
  if (options.max_patches > 0) return options.max_patches;
  return options.form_factors == FormFactors::kAnalytic ? kDefaultMaxPatchesByFormula : kDefaultMaxPatches;
}

void choose_methods(const BakeOptions& options, BakePlan& plan) {
  plan.form_factors = options.form_factors == FormFactors::kAuto ? FormFactors::kHemisphere : options.form_factors;

  // By formula a row may have every patch in it, by rays no more than it has rays. (The exchanges that both directions
  // of a pair share by formula are less than what their rows take later.)
  std::uint64_t row_entries = plan.num_patches;
  if (plan.form_factors == FormFactors::kHemisphere) row_entries = static_cast<std::uint64_t>(plan.rays_per_row);
  if (plan.form_factors == FormFactors::kHemicube) row_entries = 3 * kHemicubeResolution * kHemicubeResolution;
  plan.transport_bytes_limit = options.transport_memory > 0 ? options.transport_memory : kDefaultTransportMemory;
  plan.transport = options.transport != Transport::kAuto
                       ? options.transport
                       : choose_transport(plan.num_patches, row_entries, plan.transport_bytes_limit);
  plan.transport_bytes = transport_bytes(plan.transport, plan.num_patches, row_entries);

  const Solver solver =
      plan.transport == Transport::kStreamed ? Solver::kKrylov : default_solver(plan.survey.max_reflectance);
  plan.solver = options.solver.value_or(solver);
}

int max_sweeps_of(double max_reflectance, double tolerance) {
  constexpr double kMargin = 2, kMost = 1e6;
  const int least = SolveOptions{}.max_sweeps;
  if (!(max_reflectance > 0 && max_reflectance < 1)) return least;
  const double sweeps = kMargin * std::log(tolerance * (1 - max_reflectance)) / std::log(max_reflectance);
  return std::max(least, static_cast<int>(std::min(sweeps, kMost)));
}

double patch_edge(double texel_edge, double area, std::size_t max_patches) {
  const double coarsest = std::sqrt(area / kMinPatches);
  const double finest = std::sqrt(area / static_cast<double>(max_patches));
  return std::max(std::min(kTexelsPerPatchEdge * texel_edge, coarsest), finest);
}

}  // namespace radbake::radiosity
