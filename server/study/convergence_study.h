#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene.h"
#include "server/radiosity/bake/bake.h"
#include "server/radiosity/solve/solve.h"
#include "server/study/plot.h"

namespace radbake::study {

/// Where a solver stood.
struct ConvergencePoint {
  std::int64_t steps = 0;    ///< as the solver counts them (solve.h)
  std::int64_t patches = 0;  ///< gathered or shot by then; 0: lu, whose steps are not of that kind
  std::int64_t work = 0;     ///< rows and columns read, those of residuals included
  double seconds = 0;
  double error = 0;  ///< sqrt(sum A |B' - exact|^2 / sum A |exact|^2)
};

struct ConvergenceCurve {
  std::string name;    ///< solver_name(), or "shooting+ambient": what is shown meanwhile
  std::string status;  ///< how it ended
  std::vector<ConvergencePoint> points;
};

struct ConvergenceStudy {
  std::size_t num_patches = 0;
  double reference_error = 0;  ///< bound on the error of what the others are measured against, over its mean
  std::vector<ConvergenceCurve> curves;
  std::vector<std::string> left_out;  ///< solvers and why
};

/// Solves one system by every solver, from 0, and measures its error on the way.
///
/// Exact stands for a solution of a thousandth of the tolerance, by `lu` up to 1000 patches and `krylov` above. Seconds
/// are those of a run of its own, without measuring, the fastest of three or more. Precondition: an operator of one
/// matrix, dense or sparse.
ConvergenceStudy study_convergence(const radiosity::TransportOperator& transport,
                                   const radiosity::RadiosityProblem& problem, double tolerance);

/// The same for the system of a scene, made as a bake makes it.
/// Errors: as plan_scene(); kInvalidArgument where the operator would be streamed: its rows and columns are two
/// matrices.
Result<ConvergenceStudy> study_convergence_of(const Scene& scene, const radiosity::BakeOptions& options,
                                              double tolerance);

/// solver,steps,patches,work,seconds,relative_error
std::string convergence_csv(const ConvergenceStudy& study);

/// What each solver takes to come within 10 %, 1 %, 1e-3 and 1e-6, in patches gathered or shot over their number, and
/// in seconds.
std::string convergence_table(const ConvergenceStudy& study);

/// Error over steps, over rows and columns read, and over seconds.
Plot convergence_plot(const ConvergenceStudy& study);

}  // namespace radbake::study
