#include "server/study/rates_study.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>

#include "server/radiosity/form_factor/analytic_polygon.h"
#include "server/radiosity/threads/for_each_range.h"
#include "server/study/cases.h"
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
  explicit RateMeter(const RateLimits& limits) : limits_(limits), points_(limits.max_rays) {
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

}  // namespace

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

}  // namespace radbake::study
