#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {

template <Channels C>
void solve_by_jacobi(SolveMonitor<C>& monitor, std::vector<C>& radiosity) {
  const ProblemOf<C>& problem = monitor.problem();
  while (monitor.goes_on(radiosity)) {
    // B'_i <- source_i + (M F B')_i, all with the old values, which the look has gathered already.
    for (std::size_t i = 0; i < radiosity.size(); ++i) {
      radiosity[i] = problem.source[i] + problem.passed_on(i, monitor.irradiance());
    }
    monitor.add_steps(1, 0);
  }
}
template void solve_by_jacobi(SolveMonitor<double>&, std::vector<double>&);
template void solve_by_jacobi(SolveMonitor<Vec3>&, std::vector<Vec3>&);

}  // namespace radbake::radiosity
