#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <stop_token>
#include <string_view>
#include <vector>

#include "common/base/result.h"
#include "common/geometry/vector.h"
#include "server/radiosity/transport/operator.h"

namespace radbake::radiosity {

/// B' = source + M (F B'), M H = rho_i H_i + tau_i H_opp(i): source = E_in + M H^direct. Channels are solved side by
/// side. Where nothing lets light through diffusely, `transmittance` and `other_side` are empty, and M is rho.
/// Shapes: all [n], or empty.
template <Channels C>
struct ProblemOf {
  std::vector<C> source;                       ///< each channel >= 0
  std::vector<C> reflectance;                  ///< each channel in [0, 1)
  std::vector<C> transmittance = {};           ///< tau_i, of what arrives on the other side; rho_i + tau_i < 1
  std::vector<std::uint32_t> other_side = {};  ///< opp(i); i itself where there is none, and tau_i is 0 then

  bool transmits() const { return !transmittance.empty(); }
  /// (M H)_i
  C passed_on(std::size_t i, std::span<const C> irradiance) const {
    C out = scaled_by(reflectance[i], irradiance[i]);
    if (transmits()) out += scaled_by(transmittance[i], irradiance[other_side[i]]);
    return out;
  }
};
using RadiosityProblem = ProblemOf<Vec3>;
using GreyProblem = ProblemOf<double>;

/// What a step is: the factorisation or a refinement of `lu`, a sweep over all patches of `jacobi` and `gauss-seidel`,
/// one patch of `southwell` and `shooting`, one direction of `krylov`.
enum class Solver { kLu, kJacobi, kGaussSeidel, kSouthwell, kShooting, kKrylov };
inline constexpr Solver kAllSolvers[] = {Solver::kLu,        Solver::kJacobi,   Solver::kGaussSeidel,
                                         Solver::kSouthwell, Solver::kShooting, Solver::kKrylov};

/// "lu", "jacobi", "gauss-seidel", "southwell", "shooting", "krylov".
inline const char* solver_name(Solver solver) {
  switch (solver) {
    case Solver::kLu: return "lu";
    case Solver::kJacobi: return "jacobi";
    case Solver::kGaussSeidel: return "gauss-seidel";
    case Solver::kSouthwell: return "southwell";
    case Solver::kShooting: return "shooting";
    case Solver::kKrylov: return "krylov";
  }
  return "unknown";
}

/// Southwell and shooting; the others read rows.
inline bool reads_columns(Solver solver) { return solver == Solver::kSouthwell || solver == Solver::kShooting; }

/// Errors: invalid_argument that lists the names.
Result<Solver> solver_by_name(std::string_view name);

/// Gauss-Seidel; Krylov where a reflectance is above 0.95, as sweeps grow in number like 1 / (1 - rho).
Solver default_solver(double max_reflectance);

inline constexpr std::size_t kMaxLuPatches = 1000;

struct SolveOptions {
  double relative_tolerance = 1e-6;  ///< of the error bound against the mean radiosity
  int max_sweeps = 2000;             ///< limit on steps; times n for southwell and shooting
  double time_budget_seconds = std::numeric_limits<double>::infinity();  ///< looked at after each step
  std::size_t max_lu_patches = kMaxLuPatches;                            ///< raised by who asks for `lu` by name
};

enum class SolveStatus {
  kConverged,       ///< the bound is within the tolerance
  kIterationLimit,  ///< the steps are used up, or none changes anything: the tolerance is below rounding
  kTimeBudget,
  kDiverged,   ///< the residual grows, a number is not finite, or a row would pass on all it gets: no bound exists
  kCancelled,  ///< residual and bound are those of the last full look, not of the radiosity
};
const char* solve_status_name(SolveStatus status);

/// Where a solve stands after some steps.
struct SolveStep {
  std::int64_t steps = 0;
  std::int64_t work = 0;  ///< rows and columns read so far, those read for residuals included
  double seconds = 0;
  /// max |r| over patches and channels, r = source - (I - M F) B'. Southwell, shooting and krylov carry it along
  /// between full looks (shooting: a bound on it).
  double residual = std::numeric_limits<double>::infinity();
  double error_bound = std::numeric_limits<double>::infinity();           ///< max |B' - exact| is at most this
  double relative_error_bound = std::numeric_limits<double>::infinity();  ///< over the mean radiosity, by area
};

/// How a solve ended. A solve that stops early is a result with its residual, not an exception.
struct SolveReport {
  Solver solver = Solver::kGaussSeidel;
  SolveStatus status = SolveStatus::kIterationLimit;
  std::int64_t steps = 0;
  int sweeps = 0;  ///< steps; of southwell and shooting, steps / n
  std::int64_t work = 0;
  double seconds = 0;
  double residual = std::numeric_limits<double>::infinity();
  double error_bound = std::numeric_limits<double>::infinity();
  double relative_error_bound = std::numeric_limits<double>::infinity();
  std::vector<SolveStep> history;  ///< the first guess, then each step; of southwell and shooting about 2 % apart
  std::vector<Vec3> unshot;        ///< shooting only: what each patch has not yet sent, for ambient_display(); of one
                                   ///< channel: in all three
};

/// What an observer sees. The spans last for the call. Unshot is empty but for shooting.
template <Channels C>
struct SolveViewOf {
  const SolveStep& step;
  std::span<const C> radiosity;
  std::span<const C> unshot;
};
using SolveView = SolveViewOf<Vec3>;
/// Called for each entry of the history, on the thread that solves.
template <Channels C>
using SolveObserverOf = std::function<void(const SolveViewOf<C>&)>;
using SolveObserver = SolveObserverOf<Vec3>;
using GreySolveObserver = SolveObserverOf<double>;

/// Solves by the method asked for.
///
/// Stops on the bound, never on the size of a step:
///
///   max|B' - exact| <= (max|r| + rounding) / (1 - max_i (M F 1)_i)
///
/// Of an operator that is known by columns (Southwell and shooting only, checked) |.| is the mean by area instead of
/// the largest, and the divisor 1 - max_j sum_i A_i (M F)_ij / A_j: light that is sent on.
///
/// Southwell and shooting read columns, the others rows. Every sum runs in a fixed order: equal bits for any number of
/// threads. The clock decides only where a time budget ends a solve.
/// Shapes: radiosity [n], in: first guess (0 gives the classic course of shooting), out: solution.
/// Errors: invalid_argument for `lu` above options.max_lu_patches. Numbers that are not finite end as kDiverged.
/// Cost:   one pass over the operator a sweep, and one for each look at the residual; `lu` n^3/3 and 16 n^2 bytes.
/// Source: Goral et al. 1984 (lu); Cohen & Greenberg 1985 (gathering); Gortler, Cohen & Slusallek 1993 (southwell);
///         Cohen, Chen, Wallace & Greenberg 1988 (shooting); Hestenes & Stiefel 1952, van der Vorst 1992 (krylov);
///         Varah 1975 (the bound, for diagonally dominant matrices).
Result<SolveReport> solve(Solver solver, const TransportOperator& transport, const RadiosityProblem& problem,
                          const SolveOptions& options, std::vector<Vec3>& radiosity, const SolveObserver& observe,
                          std::stop_token stop);

/// The same in one channel: of three equal ones each has the same bits, and so has the report, in less time.
Result<SolveReport> solve(Solver solver, const TransportOperator& transport, const GreyProblem& problem,
                          const SolveOptions& options, std::vector<double>& radiosity, const GreySolveObserver& observe,
                          std::stop_token stop);

/// Solves the means of the channels as one, and gives the solution to all three: the bits of solve() where the three
/// are equal. Shapes and errors as there.
Result<SolveReport> solve_grey(Solver solver, const TransportOperator& transport, const RadiosityProblem& problem,
                               const SolveOptions& options, std::vector<Vec3>& radiosity,
                               const GreySolveObserver& observe, std::stop_token stop);

/// Radiosity to show while shooting is under way: unshot light is spread as if all patches saw each other evenly.
///
///   B_i + rho_i R sum_j A_j dB_j / sum_j A_j,   R = 1 / (1 - mean rho by area)
///
/// For display only: nothing is solved with it, and it has no bound. Shapes: all [n].
/// Source: Cohen, Chen, Wallace & Greenberg 1988, eqs. 12-15.
std::vector<Vec3> ambient_display(std::span<const double> areas, std::span<const Vec3> reflectance,
                                  std::span<const Vec3> radiosity, std::span<const Vec3> unshot);

}  // namespace radbake::radiosity
