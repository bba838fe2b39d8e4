#pragma once

#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "common/geometry/vector.h"
#include "server/radiosity/transport/operator.h"

namespace radbake::radiosity {

/// B' = source + rho (F B'): source = E_in + rho H^direct. Shapes: both [n]; channels are solved side by side.
struct RadiosityProblem {
  std::vector<Vec3> source;
  std::vector<Vec3> reflectance;  ///< each channel in [0, 1)
};

struct SolveOptions {
  double relative_tolerance = 1e-6;  ///< of the error bound against the mean radiosity
  int max_sweeps = 2000;
};

enum class SolveStatus { kConverged, kIterationLimit, kDiverged, kCancelled };
const char* solve_status_name(SolveStatus status);

/// How a solve ended. A solve that stops early is a result with its residual, not an exception.
struct SolveReport {
  SolveStatus status = SolveStatus::kIterationLimit;
  int sweeps = 0;
  double residual = 0;              ///< max |r| over patches and channels, r = source - (I - rho F) B'
  double error_bound = 0;           ///< max |B' - exact| is at most this
  double relative_error_bound = 0;  ///< over the mean radiosity, weighted by area
  std::vector<double> history;      ///< relative error bound after each sweep
};

/// Solves by Gauss-Seidel sweeps, in the order of the patches.
///
/// Stops on the bound max|B' - exact| <= (max|r| + rounding) / (1 - max_i(rho_i (F1)_i)), never on the step size.
/// Shapes: radiosity [n], in: first guess, out: solution.
/// Cost:   one pass over the operator's entries a sweep, and one for the residual.
/// Source: Cohen & Greenberg 1985 (gathering); Varah 1975 (the bound, for diagonally dominant matrices).
SolveReport solve_gauss_seidel(const TransportOperator& transport, const RadiosityProblem& problem,
                               const SolveOptions& options, std::vector<Vec3>& radiosity,
                               const std::function<void(int sweep, double relative_error_bound)>& observe,
                               std::stop_token stop);

}  // namespace radbake::radiosity
