#pragma once

#include <span>

#include "common/geometry/vector.h"
#include "server/radiosity/solve/solve.h"
#include "server/radiosity/transport/operator.h"

namespace radbake::radiosity {

/// Sums over patches in the units of their areas, mean of the three channels. The report's EnergyAudit explains them.
struct EnergyBalance {
  bool is_closed = false;
  double emitted = 0;
  double absorbed = 0;
  double escaped = 0;
  double gap = 0;
  double gap_standard_error = 0;
  double transported_relative_gap = 0;
};

/// What an audit reads. Shapes: spans [n].
struct EnergyTerms {
  std::span<const Vec3> radiosity;           ///< B'
  const RadiosityProblem& problem;           ///< its shares of what arrives
  std::span<const Vec3> glow;                ///< E_in
  std::span<const Vec3> direct;              ///< H^direct, sky included
  std::span<const double> direct_variances;  ///< of the mean of the channels
  double light_flux = 0;                     ///< sent by emitters and lamps
  bool is_closed = false;                    ///< no ray escaped or was absorbed by a back
};

/// Audits a solved system twice.
///
///   transported: sum A B' = sum A H^indirect + what leaves      to solver tolerance, on a reciprocal operator
///   whole:       sum A E  = sum A (1 - rho - tau) H + what leaves     to the standard error of the direct light
///
/// In an open scene nobody counts the direct light that misses everything (and the sky and the sun have no flux of
/// their own): there the balance starts from the direct light that arrives, and audits the transported part alone.
EnergyBalance audit_energy(const TransportOperator& transport, const EnergyTerms& terms);

}  // namespace radbake::radiosity
