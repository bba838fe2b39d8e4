#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace radbake::study {

/// Solves enclosures whose form factors are given, by every solver.
///
/// A case: {"id", "F": [[...]], "areas", "rho", "E", "B" (optional)}. Returns {"cases": [{id, solver, status, steps,
/// work, microseconds, residual, error_bound, true_error, relative_error, pass}]}, one entry a case and solver;
/// true_error, the largest difference from B, relative_error, that over the largest B, and pass are null without B. A
/// case that is refused has an `error`. pass: converged, and the true error is within the bound. `tolerance`: of the
/// bound over the mean radiosity.
nlohmann::ordered_json study_enclosures(const nlohmann::ordered_json& cases, double tolerance);

/// The result as a table for people, with a line of totals.
std::string enclosure_table(const nlohmann::ordered_json& result);

}  // namespace radbake::study
