#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "server/study/accuracy_front.h"
#include "server/study/accuracy_report.h"
#include "server/study/line_fit.h"

namespace radbake::study {
namespace {

constexpr double kTargets[] = {0.2, 0.1, 0.05, 0.02, 0.01, 0.005};
/// Errors that differ by less are called equal.
constexpr double kSameError = 1.05;
/// Below, start and layout take most of the time, and not what is swept.
constexpr double kFirstSecond = 1;

[[gnu::format(printf, 1, 2)]] std::string print(const char* format, ...) {
  char text[600];
  va_list values;
  va_start(values, format);
  std::vsnprintf(text, sizeof text, format, values);
  va_end(values);
  return text;
}

std::string percent(double share) { return print(share < 0.0995 ? "%.2g %%" : "%.0f %%", 100 * share); }
std::string seconds(double s) { return print(s < 9.95 ? "%.2g s" : "%.0f s", s); }

std::vector<const AccuracyRun*> runs_of(const AccuracyStudy& study, AccuracyAxis axis) {
  std::vector<const AccuracyRun*> runs;
  for (const AccuracyRun& run : study.runs) {
    if (run.setting && run.setting->axis == axis) runs.push_back(&run);
  }
  return runs;
}

const AccuracyPoint& last(const AccuracyRun& run) { return run.points.back(); }

/// "1024 (1.2 %, 3.4 s)".
std::string named(const AccuracyRun& run) {
  return run.setting->value + " (" + percent(last(run).error) + ", " + seconds(last(run).cpu_seconds) + ")";
}

/// The first value from which on more of it does not make the error smaller.
const AccuracyRun& first_enough(const std::vector<const AccuracyRun*>& runs) {
  const double least =
      (*std::min_element(runs.begin(), runs.end(), [](auto* a, auto* b) { return last(*a).error < last(*b).error; }))
          ->points.back()
          .error;
  return **std::find_if(runs.begin(), runs.end(), [&](auto* run) { return last(*run).error <= kSameError * least; });
}

/// How the error falls along an axis of numbers, in one sentence or two.
std::string ladder_words(const AccuracyStudy& study, AccuracyAxis axis, const std::string& what,
                         const std::string& rest) {
  const auto runs = runs_of(study, axis);
  if (runs.size() < 3) return "";
  std::string text = "* **" + what + "**:";
  for (const AccuracyRun* run : runs) text += (run == runs.front() ? " " : ", ") + named(*run);
  const AccuracyRun& enough = first_enough(runs);
  text += ".";
  if (&enough == runs.front()) {
    text += " More than the least changes nothing here: " + rest + ".";
  } else if (&enough != runs.back()) {
    text += " More than " + enough.setting->value + " brings nothing: " + rest + ".";
  } else {
    std::vector<std::array<double, 2>> points;
    for (const AccuracyRun* run : runs) points.push_back({std::stod(run->setting->value), last(*run).error});
    if (std::all_of(points.begin(), points.end(), [](const auto& p) { return p[0] > 0 && p[1] > 0; })) {
      text += print(" The error falls like N^%.2f.", log_log_slope(points).value);
    }
  }
  return text + "\n";
}

/// Which of some methods to choose.
std::string method_words(const AccuracyStudy& study, AccuracyAxis axis, const std::string& what) {
  auto runs = runs_of(study, axis);
  if (runs.size() < 2) return "";
  std::string text =
      "* **" + what + "**, at most " + std::to_string(runs.front()->setting->options.max_patches) + " patches:";
  for (const AccuracyRun* run : runs) text += (run == runs.front() ? " " : ", ") + named(*run);
  const auto [best, worst] =
      std::minmax_element(runs.begin(), runs.end(), [](auto* a, auto* b) { return last(*a).error < last(*b).error; });
  const auto* cheapest = *std::min_element(
      runs.begin(), runs.end(), [](auto* a, auto* b) { return last(*a).cpu_seconds < last(*b).cpu_seconds; });
  text += ".";
  if (last(**worst).error <= kSameError * last(**best).error) {
    text += " All end at the same error; " + cheapest->setting->value + " is the cheapest.";
  } else {
    text += " Most exact: " + (*best)->setting->value + "; cheapest: " + cheapest->setting->value +
            print("; the largest error is %.2f x the smallest.", last(**worst).error / last(**best).error);
  }
  return text + "\n";
}

std::string target_table(const AccuracyStudy& study, const AccuracyFront& front) {
  std::string text = "| error | cheapest fixed setting that is within | its error | CPU time |\n|---|---|---|---|\n";
  for (const double target : kTargets) {
    const AccuracyRun* run = front.cheapest_within(target);
    if (!run) {
      text += "| " + percent(target) + " | none of those swept | | |\n";
      continue;
    }
    text += "| " + percent(target) + " | " + setting_words(run->setting->options) + " | " + percent(last(*run).error) +
            " | " + seconds(last(*run).cpu_seconds) + " |\n";
  }
  bool has_progressive = false;
  for (const AccuracyRun& run : study.runs) has_progressive = has_progressive || !run.setting;
  if (!has_progressive) return text;
  text +=
      "\n| asked | passes | stated | true error | CPU time | time | a fixed setting has, for that CPU time |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const AccuracyRun& run : study.runs) {
    if (run.setting) continue;
    const auto fixed = front.error_at(last(run).cpu_seconds);
    const std::string asked =
        run.budget > 0 ? print("`--time-budget %gs`", run.budget) : print("`--max-error %g%%`", 100 * run.target);
    text += "| " + asked + " | " + std::to_string(run.points.size()) + " | " + percent(last(run).stated) + " | " +
            percent(last(run).error) + " | " + seconds(last(run).cpu_seconds) + " | " + seconds(last(run).seconds) +
            " | " + (fixed ? percent(*fixed) : "nothing yet") + " |\n";
  }
  return text;
}

std::string progressive_words(const AccuracyStudy& study, const AccuracyFront& front) {
  double worst = 0, worst_at = 0, calibration_low = 1e9, calibration_high = 0;
  std::size_t num_points = 0;
  for (const AccuracyRun& run : study.runs) {
    if (run.setting) continue;
    for (const AccuracyPoint& point : run.points) {
      if (point.stated > 0 && point.error > 0) {
        calibration_low = std::min(calibration_low, point.stated / point.error);
        calibration_high = std::max(calibration_high, point.stated / point.error);
      }
      const auto fixed = front.error_at(point.cpu_seconds);
      if (!fixed || !(*fixed > 0) || point.cpu_seconds < kFirstSecond) continue;
      ++num_points;
      if (point.error / *fixed > worst) {
        worst = point.error / *fixed;
        worst_at = point.cpu_seconds;
      }
    }
  }
  std::string text;
  if (num_points > 0) {
    text += print(
        "Past the first CPU second, passes of progressive bakes have at most %.2f x the error of the best "
        "fixed setting for the same CPU time (at %s; %zu points). ",
        worst, seconds(worst_at).c_str(), num_points);
  }
  if (calibration_high > 0) {
    text += print("What they state is %.2f to %.2f x the true error. ", calibration_low, calibration_high);
  }
  return text.empty() ? text : text + "\n";
}

std::string reference_words(const AccuracyStudy& study) {
  const AccuracyReference& reference = study.reference;
  std::string text = "The reference is " + reference.origin + ". ";
  if (reference.error > 0) {
    text += "Its own error by sampling is " + percent(reference.error) +
            " and is taken out of the errors below (in quadrature); what is smaller than it is not told apart. ";
  }
  if (reference.cpu_seconds > 0) text += "It took " + seconds(reference.cpu_seconds) + " of CPU time. ";
  text += reference.is_ours ? "Texels at borders count." : "Texels at borders do not count.";
  return text;
}

}  // namespace

std::string accuracy_page(const AccuracyStudy& study, const std::string& picture) {
  const AccuracyFront front = front_of(study);
  std::string text = "# What accuracy costs: " + study.scene + "\n\n";
  text += print(
      "%llu texels, %llu of them compared; %d threads; %s. CPU time is of the whole bake in one process, "
      "without reading the scene and writing files.\n",
      static_cast<unsigned long long>(study.num_texels), static_cast<unsigned long long>(study.num_compared),
      study.threads, study.instruction_set.c_str());
  text += reference_words(study) + "\n\n![error over CPU time](" + picture +
          ")\n\n## What to use when\n\n"
          "`--max-error` chooses all of this by itself and says what it reached. Fixed settings are for who knows the "
          "scene: `--rays` and `--max-patches` on the command line; spacing and light samples are the library's.\n\n" +
          target_table(study, front) + "\n" + progressive_words(study, front) + "\n## What each setting buys\n\n" +
          "Error and CPU time, one setting varied and the others in the middle (256 rays, every 4th texel, 64 light "
          "samples).\n\n";
  text += ladder_words(study, AccuracyAxis::kRays, "Rays, every texel gathers", "light samples or patches lead");
  text += ladder_words(study, AccuracyAxis::kInterpolatedRays, "Rays, every 4th texel gathers",
                       "interpolation, light samples or patches lead");
  text += ladder_words(study, AccuracyAxis::kSpacing, "Texels from one that gathers to the next",
                       "what is between is as exact interpolated as gathered");
  text += ladder_words(study, AccuracyAxis::kLightSamples, "Light samples", "indirect light leads");
  text += ladder_words(study, AccuracyAxis::kPatches, "Patches", "sampling leads");
  text += ladder_words(study, AccuracyAxis::kBalanced, "Rays, with a quarter as many light samples",
                       "interpolation or patches lead");
  text += method_words(study, AccuracyAxis::kFormFactors, "Form factors");
  text += method_words(study, AccuracyAxis::kSolver, "Solvers");
  if (!study.left_out.empty()) {
    text += "\nLeft out:\n";
    for (const std::string& reason : study.left_out) text += "* " + reason + "\n";
  }
  return text;
}

std::string accuracy_csv(const AccuracyStudy& study) {
  std::string text =
      "axis,value,rays,spacing,light_samples,max_patches,form_factors,solver,target,budget,pass,cpu_seconds,seconds,"
      "difference,error,stated_error\n";
  for (const AccuracyRun& run : study.runs) {
    for (std::size_t k = 0; k < run.points.size(); ++k) {
      const AccuracyPoint& p = run.points[k];
      if (run.setting) {
        const radiosity::BakeOptions& o = run.setting->options;
        text += print("%s,%s,%d,%d,%d,%d,%s,%s,,,", accuracy_axis_name(run.setting->axis), run.setting->value.c_str(),
                      o.rays, o.spacing, o.light_samples, o.max_patches, radiosity::form_factors_name(o.form_factors),
                      o.solver ? radiosity::solver_name(*o.solver) : "auto");
      } else {
        text += "progressive,,,,,,,," + (run.target > 0 ? print("%g", run.target) : "") + "," +
                (run.budget > 0 ? print("%g", run.budget) : "") + ",";
      }
      text += print("%zu,%.6g,%.6g,%.6g,%.6g,%.6g\n", k, p.cpu_seconds, p.seconds, p.difference, p.error, p.stated);
    }
  }
  return text;
}

}  // namespace radbake::study
