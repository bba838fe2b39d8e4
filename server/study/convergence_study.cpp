#include "server/study/convergence_study.h"

#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <optional>
#include <stop_token>

#include "common/base/check.h"
#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/bake/radiosity_system.h"

namespace radbake::study {
namespace {

using radiosity::RadiosityProblem;
using radiosity::SolveOptions;
using radiosity::Solver;
using radiosity::SolveReport;
using radiosity::SolveView;
using radiosity::TransportOperator;

constexpr int kMinTimedRuns = 3, kMaxTimedRuns = 50;
constexpr double kTimedSeconds = 0.3;
/// The reference is so much better than what the solvers are asked for, as far as rounding allows.
constexpr double kReferenceShare = 1e-3;
constexpr int kMaxSweepsOfReference = 2000, kMaxSweeps = 100'000;

SolveReport solved(Solver solver, const TransportOperator& transport, const RadiosityProblem& problem, double tolerance,
                   int max_sweeps, std::vector<Vec3>& radiosity, const radiosity::SolveObserver& observe) {
  SolveOptions options;
  options.relative_tolerance = tolerance;
  options.max_sweeps = max_sweeps;
  radiosity.assign(transport.size(), {});
  auto report = radiosity::solve(solver, transport, problem, options, radiosity, observe, {});
  RADBAKE_CHECK(report.ok());  // lu is asked for where it is allowed only
  return std::move(report).value();
}

/// Relative error in the mean square, by area.
double error_of(std::span<const Vec3> radiosity, std::span<const Vec3> exact, std::span<const double> areas) {
  double squares = 0, all = 0;
  for (std::size_t i = 0; i < areas.size(); ++i) {
    const Vec3 off = radiosity[i] - exact[i];
    squares += areas[i] * dot(off, off);
    all += areas[i] * dot(exact[i], exact[i]);
  }
  return all > 0 ? std::sqrt(squares / all) : std::sqrt(squares);
}

/// Patches gathered or shot in a solver's steps.
std::int64_t patches_of(Solver solver, std::int64_t steps, std::size_t n) {
  if (solver == Solver::kLu) return 0;
  if (solver == Solver::kSouthwell || solver == Solver::kShooting) return steps;
  return steps * static_cast<std::int64_t>(n);
}

class Measurement {
 public:
  Measurement(const TransportOperator& transport, const RadiosityProblem& problem, double tolerance)
      : transport_(transport), problem_(problem), tolerance_(tolerance) {
    const Solver solver = transport.size() <= radiosity::kMaxLuPatches ? Solver::kLu : Solver::kKrylov;
    reference_error_ =
        solved(solver, transport, problem, tolerance * kReferenceShare, kMaxSweepsOfReference, exact_, {})
            .relative_error_bound;
  }

  double reference_error() const { return reference_error_; }

  /// Adds the curve of a solver; of shooting also that of what is shown meanwhile.
  void measure(Solver solver, std::vector<ConvergenceCurve>& curves) const {
    ConvergenceCurve curve{radiosity::solver_name(solver), "", {}}, shown{"shooting+ambient", "", {}};
    std::vector<Vec3> radiosity;
    const SolveReport report =
        solved(solver, transport_, problem_, tolerance_, kMaxSweeps, radiosity, [&](const SolveView& view) {
          ConvergencePoint point{view.step.steps, patches_of(solver, view.step.steps, transport_.size()),
                                 view.step.work, 0, error_of(view.radiosity, exact_, transport_.areas())};
          // A look after steps that were seen already says it again.
          if (!curve.points.empty() && curve.points.back().steps == point.steps) {
            curve.points.pop_back();
            if (solver == Solver::kShooting) shown.points.pop_back();
          }
          curve.points.push_back(point);
          if (solver != Solver::kShooting) return;
          if (!view.unshot.empty()) {
            const std::vector<Vec3> display =
                radiosity::ambient_display(transport_.areas(), problem_.reflectance, view.radiosity, view.unshot);
            point.error = error_of(display, exact_, transport_.areas());
          }
          shown.points.push_back(point);
        });
    curve.status = shown.status = radiosity::solve_status_name(report.status);
    fill_seconds(solver, curve);
    if (solver == Solver::kShooting) {
      for (std::size_t k = 0; k < curve.points.size(); ++k) shown.points[k].seconds = curve.points[k].seconds;
    }
    curves.push_back(std::move(curve));
    if (!shown.points.empty()) curves.push_back(std::move(shown));
  }

 private:
  /// From the fastest of some runs, many where they are short: what else the machine does only adds.
  void fill_seconds(Solver solver, ConvergenceCurve& curve) const {
    double fastest = std::numeric_limits<double>::infinity(), total = 0;
    for (int run = 0; run < kMinTimedRuns || (run < kMaxTimedRuns && total < kTimedSeconds); ++run) {
      std::vector<Vec3> radiosity;
      const SolveReport report = solved(solver, transport_, problem_, tolerance_, kMaxSweeps, radiosity, {});
      RADBAKE_CHECK_EQ(report.history.size(), curve.points.size());
      total += report.seconds;
      if (report.seconds >= fastest) continue;
      fastest = report.seconds;
      for (std::size_t k = 0; k < curve.points.size(); ++k) curve.points[k].seconds = report.history[k].seconds;
    }
  }

  const TransportOperator& transport_;
  const RadiosityProblem& problem_;
  double tolerance_;
  std::vector<Vec3> exact_;
  double reference_error_ = 0;
};

/// The first point from which on the error stays within a limit; null: none.
const ConvergencePoint* settled(const ConvergenceCurve& curve, double limit) {
  const ConvergencePoint* first = nullptr;
  for (const ConvergencePoint& point : curve.points) {
    if (!(point.error <= limit)) {
      first = nullptr;
    } else if (!first) {
      first = &point;
    }
  }
  return first;
}

}  // namespace

ConvergenceStudy study_convergence(const TransportOperator& transport, const RadiosityProblem& problem,
                                   double tolerance) {
  const Measurement measurement(transport, problem, tolerance);
  ConvergenceStudy study{transport.size(), measurement.reference_error(), {}, {}};
  for (const Solver solver : radiosity::kAllSolvers) {
    if (solver == Solver::kLu && transport.size() > radiosity::kMaxLuPatches) {
      study.left_out.push_back("lu: " + std::to_string(transport.size()) + " patches are above " +
                               std::to_string(radiosity::kMaxLuPatches));
      continue;
    }
    measurement.measure(solver, study.curves);
  }
  return study;
}

Result<ConvergenceStudy> study_convergence_of(const Scene& scene, const radiosity::BakeOptions& options,
                                              double tolerance) {
  std::optional<tbb::global_control> limit;
  if (options.threads > 0) {
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  }
  RADBAKE_ASSIGN_OR_RETURN(const auto prepared, radiosity::prepare_scene(scene, options, {}));
  if (prepared->plan.transport == radiosity::Transport::kStreamed) {
    return invalid_argument(
        "solvers are compared on one matrix, and a streamed operator has two, one of rows and one of columns: choose "
        "--transport sparse or dense, or fewer --max-patches");
  }
  RADBAKE_ASSIGN_OR_RETURN(
      const auto system,
      radiosity::make_radiosity_system(
          *prepared, {options.seed, prepared->plan.rays_per_row, radiosity::kLightSamplesPerPatch}, 0, {}, {}));
  return study_convergence(*system->transport, system->problem, tolerance);
}

std::string convergence_csv(const ConvergenceStudy& study) {
  std::string text = "solver,steps,patches,work,seconds,relative_error\n";
  char line[200];
  for (const ConvergenceCurve& curve : study.curves) {
    for (const ConvergencePoint& p : curve.points) {
      std::snprintf(line, sizeof line, "%s,%lld,%lld,%lld,%.6g,%.6g\n", curve.name.c_str(),
                    static_cast<long long>(p.steps), static_cast<long long>(p.patches), static_cast<long long>(p.work),
                    p.seconds, p.error);
      text += line;
    }
  }
  return text;
}

std::string convergence_table(const ConvergenceStudy& study) {
  constexpr double kLimits[] = {1e-1, 1e-2, 1e-3, 1e-6};
  const double n = static_cast<double>(study.num_patches);
  char line[200];
  std::snprintf(line, sizeof line, "%zu patches; the reference is known to %.1e of its mean\n", study.num_patches,
                study.reference_error);
  std::string text = line;
  std::snprintf(line, sizeof line, "%-18s %-16s", "patches / n, ms", "status");
  text += line;
  for (const double limit : kLimits) {
    std::snprintf(line, sizeof line, " %18.0e", limit);
    text += line;
  }
  text += "\n";
  for (const ConvergenceCurve& curve : study.curves) {
    std::snprintf(line, sizeof line, "%-18s %-16s", curve.name.c_str(), curve.status.c_str());
    text += line;
    for (const double limit : kLimits) {
      const ConvergencePoint* point = settled(curve, limit);
      if (point) {
        std::snprintf(line, sizeof line, " %8.3f %6.1f ms", static_cast<double>(point->patches) / n,
                      point->seconds * 1e3);
      } else {
        std::snprintf(line, sizeof line, " %18s", "-");
      }
      text += line;
    }
    text += "\n";
  }
  for (const std::string& reason : study.left_out) text += "left out: " + reason + "\n";
  return text;
}

Plot convergence_plot(const ConvergenceStudy& study) {
  const double n = static_cast<double>(std::max<std::size_t>(study.num_patches, 1));
  const char* const error = "relative error (root mean square)";
  Panel steps{"error over steps", "patches gathered or shot, over their number", error, {}};
  Panel work{"error over what is read", "rows and columns read, those of residuals included", error, {}};
  Panel seconds{"error over time", "seconds", error, {}};
  for (const ConvergenceCurve& curve : study.curves) {
    // Points are drawn where a curve has few.
    constexpr std::size_t kFewPoints = 60;
    Curve drawn;
    drawn.title = curve.name;
    drawn.has_points = curve.points.size() <= kFewPoints;
    drawn.is_dashed = curve.name == "shooting+ambient";
    Curve of_steps = drawn, of_work = drawn, of_seconds = drawn;
    double before = 0;
    for (const ConvergencePoint& p : curve.points) {
      const bool is_all_at_once = p.patches == 0 && p.steps > 0;
      if (is_all_at_once) {
        // Nothing is known until all is.
        of_work.points.push_back({static_cast<double>(p.work), before});
        of_seconds.points.push_back({p.seconds, before});
      }
      of_steps.points.push_back({static_cast<double>(p.patches) / n, p.error});
      of_work.points.push_back({static_cast<double>(p.work), p.error});
      of_seconds.points.push_back({p.seconds, p.error});
      before = p.error;
    }
    const bool has_steps = !curve.points.empty() && curve.points.back().patches > 0;
    if (!has_steps) of_steps.points.clear();
    steps.curves.push_back(std::move(of_steps));
    work.curves.push_back(std::move(of_work));
    seconds.curves.push_back(std::move(of_seconds));
  }
  steps.is_x_logarithmic = false;
  steps.largest_x = 6;
  steps.smallest_y = 1e-4;
  work.smallest_y = seconds.smallest_y = 1e-9;
  return {{std::move(steps), std::move(work), std::move(seconds)}};
}

}  // namespace radbake::study
