#include "server/radiosity/solve/solve.h"

#include <algorithm>
#include <string>

#include "common/base/check.h"
#include "server/radiosity/solve/solve_monitor.h"

namespace radbake::radiosity {
Result<Solver> solver_by_name(std::string_view name) {
  std::string names;
  for (const Solver solver : kAllSolvers) {
    if (name == solver_name(solver)) return solver;
    names += std::string(names.empty() ? "" : ", ") + solver_name(solver);
  }
  return invalid_argument("no solver is called '" + std::string(name) + "': choose one of " + names);
}

Solver default_solver(double max_reflectance) {
  constexpr double kManySweeps = 0.95;
  return max_reflectance > kManySweeps ? Solver::kKrylov : Solver::kGaussSeidel;
}

const char* solve_status_name(SolveStatus status) {
  switch (status) {
    case SolveStatus::kConverged: return "converged";
    case SolveStatus::kIterationLimit: return "iteration_limit";
    case SolveStatus::kTimeBudget: return "time_budget";
    case SolveStatus::kDiverged: return "diverged";
    case SolveStatus::kCancelled: return "cancelled";
  }
  return "unknown";
}

namespace {

Vec3 in_all_channels(Vec3 v) { return v; }
Vec3 in_all_channels(double v) { return {v, v, v}; }

template <Channels C>
Result<SolveReport> solve_channels(Solver solver, const TransportOperator& transport, const ProblemOf<C>& problem,
                                   const SolveOptions& options, std::vector<C>& radiosity,
                                   const SolveObserverOf<C>& observe, std::stop_token stop) {
  if (solver == Solver::kLu && transport.size() > options.max_lu_patches) {
    return invalid_argument("solver 'lu' is for at most " + std::to_string(options.max_lu_patches) +
                            " patches unless asked for by name; this scene has " + std::to_string(transport.size()));
  }
  RADBAKE_CHECK_EQ(radiosity.size(), transport.size());
  RADBAKE_CHECK(transport.is_one_matrix() || transport.is_by_columns() == reads_columns(solver));
  SolveMonitor<C> monitor(solver, transport, problem, options, observe, std::move(stop));
  std::vector<C> unshot;
  switch (solver) {
    case Solver::kLu: solve_by_lu(monitor, radiosity); break;
    case Solver::kJacobi: solve_by_jacobi(monitor, radiosity); break;
    case Solver::kGaussSeidel: solve_by_gauss_seidel(monitor, radiosity); break;
    case Solver::kSouthwell: solve_by_southwell(monitor, radiosity); break;
    case Solver::kShooting: solve_by_shooting(monitor, radiosity, unshot); break;
    case Solver::kKrylov: solve_by_krylov(monitor, radiosity); break;
  }
  SolveReport report = monitor.take_report();
  for (const C& v : unshot) report.unshot.push_back(in_all_channels(v));
  return report;
}

std::vector<double> means_of(const std::vector<Vec3>& values) {
  std::vector<double> means;
  means.reserve(values.size());
  for (const Vec3& v : values) means.push_back(mean_of_channels(v));
  return means;
}

}  // namespace

Result<SolveReport> solve(Solver solver, const TransportOperator& transport, const RadiosityProblem& problem,
                          const SolveOptions& options, std::vector<Vec3>& radiosity, const SolveObserver& observe,
                          std::stop_token stop) {
  return solve_channels(solver, transport, problem, options, radiosity, observe, std::move(stop));
}

Result<SolveReport> solve(Solver solver, const TransportOperator& transport, const GreyProblem& problem,
                          const SolveOptions& options, std::vector<double>& radiosity, const GreySolveObserver& observe,
                          std::stop_token stop) {
  return solve_channels(solver, transport, problem, options, radiosity, observe, std::move(stop));
}

Result<SolveReport> solve_grey(Solver solver, const TransportOperator& transport, const RadiosityProblem& problem,
                               const SolveOptions& options, std::vector<Vec3>& radiosity,
                               const GreySolveObserver& observe, std::stop_token stop) {
  const GreyProblem grey{means_of(problem.source), means_of(problem.reflectance), means_of(problem.transmittance),
                         problem.other_side};
  std::vector<double> values = means_of(radiosity);
  RADBAKE_ASSIGN_OR_RETURN(SolveReport report,
                           solve(solver, transport, grey, options, values, observe, std::move(stop)));
  for (std::size_t i = 0; i < values.size(); ++i) radiosity[i] = in_all_channels(values[i]);
  return report;
}

std::vector<Vec3> ambient_display(std::span<const double> areas, std::span<const Vec3> reflectance,
                                  std::span<const Vec3> radiosity, std::span<const Vec3> unshot) {
  RADBAKE_CHECK_EQ(reflectance.size(), areas.size());
  RADBAKE_CHECK_EQ(radiosity.size(), areas.size());
  RADBAKE_CHECK_EQ(unshot.size(), areas.size());
  std::vector<Vec3> shown(radiosity.begin(), radiosity.end());
  double area = 0;
  Vec3 reflecting, unshot_flux;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    area += areas[i];
    reflecting += reflectance[i] * areas[i];
    unshot_flux += unshot[i] * areas[i];
  }
  if (!(area > 0)) return shown;
  // R sum A dB / sum A = sum A dB / sum A (1 - rho).
  const Vec3 kept = Vec3{area, area, area} - reflecting;
  const Vec3 ambient{unshot_flux.x / kept.x, unshot_flux.y / kept.y, unshot_flux.z / kept.z};
  for (std::size_t i = 0; i < areas.size(); ++i) shown[i] += scaled_by(reflectance[i], ambient);
  return shown;
}

}  // namespace radbake::radiosity
