#include "server/radiosity/error/energy.h"

#include <cmath>
#include <vector>

namespace radbake::radiosity {

EnergyBalance audit_energy(const TransportOperator& transport, const EnergyTerms& terms) {
  const auto areas = transport.areas();
  EnergyBalance balance;
  balance.is_closed = terms.is_closed;
  double sent = 0, arrived = 0, leaving = 0, glow = 0, absorbed = 0, direct = 0, variance = 0;
  std::vector<Vec3> gathered(areas.size());
  transport.gather(terms.radiosity, gathered);
  for (std::uint32_t i = 0; i < areas.size(); ++i) {
    const Vec3 indirect = gathered[i];
    const Vec3 irradiance = indirect + terms.direct[i];
    const double own = mean_component(terms.radiosity[i]);
    sent += areas[i] * own;
    arrived += areas[i] * mean_component(indirect);
    // By reciprocity, A_i B'_i (1 - row sum) is what meets no patch.
    leaving += areas[i] * own * (1 - transport.row_sum(i));
    glow += areas[i] * mean_component(terms.glow[i]);
    absorbed += areas[i] * mean_component(scaled_by(Vec3{1, 1, 1} - terms.problem.reflectance[i], irradiance));
    if (terms.problem.transmits()) {
      // Of what arrives here, tau of the other side leaves there.
      const std::uint32_t other = terms.problem.other_side[i];
      absorbed -= areas[other] * mean_component(scaled_by(terms.problem.transmittance[other], irradiance));
    }
    direct += areas[i] * mean_component(terms.direct[i]);
    variance += areas[i] * areas[i] * terms.direct_variances[i];
  }
  if (sent > 0) balance.transported_relative_gap = std::fabs(sent - arrived - leaving) / sent;
  balance.emitted = glow + (terms.is_closed ? terms.light_flux : direct);
  balance.absorbed = absorbed;
  balance.escaped = terms.is_closed ? 0 : leaving;
  balance.gap = balance.emitted - balance.absorbed - balance.escaped;
  balance.gap_standard_error = std::sqrt(variance);
  return balance;
}

}  // namespace radbake::radiosity
