#include "server/radiosity/bake/patch_light.h"

#include <limits>
#include <memory>
#include <string>

#include "server/radiosity/error/energy.h"
#include "server/radiosity/solve/solve.h"

namespace radbake::radiosity {
namespace {

Error cancelled() { return {ErrorCode::kCancelled, "the bake was cancelled"}; }

/// The course of a solve in so many points that a plot looks the same.
std::vector<SolverSummary::Point> thinned(const std::vector<SolveStep>& history) {
  constexpr std::size_t kMostPoints = 100;
  std::vector<SolverSummary::Point> points;
  const std::size_t step = history.size() / kMostPoints + 1;
  for (std::size_t k = 0; k < history.size(); ++k) {
    if (k % step != 0 && k + 1 != history.size()) continue;
    points.push_back({static_cast<std::uint64_t>(history[k].steps), static_cast<std::uint64_t>(history[k].work),
                      history[k].residual, history[k].relative_error_bound});
  }
  return points;
}

/// The system of a channel: the other two become copies of it.
void keep_channel(int channel, RadiositySystem& system) {
  for (auto* values : {&system.problem.source, &system.problem.reflectance, &system.problem.transmittance, &system.glow,
                       &system.direct}) {
    for (Vec3& value : *values) value = Vec3{1, 1, 1} * value[channel];
  }
}

/// System -> radiosity, with the report's solver and energy.
Result<std::vector<Vec3>> solve_system(const BakePlan& plan, const RadiositySystem& system, double tolerance,
                                       bool is_of_one_channel,
                                       const std::function<void(std::uint64_t, double)>& on_step, std::stop_token stop,
                                       PatchLightReport& report) {
  SolveOptions options;
  if (tolerance > 0) options.relative_tolerance = tolerance;
  options.max_sweeps = max_sweeps_of(plan.survey.max_reflectance, options.relative_tolerance);
  options.max_lu_patches = std::numeric_limits<std::size_t>::max();  // never chosen but by name
  std::vector<Vec3> radiosity = system.problem.source;
  const auto show = [&](const auto& view) {
    on_step(static_cast<std::uint64_t>(view.step.steps), view.step.relative_error_bound);
  };
  // Where all is grey, and where each channel has rows of its own, one stands for three.
  const bool is_grey = plan.num_channels == 1 || is_of_one_channel;
  RADBAKE_ASSIGN_OR_RETURN(
      const SolveReport solved,
      is_grey ? solve_grey(plan.solver, *system.transport, system.problem, options, radiosity, show, stop)
              : solve(plan.solver, *system.transport, system.problem, options, radiosity, show, stop));
  report.solver = {solver_name(solved.solver),
                   solve_status_name(solved.status),
                   solved.sweeps,
                   solved.residual,
                   solved.error_bound,
                   solved.relative_error_bound,
                   options.relative_tolerance,
                   thinned(solved.history)};
  if (stop.stop_requested() || solved.status == SolveStatus::kCancelled) return cancelled();
  if (solved.status != SolveStatus::kConverged) {
    return internal_error("the solver " + report.solver.solver + " did not converge (" + report.solver.status +
                          " after " + std::to_string(solved.sweeps) + " sweeps, residual " +
                          std::to_string(solved.residual) +
                          " lx): the scene passes on nearly all of its light; lower the largest reflectance, " +
                          std::to_string(plan.survey.max_reflectance) + ", or choose another --solver");
  }
  EnergyTerms terms{radiosity, system.problem, system.glow, system.direct, system.direct_variances};
  terms.light_flux = system.emitted_lumens;
  // Of a channel by itself the flux of the lights is not known.
  terms.is_closed = report.transport.escape_share == 0 && report.transport.absorbed_share == 0 && !is_of_one_channel;
  const EnergyBalance balance = audit_energy(*system.transport, terms);
  report.energy = {balance.is_closed,
                   balance.emitted,
                   balance.absorbed,
                   balance.gap,
                   balance.gap_standard_error,
                   balance.escaped,
                   balance.transported_relative_gap,
                   0};
  return radiosity;
}

}  // namespace

Result<ReplicateSystem> estimate_system(const Preparation& prepared, const SystemSettings& settings,
                                        const OnRow& on_row, std::stop_token stop) {
  const int num_channels = prepared.num_ray_channels();
  ReplicateSystem replicate;
  replicate.tolerance = settings.tolerance;
  for (int channel = 0; channel < num_channels; ++channel) {
    const auto of_all = [&](std::uint64_t done, std::uint64_t total, bool is_new) {
      on_row(total * static_cast<std::uint64_t>(channel) + done, total * static_cast<std::uint64_t>(num_channels),
             is_new);
    };
    RADBAKE_ASSIGN_OR_RETURN(auto system, make_radiosity_system(prepared, settings, channel, of_all, stop));
    if (num_channels > 1) keep_channel(channel, *system);
    replicate.report.num_row_rays += system->num_row_rays;
    replicate.report.num_light_rays += system->num_light_rays;
    replicate.of_channel.push_back(std::move(system));
  }
  replicate.report.transport = replicate.of_channel.front()->summary;
  replicate.report.warnings = replicate.of_channel.front()->warnings;
  return replicate;
}

Result<PatchLight> solve_patch_light(const Preparation& prepared, ReplicateSystem& replicate,
                                     const std::function<void(std::uint64_t, double)>& on_step, std::stop_token stop) {
  const std::size_t num_channels = replicate.of_channel.size();
  PatchLight light;
  for (std::size_t channel = 0; channel < num_channels; ++channel) {
    const auto system = std::move(replicate.of_channel[channel]);
    std::vector<Vec3> own;
    if (system->transport) {
      RADBAKE_ASSIGN_OR_RETURN(own, solve_system(prepared.plan, *system, replicate.tolerance, num_channels > 1, on_step,
                                                 stop, replicate.report));
    } else {
      replicate.report.solver.solver = "none";
      replicate.report.solver.status = "converged";
      own = system->glow;
    }
    if (num_channels == 1) return PatchLight{std::move(own), std::move(system->glow), {}};
    light.radiosity.resize(own.size());
    light.glow.resize(own.size());
    for (std::size_t i = 0; i < own.size(); ++i) {
      light.radiosity[i][static_cast<int>(channel)] = own[i][static_cast<int>(channel)];
      light.glow[i][static_cast<int>(channel)] = system->glow[i][static_cast<int>(channel)];
    }
  }
  return light;
}

}  // namespace radbake::radiosity
