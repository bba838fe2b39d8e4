#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <vector>

#include "common/base/result.h"
#include "server/radiosity/bake/bake.h"
#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/bake/radiosity_system.h"

namespace radbake::radiosity {

/// What the patches send, as one replicate of the chain has it. Shapes: [patches], lx.
struct PatchLight {
  std::vector<Vec3> radiosity;  ///< B'
  std::vector<Vec3> glow;       ///< E_in
  std::vector<Vec3> coarser;    ///< B' of patches twice as large
};

/// What one replicate was made of, for the report; of several channels with rows of their own, the first's.
struct PatchLightReport {
  TransportSummary transport;
  SolverSummary solver;
  EnergyAudit energy;
  std::uint64_t num_row_rays = 0, num_light_rays = 0;
  std::vector<Warning> warnings;
};

/// One replicate of the system: a system for each channel that see-through surfaces tell apart, else one for all.
struct ReplicateSystem {
  double tolerance = 0;  ///< as SystemSettings has it
  std::vector<std::unique_ptr<RadiositySystem>> of_channel;
  PatchLightReport report;
};

/// Estimates the rows of one replicate. on_row as in sample_patches(). Errors: kCancelled.
Result<ReplicateSystem> estimate_system(const Preparation& prepared, const SystemSettings& settings,
                                        const OnRow& on_row, std::stop_token stop);

/// Solves it; the system is used up but for its report. on_step(steps, relative error bound) while the solver works.
/// Errors: kCancelled; kInternal where the solver did not converge.
Result<PatchLight> solve_patch_light(const Preparation& prepared, ReplicateSystem& system,
                                     const std::function<void(std::uint64_t, double)>& on_step, std::stop_token stop);

}  // namespace radbake::radiosity
