#pragma once

#include <cstdint>

#include "server/radiosity/bake/bake.h"

namespace radbake::radiosity {

/// What the passes have written into a report.
template <typename Archive>
void keep_report(Archive& archive, BakeReport& report) {
  for (auto* count : {&report.num_patches, &report.num_row_rays, &report.num_gather_rays, &report.num_light_rays}) {
    archive(*count);
  }
  SolverSummary& solver = report.solver;
  archive(solver.solver);
  archive(solver.status);
  archive(solver.sweeps);
  for (double* value : {&solver.residual, &solver.error_bound, &solver.relative_error_bound, &solver.tolerance}) {
    archive(*value);
  }
  archive(solver.history);
  archive(report.energy);
  archive(report.transport);
  archive(report.error.limited_by);
  archive(report.error.predicted);
  archive(report.passes);
  auto num_warnings = static_cast<std::uint64_t>(report.warnings.size());
  archive(num_warnings);
  // Each has at least its two lengths.
  if (!archive.can_hold(num_warnings, 2 * sizeof(std::uint64_t))) return;
  report.warnings.resize(num_warnings);
  for (Warning& warning : report.warnings) {
    archive(warning.id);
    archive(warning.text);
  }
}

}  // namespace radbake::radiosity
