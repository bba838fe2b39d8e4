#include "server/study/form_factor_study.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "server/radiosity/form_factor/adaptive.h"
#include "server/radiosity/form_factor/analytic.h"
#include "server/radiosity/form_factor/analytic_polygon.h"
#include "server/study/cases.h"
#include "server/study/sampled_pair.h"

namespace radbake::study {
namespace {

using Json = nlohmann::ordered_json;

/// Below this an error is rounding, whatever was stated.
constexpr double kRounding = 1e-12;
/// A stated error may be so many times the tolerance that was asked for.
constexpr double kLoosest = 10;

constexpr std::pair<const char*, PairEstimator> kEstimators[] = {{"analytic", PairEstimator::kAnalytic},
                                                                 {"hemicube", PairEstimator::kHemicube},
                                                                 {"hemisphere", PairEstimator::kHemisphere},
                                                                 {"adaptive", PairEstimator::kAdaptive}};

struct Found {
  double form_factor = 0;
  double stated_error = 0;
  const char* method = "";
};

/// Precondition: corners in a plane.
radiosity::PatchExtent extent_of(const radiosity::PolygonCorners& corners) {
  const Vec3 twice_area = radiosity::twice_area_vector(corners);
  radiosity::PatchExtent extent{{}, 0, length(twice_area) / 2};
  // The mean of a fan of triangles, those that the outline folds back with negative area.
  Vec3 offset;
  for (std::size_t k = 1; k + 1 < corners.size(); ++k) {
    const Vec3 a = corners[k] - corners[0], b = corners[k + 1] - corners[0];
    offset += (a + b) / 3 * (dot(cross(a, b), twice_area) / dot(twice_area, twice_area));
  }
  extent.middle = corners[0] + offset;
  extent.radius = radiosity::radius_about(extent.middle, corners);
  return extent;
}

/// Finds the form factor of one pair by one method.
class PairStudy {
 public:
  PairStudy(PairEstimator estimator, double tolerance)
      : estimator_(estimator),
        tolerance_(tolerance),
        points_(estimator == PairEstimator::kHemisphere || estimator == PairEstimator::kAdaptive
                    ? kMaxRaysOfReplicate
                    : kMaxSitesOfReplicate) {}

  Result<Found> find(const PolygonCase& pair) const {
    if (estimator_ == PairEstimator::kAnalytic) return by_formula(pair);
    RADBAKE_ASSIGN_OR_RETURN(const PolygonPair local, PolygonPair::make(pair));
    if (estimator_ == PairEstimator::kAdaptive &&
        radiosity::is_near_or_large(extent_of(local.local().from), extent_of(local.local().to))) {
      return by_formula(pair);
    }
    const bool is_hemicube = estimator_ == PairEstimator::kHemicube;
    const SampledFormFactor found =
        is_hemicube ? sampled_by_hemicubes(local, points_, tolerance_) : sampled_by_rays(local, points_, tolerance_);
    return Found{found.form_factor, found.stated_error, is_hemicube ? "hemicube" : "hemisphere"};
  }

  Json study(const Json& source) const {
    const Json id = source.contains("id") ? source["id"] : Json("");
    Json out = {{"id", id},
                {"form_factor", nullptr},
                {"stated_error", nullptr},
                {"true_error", nullptr},
                {"microseconds", nullptr},
                {"method", nullptr},
                {"pass", nullptr}};
    const Result<PolygonCase> pair = read_polygon_case(source);
    if (!pair.ok()) {
      out["error"] = pair.error().message;
      return out;
    }
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    const Result<Found> found = find(*pair);
    out["microseconds"] = std::chrono::duration<double>(Clock::now() - start).count() * 1e6;
    if (!found.ok()) {
      out["error"] = found.error().message;
      if (source.contains("exact")) out["pass"] = false;
      return out;
    }
    out["form_factor"] = found->form_factor;
    out["stated_error"] = found->stated_error;
    out["method"] = found->method;
    if (source.contains("exact") && source["exact"].is_number()) {
      const double error = std::fabs(found->form_factor - source["exact"].get<double>());
      out["true_error"] = error;
      out["pass"] = error <= std::max(found->stated_error, kRounding) && error <= tolerance_ &&
                    found->stated_error <= kLoosest * tolerance_;
    }
    return out;
  }

 private:
  Result<Found> by_formula(const PolygonCase& pair) const {
    RADBAKE_ASSIGN_OR_RETURN(const radiosity::PolygonFormFactor found,
                             radiosity::polygon_form_factor(pair.from, pair.to, pair.occluders, tolerance_));
    return Found{found.form_factor, found.stated_error, radiosity::analytic_method_name(found.method)};
  }

  PairEstimator estimator_;
  double tolerance_;
  SobolPoints points_;
};

std::string number(const Json& value, const char* format) {
  if (!value.is_number()) return "-";
  char text[40];
  std::snprintf(text, sizeof text, format, value.get<double>());
  return text;
}

}  // namespace

Result<PairEstimator> pair_estimator_by_name(std::string_view name) {
  std::string names;
  for (const auto& [known, estimator] : kEstimators) {
    if (name == known) return estimator;
    names += std::string(names.empty() ? "" : ", ") + known;
  }
  return invalid_argument("no estimator is called '" + std::string(name) + "': choose one of " + names);
}

Json study_form_factors(const Json& cases, PairEstimator estimator, double tolerance) {
  const PairStudy study(estimator, tolerance);
  Json result = {{"cases", Json::array()}};
  for (const Json& source : cases) result["cases"].push_back(study.study(source));
  return result;
}

std::string form_factor_table(const Json& result) {
  std::string text;
  char line[400];
  const auto add = [&](const std::string& id, const std::string& value, const std::string& stated,
                       const std::string& error, const std::string& time, const std::string& method,
                       const std::string& pass) {
    std::snprintf(line, sizeof line, "%-28s %20s %10s %10s %10s  %-10s %s\n", id.c_str(), value.c_str(), stated.c_str(),
                  error.c_str(), time.c_str(), method.c_str(), pass.c_str());
    text += line;
  };
  add("case", "form factor", "stated", "true", "us", "method", "");
  Tally tally;
  for (const Json& c : result["cases"]) {
    if (c.contains("error")) {
      text += tally.refuse(c);
      continue;
    }
    add(id_of(c), number(c["form_factor"], "%.15g"), number(c["stated_error"], "%.1e"), number(c["true_error"], "%.1e"),
        number(c["microseconds"], "%.1f"), c["method"].get<std::string>(), tally.judge(c));
  }
  return text + tally.summary("cases");
}

}  // namespace radbake::study
