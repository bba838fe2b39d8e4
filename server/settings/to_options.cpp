#include "server/settings/to_options.h"

#include <optional>

namespace radbake::settings {
namespace {

radiosity::LightmapUv to_lightmap_uv(v1::LightmapUv uv) {
  if (uv == v1::LIGHTMAP_UV_KEEP) return radiosity::LightmapUv::kKeep;
  return uv == v1::LIGHTMAP_UV_UNWRAP ? radiosity::LightmapUv::kUnwrap : radiosity::LightmapUv::kAuto;
}

radiosity::Output to_output(v1::Output output) {
  if (output == v1::OUTPUT_VERTICES) return radiosity::Output::kVertices;
  return output == v1::OUTPUT_BOTH ? radiosity::Output::kBoth : radiosity::Output::kLightmap;
}

radiosity::FormFactors to_form_factors(v1::FormFactors method) {
  switch (method) {
    case v1::FORM_FACTORS_ANALYTIC: return radiosity::FormFactors::kAnalytic;
    case v1::FORM_FACTORS_HEMICUBE: return radiosity::FormFactors::kHemicube;
    case v1::FORM_FACTORS_HEMISPHERE: return radiosity::FormFactors::kHemisphere;
    case v1::FORM_FACTORS_ADAPTIVE: return radiosity::FormFactors::kAdaptive;
    default: return radiosity::FormFactors::kAuto;
  }
}

radiosity::Transport to_transport(v1::Transport transport) {
  switch (transport) {
    case v1::TRANSPORT_DENSE: return radiosity::Transport::kDense;
    case v1::TRANSPORT_SPARSE: return radiosity::Transport::kSparse;
    case v1::TRANSPORT_STREAMED: return radiosity::Transport::kStreamed;
    default: return radiosity::Transport::kAuto;
  }
}

std::optional<radiosity::Solver> to_solver(v1::Solver solver) {
  switch (solver) {
    case v1::SOLVER_LU: return radiosity::Solver::kLu;
    case v1::SOLVER_JACOBI: return radiosity::Solver::kJacobi;
    case v1::SOLVER_GAUSS_SEIDEL: return radiosity::Solver::kGaussSeidel;
    case v1::SOLVER_SOUTHWELL: return radiosity::Solver::kSouthwell;
    case v1::SOLVER_SHOOTING: return radiosity::Solver::kShooting;
    case v1::SOLVER_KRYLOV: return radiosity::Solver::kKrylov;
    default: return std::nullopt;
  }
}

}  // namespace

radiosity::BakeOptions to_options(const v1::BakeSettings& settings, const v1::RunOptions& run) {
  radiosity::BakeOptions options;
  options.atlas_size = static_cast<int>(settings.atlas_size());
  options.texels_per_meter = settings.texels_per_meter();
  options.rays = static_cast<int>(settings.rays());
  options.max_patches = static_cast<int>(settings.max_patches());
  options.seed = settings.seed();
  options.lightmap_uv = to_lightmap_uv(settings.lightmap_uv());
  options.output = to_output(settings.output());
  options.form_factors = to_form_factors(settings.form_factors());
  options.transport = to_transport(settings.transport());
  options.solver = to_solver(settings.solver());
  options.transport_memory = settings.transport_memory_bytes();
  options.threads = static_cast<int>(run.threads());
  return options;
}

}  // namespace radbake::settings
