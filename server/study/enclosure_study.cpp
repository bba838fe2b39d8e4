#include "server/study/enclosure_study.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "server/radiosity/solve/solve.h"
#include "server/radiosity/transport/dense_operator.h"
#include "server/study/cases.h"

namespace radbake::study {
namespace {

using Json = nlohmann::ordered_json;
using radiosity::DenseOperator;
using radiosity::RadiosityProblem;

/// A scalar in all three channels.
Vec3 grey(double value) { return {value, value, value}; }

struct Enclosure {
  DenseOperator transport;
  RadiosityProblem problem;
  std::vector<double> radiosity;  ///< known answer; empty: none
};

/// Errors: kInvalidArgument naming the member.
Result<Enclosure> read_enclosure(const Json& source) {
  try {
    const auto form_factors = source.at("F").get<std::vector<std::vector<double>>>();
    const auto areas = source.at("areas").get<std::vector<double>>();
    const auto reflectance = source.at("rho").get<std::vector<double>>();
    const auto emission = source.at("E").get<std::vector<double>>();
    std::vector<double> known;
    if (source.contains("B")) known = source["B"].get<std::vector<double>>();
    if (reflectance.size() != areas.size() || emission.size() != areas.size() ||
        (!known.empty() && known.size() != areas.size())) {
      return invalid_argument("areas, rho, E and B differ in length");
    }
    RadiosityProblem problem;
    for (std::size_t i = 0; i < areas.size(); ++i) {
      if (!(reflectance[i] >= 0 && reflectance[i] < 1)) {
        return invalid_argument("rho[" + std::to_string(i) + "] is " + std::to_string(reflectance[i]) +
                                ", outside 0 to below 1");
      }
      if (!(emission[i] >= 0) || !std::isfinite(emission[i])) {
        return invalid_argument("E[" + std::to_string(i) + "] is " + std::to_string(emission[i]) +
                                ", but must be finite and not negative");
      }
      problem.source.push_back(grey(emission[i]));
      problem.reflectance.push_back(grey(reflectance[i]));
    }
    RADBAKE_ASSIGN_OR_RETURN(DenseOperator transport, DenseOperator::from_matrix(form_factors, areas));
    return Enclosure{std::move(transport), std::move(problem), known};
  } catch (const std::exception& exception) {
    return invalid_argument(exception.what());
  }
}

Json study_solver(const Json& id, const Enclosure& enclosure, radiosity::Solver solver, double tolerance) {
  radiosity::SolveOptions options;
  options.relative_tolerance = tolerance;
  options.max_sweeps = 10'000'000;  // jacobi at a reflectance of 0.9999 takes some 100,000
  std::vector<Vec3> radiosity(enclosure.transport.size());
  const auto solved =
      radiosity::solve(solver, enclosure.transport, enclosure.problem, options, radiosity, nullptr, std::stop_token());
  Json out = {{"id", id}, {"solver", radiosity::solver_name(solver)}};
  if (!solved.ok()) {
    out["error"] = solved.error().message;
    return out;
  }
  out["status"] = radiosity::solve_status_name(solved->status);
  out["steps"] = solved->steps;
  out["work"] = solved->work;
  out["microseconds"] = solved->seconds * 1e6;
  out["residual"] = solved->residual;
  out["error_bound"] = solved->error_bound;
  out["true_error"] = out["relative_error"] = out["pass"] = nullptr;
  if (enclosure.radiosity.empty()) return out;
  double error = 0, largest = 0;
  for (std::size_t i = 0; i < radiosity.size(); ++i) {
    error = std::max(error, std::fabs(radiosity[i].x - enclosure.radiosity[i]));
    largest = std::max(largest, std::fabs(enclosure.radiosity[i]));
  }
  out["true_error"] = error;
  out["relative_error"] = largest > 0 ? error / largest : error;
  out["pass"] = solved->status == radiosity::SolveStatus::kConverged && error <= solved->error_bound;
  return out;
}

}  // namespace

Json study_enclosures(const Json& cases, double tolerance) {
  Json result = {{"cases", Json::array()}};
  for (const Json& source : cases) {
    const Json id = source.contains("id") ? source["id"] : Json("");
    const Result<Enclosure> enclosure = read_enclosure(source);
    if (!enclosure.ok()) {
      result["cases"].push_back({{"id", id}, {"error", enclosure.error().message}});
      continue;
    }
    for (const radiosity::Solver solver : radiosity::kAllSolvers) {
      result["cases"].push_back(study_solver(id, *enclosure, solver, tolerance));
    }
  }
  return result;
}

std::string enclosure_table(const Json& result) {
  char line[400];
  std::snprintf(line, sizeof line, "%-22s %-13s %-16s %9s %9s %10s %10s %10s\n", "case", "solver", "status", "steps",
                "us", "bound", "true", "");
  std::string text = line;
  Tally tally;
  for (const Json& c : result["cases"]) {
    if (c.contains("error")) {
      text += tally.refuse(c);
      continue;
    }
    char error[20] = "-";
    if (c["true_error"].is_number()) std::snprintf(error, sizeof error, "%.1e", c["true_error"].get<double>());
    std::snprintf(line, sizeof line, "%-22s %-13s %-16s %9lld %9.0f %10.1e %10s %10s\n", id_of(c).c_str(),
                  c["solver"].get<std::string>().c_str(), c["status"].get<std::string>().c_str(),
                  static_cast<long long>(c["steps"].get<std::int64_t>()), c["microseconds"].get<double>(),
                  c["error_bound"].get<double>(), error, tally.judge(c).c_str());
    text += line;
  }
  return text + tally.summary("solves");
}

}  // namespace radbake::study
