#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {

template <Channels C>
void solve_by_gauss_seidel(SolveMonitor<C>& monitor, std::vector<C>& radiosity) {
  const TransportOperator& transport = monitor.transport();
  const ProblemOf<C>& problem = monitor.problem();
  while (monitor.goes_on(radiosity)) {
    // B'_i <- source_i + rho_i sum_j F_ij B'_j + tau_i sum_j F_opp(i)j B'_j, each with the newest values.
    std::int64_t num_rows = 0;
    for (std::uint32_t i = 0; i < radiosity.size(); ++i) {
      if (monitor.is_cancelled()) break;
      C passed_on = scaled_by(problem.reflectance[i], transport.gather_at(i, radiosity));
      ++num_rows;
      if (problem.transmits() && max_component(problem.transmittance[i]) > 0) {
        passed_on += scaled_by(problem.transmittance[i], transport.gather_at(problem.other_side[i], radiosity));
        ++num_rows;
      }
      radiosity[i] = problem.source[i] + passed_on;
    }
    monitor.add_steps(1, num_rows);
  }
}
template void solve_by_gauss_seidel(SolveMonitor<double>&, std::vector<double>&);
template void solve_by_gauss_seidel(SolveMonitor<Vec3>&, std::vector<Vec3>&);

}  // namespace radbake::radiosity
