#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {

template <Channels C>
void solve_by_gauss_seidel(SolveMonitor<C>& monitor, std::vector<C>& radiosity) {
  const TransportOperator& transport = monitor.transport();
  const ProblemOf<C>& problem = monitor.problem();
  while (monitor.goes_on(radiosity)) {
    // B'_i <- source_i + rho_i sum_j F_ij B'_j, each with the newest values.
    for (std::uint32_t i = 0; i < radiosity.size(); ++i) {
      if (monitor.is_cancelled()) break;
      radiosity[i] = problem.source[i] + scaled_by(problem.reflectance[i], transport.gather_at(i, radiosity));
    }
    monitor.add_steps(1, static_cast<std::int64_t>(radiosity.size()));
  }
}
template void solve_by_gauss_seidel(SolveMonitor<double>&, std::vector<double>&);
template void solve_by_gauss_seidel(SolveMonitor<Vec3>&, std::vector<Vec3>&);

}  // namespace radbake::radiosity
