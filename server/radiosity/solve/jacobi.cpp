#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {

void solve_by_jacobi(SolveMonitor& monitor, std::vector<Vec3>& radiosity) {
  const RadiosityProblem& problem = monitor.problem();
  while (monitor.goes_on(radiosity)) {
    // B'_i <- source_i + rho_i sum_j F_ij B'_j, all with the old values, which the look has gathered already.
    for (std::size_t i = 0; i < radiosity.size(); ++i) {
      radiosity[i] = problem.source[i] + scaled_by(problem.reflectance[i], monitor.irradiance()[i]);
    }
    monitor.add_steps(1, 0);
  }
}

}  // namespace radbake::radiosity
