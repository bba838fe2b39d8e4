#include "server/study/form_factor_study.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "server/radiosity/form_factor/analytic.h"
#include "server/study/cases.h"

namespace radbake::study {
namespace {

using Json = nlohmann::ordered_json;

/// Below this an error is rounding, whatever was stated.
constexpr double kRounding = 1e-12;
/// A stated error may be so many times the tolerance that was asked for.
constexpr double kLoosest = 10;

struct Case {
  std::vector<radiosity::PolygonCorners> polygons;
  std::size_t from = 0, to = 0;
  std::vector<std::size_t> occluders;
};

/// Errors: kInvalidArgument naming the member.
Result<Case> read_case(const Json& source) {
  Case out;
  try {
    for (const Json& polygon : source.at("polygons")) {
      radiosity::PolygonCorners& corners = out.polygons.emplace_back();
      for (const Json& corner : polygon) {
        corners.push_back({corner.at(0).get<double>(), corner.at(1).get<double>(), corner.at(2).get<double>()});
      }
    }
    const auto polygon = [&](const Json& index, const char* member) {
      const auto i = index.get<std::int64_t>();
      if (i < 0 || i >= static_cast<std::int64_t>(out.polygons.size())) {
        throw std::out_of_range(std::string(member) + " is " + std::to_string(i) + ", but the case has " +
                                std::to_string(out.polygons.size()) + " polygons");
      }
      return static_cast<std::size_t>(i);
    };
    out.from = polygon(source.at("from"), "from");
    out.to = polygon(source.at("to"), "to");
    if (source.contains("occluders")) {
      for (const Json& index : source["occluders"]) out.occluders.push_back(polygon(index, "occluders"));
    }
  } catch (const std::exception& exception) {
    return invalid_argument(exception.what());
  }
  return out;
}

Json study_case(const Json& source, double tolerance) {
  const Json id = source.contains("id") ? source["id"] : Json("");
  Json out = {{"id", id},
              {"form_factor", nullptr},
              {"stated_error", nullptr},
              {"true_error", nullptr},
              {"microseconds", nullptr},
              {"method", nullptr},
              {"pass", nullptr}};
  const Result<Case> read = read_case(source);
  if (!read.ok()) {
    out["error"] = read.error().message;
    return out;
  }
  std::vector<radiosity::PolygonCorners> occluders;
  for (const std::size_t i : read->occluders) occluders.push_back(read->polygons[i]);
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  const auto found =
      radiosity::polygon_form_factor(read->polygons[read->from], read->polygons[read->to], occluders, tolerance);
  const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
  out["microseconds"] = seconds * 1e6;
  if (!found.ok()) {
    out["error"] = found.error().message;
    if (source.contains("exact")) out["pass"] = false;
    return out;
  }
  out["form_factor"] = found->form_factor;
  out["stated_error"] = found->stated_error;
  out["method"] = radiosity::analytic_method_name(found->method);
  if (source.contains("exact") && source["exact"].is_number()) {
    const double error = std::fabs(found->form_factor - source["exact"].get<double>());
    out["true_error"] = error;
    out["pass"] = error <= std::max(found->stated_error, kRounding) && error <= tolerance &&
                  found->stated_error <= kLoosest * tolerance;
  }
  return out;
}

std::string number(const Json& value, const char* format) {
  if (!value.is_number()) return "-";
  char text[40];
  std::snprintf(text, sizeof text, format, value.get<double>());
  return text;
}

}  // namespace

Json study_form_factors(const Json& cases, double tolerance) {
  Json result = {{"cases", Json::array()}};
  for (const Json& source : cases) result["cases"].push_back(study_case(source, tolerance));
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
