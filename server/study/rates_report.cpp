#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <utility>

#include "server/study/line_fit.h"
#include "server/study/rates_study.h"

namespace radbake::study {
namespace {

/// The first points are not on the line yet: fewer pixels or rays than the polygon has features.
constexpr double kFirstRaysOfFit = 256, kFirstResolutionOfFit = 8;

/// What theory says of a kind, and the slopes to draw.
struct Theory {
  const char* text;
  const char* x_label;
  std::vector<std::pair<double, const char*>> slopes;
  double first_of_fit;
};

const Theory& theory_of(RateKind kind) {
  static const std::map<RateKind, Theory> kTheories = {
      {RateKind::kHemisphere,
       {"-1/2 for independent rays; -5/8 for nets in 4 dimensions (place, direction) cut by a smooth edge",
        "rays N",
        {{-0.5, "N^{-1/2}: independent rays"}, {-0.625, "N^{-5/8}: nets, smooth edge"}},
        kFirstRaysOfFit}},
      {RateKind::kHemicubePlace,
       {"-1 for edges along the pixels, -3/2 in the mean square over turns",
        "resolution r",
        {{-1, "r^{-1}: edges along the pixels"}, {-1.5, "r^{-3/2}: mean square over turns"}},
        kFirstResolutionOfFit}},
      {RateKind::kHemicubePair,
       {"-1 from r places where the place matters much (edges), down to -2 (pixels, smooth)",
        "resolution r, at r places",
        {{-1, "r^{-1}"}, {-2, "r^{-2}"}},
        kFirstResolutionOfFit}}};
  return kTheories.at(kind);
}

/// The part of a curve that a line is fitted to.
std::vector<std::array<double, 2>> fitted_part(const RateCurve& curve) {
  std::vector<std::array<double, 2>> points;
  for (const auto& point : curve.points) {
    if (point[0] >= theory_of(curve.kind).first_of_fit && point[1] > 0) points.push_back(point);
  }
  return points;
}

/// Slopes of the cases of a kind and group.
std::vector<double> slopes_of(const RateStudy& study, RateKind kind, PairGroup group) {
  std::vector<double> slopes;
  for (const RateCurve& curve : study.curves) {
    const auto points = fitted_part(curve);
    if (curve.kind == kind && curve.group == group && points.size() >= 3) slopes.push_back(log_log_slope(points).value);
  }
  return slopes;
}

/// Geometric mean of the errors of a kind and group.
Curve mean_curve(const RateStudy& study, RateKind kind, PairGroup group) {
  std::map<double, std::pair<double, int>> logs;
  for (const RateCurve& curve : study.curves) {
    if (curve.kind != kind || curve.group != group) continue;
    for (const auto& [size, error] : curve.points) {
      if (!(error > 0)) continue;
      logs[size].first += std::log(error);
      ++logs[size].second;
    }
  }
  Curve mean;
  for (const auto& [size, sum] : logs) mean.points.push_back({size, std::exp(sum.first / sum.second)});
  return mean;
}

}  // namespace

const char* rate_kind_name(RateKind kind) {
  switch (kind) {
    case RateKind::kHemisphere: return "hemisphere";
    case RateKind::kHemicubePlace: return "hemicube_at_a_place";
    case RateKind::kHemicubePair: return "hemicube";
  }
  return "unknown";
}

const char* pair_group_name(PairGroup group) {
  switch (group) {
    case PairGroup::kApart: return "apart";
    case PairGroup::kTouching: return "touching";
    case PairGroup::kOccluded: return "occluded";
  }
  return "unknown";
}

std::string rate_csv(const RateStudy& study) {
  std::string text = "case,group,form_factor,estimator,size,rms_error\n";
  char numbers[100];
  for (const RateCurve& curve : study.curves) {
    for (const auto& [size, error] : curve.points) {
      text += curve.id + "," + pair_group_name(curve.group);
      std::snprintf(numbers, sizeof numbers, ",%.12g,%s,%.0f,%.6g\n", curve.form_factor, rate_kind_name(curve.kind),
                    size, error);
      text += numbers;
    }
  }
  return text;
}

std::string rate_table(const RateStudy& study) {
  char line[300];
  std::snprintf(line, sizeof line, "%-20s %-10s %6s %18s  %18s\n", "estimator", "pairs", "cases", "slope (95 %)",
                "of single cases");
  std::string text = line;
  for (const RateKind kind : kAllRateKinds) {
    for (const PairGroup group : kAllPairGroups) {
      const std::vector<double> slopes = slopes_of(study, kind, group);
      if (slopes.size() < 2) continue;
      const Estimate mean = mean_of(slopes);
      const auto [least, most] = std::minmax_element(slopes.begin(), slopes.end());
      std::snprintf(line, sizeof line, "%-20s %-10s %6zu %10.3f +- %.3f  %8.3f to %.3f\n", rate_kind_name(kind),
                    pair_group_name(group), slopes.size(), mean.value, mean.half_width, *least, *most);
      text += line;
    }
    text += std::string("  theory: ") + theory_of(kind).text + "\n";
  }
  for (const std::string& reason : study.left_out) text += "left out: " + reason + "\n";
  return text;
}

Plot rate_plot(const RateStudy& study) {
  const std::map<RateKind, const char*> titles = {{RateKind::kHemisphere, "hemisphere: rays over the polygon"},
                                                  {RateKind::kHemicubePlace, "hemicube: against its own place"},
                                                  {RateKind::kHemicubePair, "hemicube: places over the polygon"}};
  Plot plot;
  for (const RateKind kind : kAllRateKinds) {
    const Theory& theory = theory_of(kind);
    Panel panel{titles.at(kind), theory.x_label, "error of the form factor (root mean square)", {}};
    double first_x = 0, last_x = 0, top = 0;
    for (const PairGroup group : kAllPairGroups) {
      Curve curve = mean_curve(study, kind, group);
      if (curve.points.empty()) continue;
      curve.title = pair_group_name(group);
      const std::vector<double> slopes = slopes_of(study, kind, group);
      if (slopes.size() >= 2) {
        const Estimate mean = mean_of(slopes);
        char text[60];
        std::snprintf(text, sizeof text, ", slope %.2f ± %.2f", mean.value, mean.half_width);
        curve.title += text;
      }
      first_x = curve.points.front()[0];
      last_x = curve.points.back()[0];
      top = std::max(top, curve.points.front()[1]);
      panel.curves.push_back(std::move(curve));
    }
    // Start the reference slopes above the curves, where they are told apart.
    for (const auto& [slope, title] : theory.slopes) {
      const double start = 2 * top;
      panel.curves.push_back(
          {title, {{first_x, start}, {last_x, start * std::pow(last_x / first_x, slope)}}, /*is_reference=*/true});
    }
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

}  // namespace radbake::study
