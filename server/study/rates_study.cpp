#include "server/study/rates_study.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/radiosity/form_factor/analytic_polygon.h"
#include "server/radiosity/threads/for_each_range.h"
#include "server/study/cases.h"
#include "server/study/line_fit.h"
#include "server/study/sampled_pair.h"

namespace radbake::study {
namespace {

using Json = nlohmann::ordered_json;
using radiosity::Hemicube;
using radiosity::PolygonCorners;

enum Purpose : std::uint64_t { kRaysOfRates = 3, kPlacesOfRates = 4, kPairsOfRates = 5 };

/// Nearer to 0 or 1 than this, most replicates see nothing of the other polygon, or nothing else.
constexpr double kSeldomSeen = 1e-3;
/// The side of a square that stands for a place, over the perimeter of its polygon.
constexpr double kPlaceSide = 0x1p-20;
constexpr double kAnalyticTolerance = 1e-8;
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

/// Whether parts of two polygons come nearer than a share of the smaller perimeter, looked at along their edges.
bool nearly_touch(const PolygonCase& pair) {
  constexpr double kNear = 0.01;
  constexpr int kPointsOfEdge = 32;
  const double size = std::min(radiosity::perimeter(pair.from), radiosity::perimeter(pair.to));
  double nearest = std::numeric_limits<double>::infinity();
  const auto look = [&](const PolygonCorners& edges, const PolygonCorners& other) {
    const radiosity::Piece piece{other, {other[0], normalized(radiosity::twice_area_vector(other))}};
    for (std::size_t k = 0; k < edges.size(); ++k) {
      const Vec3 a = edges[k], b = edges[(k + 1) % edges.size()];
      for (int i = 0; i < kPointsOfEdge; ++i) {
        nearest = std::min(nearest, radiosity::distance_to_polygon(a + (b - a) * (1.0 * i / kPointsOfEdge), piece));
      }
    }
  };
  look(pair.from, pair.to);
  look(pair.to, pair.from);
  return nearest < kNear * size;
}

/// Form factor from a place on `from`: that of a square there, so small that it sees what the place sees.
Result<double> form_factor_at(const PolygonPair& pair, Vec3 site) {
  const Frame frame(pair.normal());
  const double half = kPlaceSide * radiosity::perimeter(pair.local().from) / 2;
  const Vec3 s = frame.s * half, t = frame.t * half;
  RADBAKE_ASSIGN_OR_RETURN(const auto found, radiosity::polygon_form_factor(
                                                 PolygonCorners{site - s - t, site + s - t, site + s + t, site - s + t},
                                                 pair.local().to, pair.local().occluders, kAnalyticTolerance));
  return found.form_factor;
}

/// Root mean square over replicates of what they give less what is right.
double rms_error(int replicates, const std::function<double(std::uint64_t)>& error_of) {
  std::vector<double> errors(static_cast<std::size_t>(replicates));
  radiosity::for_each_range(errors.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) errors[k] = error_of(k);
  });
  double squares = 0;
  for (const double error : errors) squares += error * error;
  return std::sqrt(squares / replicates);
}

class RateMeter {
 public:
  RateMeter(const RateLimits& limits) : limits_(limits), points_(limits.max_rays) {
    for (int r = 4; r <= std::max(limits.max_resolution, limits.max_resolution_of_pair); r *= 2) {
      hemicubes_.emplace_back(r);
    }
  }

  /// Adds the curves of one case. Errors: what the analytic form factor refuses, or a form factor too near to 0 or 1.
  Result<void> measure(const std::string& id, const PolygonCase& source, RateStudy& study) const {
    RADBAKE_ASSIGN_OR_RETURN(const PolygonPair pair, PolygonPair::make(source));
    RADBAKE_ASSIGN_OR_RETURN(
        const auto exact, radiosity::polygon_form_factor(source.from, source.to, source.occluders, kAnalyticTolerance));
    if (exact.form_factor < kSeldomSeen || exact.form_factor > 1 - kSeldomSeen) {
      char value[40];
      std::snprintf(value, sizeof value, "%.3g", exact.form_factor);
      return invalid_argument(std::string("its form factor is ") + value);
    }
    const PairGroup group = !source.occluders.empty() ? PairGroup::kOccluded
                            : nearly_touch(source)    ? PairGroup::kTouching
                                                      : PairGroup::kApart;
    const auto add = [&](RateKind kind, std::vector<std::array<double, 2>> points) {
      study.curves.push_back({id, group, exact.form_factor, kind, std::move(points)});
    };
    RADBAKE_ASSIGN_OR_RETURN(auto of_places, hemicubes_at_places(pair));
    add(RateKind::kHemisphere, rays(pair, exact.form_factor));
    add(RateKind::kHemicubePlace, std::move(of_places));
    add(RateKind::kHemicubePair, hemicubes_over_polygon(pair, exact.form_factor));
    return {};
  }

 private:
  std::vector<std::array<double, 2>> rays(const PolygonPair& pair, double exact) const {
    std::vector<std::array<double, 2>> points;
    std::vector<std::int64_t> arrivals(static_cast<std::size_t>(limits_.num_replicates), 0);
    for (int done = 0, end = 16; end <= limits_.max_rays; done = end, end *= 4) {
      points.push_back({1.0 * end, rms_error(limits_.num_replicates, [&](std::uint64_t k) {
                          arrivals[k] += count_arrivals(pair, points_, done, end, seed_of(0, kRaysOfRates, k));
                          return static_cast<double>(arrivals[k]) / end - exact;
                        })});
    }
    return points;
  }

  Result<std::vector<std::array<double, 2>>> hemicubes_at_places(const PolygonPair& pair) const {
    const auto seeds = SobolPoints::seeds_of(seed_of(0, kPlacesOfRates, 0));
    std::vector<Vec3> sites;
    std::vector<double> exact, turns;
    for (int k = 0; k < limits_.num_replicates; ++k) {
      sites.push_back(pair.site(points_.coordinate(k, 0, seeds), points_.coordinate(k, 1, seeds)));
      turns.push_back(points_.coordinate(k, 2, seeds) * std::numbers::pi / 2);
      RADBAKE_ASSIGN_OR_RETURN(const double at_site, form_factor_at(pair, sites.back()));
      exact.push_back(at_site);
    }
    std::vector<std::array<double, 2>> points;
    for (const Hemicube& hemicube : hemicubes_) {
      if (hemicube.resolution() > limits_.max_resolution) break;
      points.push_back({1.0 * hemicube.resolution(), rms_error(limits_.num_replicates, [&](std::uint64_t k) {
                          return hemicube_form_factor(pair, hemicube, sites[k], turns[k]) - exact[k];
                        })});
    }
    return points;
  }

  std::vector<std::array<double, 2>> hemicubes_over_polygon(const PolygonPair& pair, double exact) const {
    std::vector<std::array<double, 2>> points;
    for (const Hemicube& hemicube : hemicubes_) {
      const int r = hemicube.resolution();
      if (r > limits_.max_resolution_of_pair) break;
      points.push_back({1.0 * r, rms_error(limits_.num_replicates, [&](std::uint64_t k) {
                          const std::uint64_t seed = seed_of(static_cast<std::uint64_t>(r), kPairsOfRates, k);
                          return hemicube_form_factor(pair, hemicube, points_, r, seed) - exact;
                        })});
    }
    return points;
  }

  RateLimits limits_;
  SobolPoints points_;
  std::vector<Hemicube> hemicubes_;
};

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

RateStudy study_rates(const Json& cases, const RateLimits& limits) {
  const RateMeter meter(limits);
  RateStudy study;
  for (const Json& source : cases) {
    const std::string id = source.contains("id") ? id_of(source) : "";
    const Result<PolygonCase> pair = read_polygon_case(source);
    const Result<void> measured = pair.ok() ? meter.measure(id, *pair, study) : Result<void>(pair.error());
    if (!measured.ok()) study.left_out.push_back(id + ": " + measured.error().message);
  }
  return study;
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
