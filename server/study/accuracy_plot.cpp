#include <algorithm>
#include <cstdio>
#include <map>

#include "server/study/accuracy_front.h"
#include "server/study/accuracy_report.h"

namespace radbake::study {
namespace {

const char* curve_title(AccuracyAxis axis) {
  switch (axis) {
    case AccuracyAxis::kRays: return "rays, every texel";
    case AccuracyAxis::kInterpolatedRays: return "rays, every 4th texel";
    case AccuracyAxis::kSpacing: return "spacing 1 to 8";
    case AccuracyAxis::kLightSamples: return "light samples";
    case AccuracyAxis::kPatches: return "patches";
    case AccuracyAxis::kFormFactors: return "form factors";
    case AccuracyAxis::kSolver: return "solvers";
    case AccuracyAxis::kBalanced: return "rays and light samples";
  }
  return "unknown";
}

Curve curve_of(const AccuracyStudy& study, AccuracyAxis axis) {
  Curve curve;
  curve.title = curve_title(axis);
  // Methods have no order that a line could follow.
  curve.has_line = axis != AccuracyAxis::kFormFactors && axis != AccuracyAxis::kSolver;
  for (const AccuracyRun& run : study.runs) {
    if (run.setting && run.setting->axis == axis) {
      curve.points.push_back({run.points.back().cpu_seconds, 100 * run.points.back().error});
    }
  }
  return curve;
}

Panel error_panel(const AccuracyStudy& study) {
  Panel panel{"error over CPU time", "CPU seconds", "relative RMSE against the reference, %", {}};
  panel.has_close_tics = true;
  for (const AccuracyAxis axis : kAllAccuracyAxes) panel.curves.push_back(curve_of(study, axis));
  Curve front;
  front.title = "Pareto front, fixed";
  front.is_reference = true;
  for (const AccuracyRun* run : front_of(study).runs) {
    front.points.push_back({run->points.back().cpu_seconds, 100 * run->points.back().error});
  }
  // The progressive bake with the most passes shows the course of all.
  Curve course, ends;
  course.title = "progressive, by pass";
  ends.title = "progressive, at its end";
  ends.has_line = false;
  const AccuracyRun* longest = nullptr;
  for (const AccuracyRun& run : study.runs) {
    if (run.setting) continue;
    ends.points.push_back({run.points.back().cpu_seconds, 100 * run.points.back().error});
    if (!longest || run.points.size() > longest->points.size()) longest = &run;
  }
  if (longest) {
    for (const AccuracyPoint& point : longest->points) course.points.push_back({point.cpu_seconds, 100 * point.error});
  }
  panel.curves.push_back(std::move(course));
  panel.curves.push_back(std::move(ends));
  panel.curves.push_back(std::move(front));
  return panel;
}

Panel calibration_panel(const AccuracyStudy& study) {
  Panel panel{"error that bakes state", "relative RMSE as stated, %", "relative RMSE against the reference, %", {}};
  panel.has_close_tics = true;
  Curve fixed, progressive;
  fixed.title = "fixed settings";
  progressive.title = "progressive, every pass";
  fixed.has_line = progressive.has_line = false;
  double low = 100, high = 0;
  for (const AccuracyRun& run : study.runs) {
    for (const AccuracyPoint& point : run.points) {
      if (!(point.stated > 0)) continue;
      (run.setting ? fixed : progressive).points.push_back({100 * point.stated, 100 * point.error});
      low = std::min(low, 100 * point.stated);
      high = std::max(high, 100 * point.stated);
    }
  }
  panel.curves = {std::move(fixed), std::move(progressive)};
  if (high > 0) {
    Curve equal;
    equal.title = "equal";
    equal.is_reference = true;
    equal.points = {{low, low}, {high, high}};
    panel.curves.push_back(std::move(equal));
  }
  return panel;
}

}  // namespace

Plot accuracy_plot(const AccuracyStudy& study) { return {{error_panel(study), calibration_panel(study)}}; }

}  // namespace radbake::study
