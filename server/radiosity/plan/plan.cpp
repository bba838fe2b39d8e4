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
  RADBAKE_RETURN_IF_ERROR(check_range("texels per metre", options.texels_per_meter, kMinTexelsPerMeter, 1e9));
  RADBAKE_RETURN_IF_ERROR(check_range("rays", options.rays, kMinRays, kMaxRays));
  RADBAKE_RETURN_IF_ERROR(check_range("max patches", options.max_patches, kMinMaxPatches, 1 << 24));
  RADBAKE_RETURN_IF_ERROR(check_range("ambient occlusion distance", options.ao_distance, 1e-6, 1e9));
  RADBAKE_RETURN_IF_ERROR(check_range("light samples", options.light_samples, 4, kMaxRays));
  RADBAKE_RETURN_IF_ERROR(check_range("spacing", options.spacing, 1, 8));
  RADBAKE_RETURN_IF_ERROR(check_range("largest error", options.max_error, 1e-6, 1.0));
  RADBAKE_RETURN_IF_ERROR(check_range("time budget", options.time_budget_seconds, 1e-6, 1e9));
  if (options.rays > 0 && asks_for_result(options)) {
    return invalid_argument("rays ask for a setting, a largest error or a time budget for a result: ask for one");
  }
  RADBAKE_RETURN_IF_ERROR(check_range("threads", options.threads, 1, 4096));
  RADBAKE_RETURN_IF_ERROR(
      check_range("transport memory", options.transport_memory, std::uint64_t{1} << 10, std::uint64_t{1} << 50));
  if (options.output == Output::kVertices && (options.wants_direct || options.wants_indirect || options.wants_ao)) {
    return invalid_argument("layers are lightmaps, and with light by vertex alone there are none");
  }
  return {};
}

int max_patches_of(const BakeOptions& options) {
  if (options.max_patches > 0) return options.max_patches;
  return options.form_factors == FormFactors::kAnalytic ? kDefaultMaxPatchesByFormula : kDefaultMaxPatches;
}

namespace {

std::string in_megabytes(std::uint64_t bytes) {
  std::ostringstream text;
  text.precision(3);
  text << static_cast<double>(bytes) * 1e-6 << " MB";
  return text.str();
}

/// Says why each method is what it is.
void give_reasons(const BakeOptions& options, std::uint64_t row_entries, BakePlan& plan) {
  const std::string asked = "as asked: ";
  const std::string rays =
      std::to_string(plan.rays_per_row) + " rays for each row of " + std::to_string(plan.num_patches) + " patches";
  switch (plan.form_factors) {
    case FormFactors::kAuto:
    case FormFactors::kHemisphere: plan.form_factors_reason = rays; break;
    case FormFactors::kAdaptive:
      plan.form_factors_reason = "near and large pairs by formula, the rest by " + rays;
      break;
    case FormFactors::kHemicube:
      plan.form_factors_reason = "cubes of " + std::to_string(kHemicubeResolution) + " cells a side for the rows of " +
                                 std::to_string(plan.num_patches) + " patches";
      break;
    case FormFactors::kAnalytic:
      plan.form_factors_reason = "by formula between " + std::to_string(plan.num_patches) + " patches";
      break;
  }
  if (options.form_factors != FormFactors::kAuto) plan.form_factors_reason = asked + plan.form_factors_reason;

  const std::string bytes = in_megabytes(plan.transport_bytes), limit = in_megabytes(plan.transport_bytes_limit);
  switch (plan.transport) {
    case Transport::kAuto:
    case Transport::kSparse:
      plan.transport_reason = "at most " + std::to_string(std::min(row_entries, plan.num_patches)) + " of " +
                              std::to_string(plan.num_patches) + " form factors a row: " + bytes;
      break;
    case Transport::kDense: plan.transport_reason = "rows are nearly full: " + bytes; break;
    case Transport::kStreamed:
      plan.transport_reason = options.transport == Transport::kStreamed
                                  ? "rows are made anew in each step: " + bytes
                                  : "stored rows would not fit " + limit + ": they are made anew in each step";
      break;
  }
  if (options.transport != Transport::kAuto) plan.transport_reason = asked + plan.transport_reason;

  std::ostringstream reflects;
  reflects.precision(3);
  reflects << "surfaces reflect up to " << 100 * plan.survey.max_reflectance << " %";
  plan.solver_reason = options.solver                           ? asked + reflects.str()
                       : plan.transport == Transport::kStreamed ? "fewest steps where each makes all rows anew"
                       : plan.solver == Solver::kKrylov         ? reflects.str() + ": sweeps would be many"
                                                                : reflects.str() + ": few sweeps";
}

}  // namespace

int num_replicates_of(FormFactors method) {
  constexpr int kReplicates = 4;  // no fewer tell their spread
  return method == FormFactors::kHemisphere || method == FormFactors::kAdaptive ? kReplicates : 1;
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
  give_reasons(options, row_entries, plan);
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
