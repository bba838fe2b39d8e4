// radbake-study: what the numeric library's methods cost and how exact they are.
#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/base/version.h"
#include "server/study/cases.h"
#include "server/study/enclosure_study.h"
#include "server/study/form_factor_study.h"
#include "server/study/rates_study.h"

namespace {

using Json = nlohmann::ordered_json;

constexpr int kDone = 0, kNotWritten = 1, kUsage = 2, kBadInput = 3;

struct Choices {
  std::string cases;
  double tolerance = 0;
  std::string json;
  std::string estimator;  ///< of form factors
};

/// Prints what is wrong. Returns the exit code.
int fail(const radbake::Error& error, int code) {
  std::cerr << "radbake-study: error: " << error.message << '\n';
  return code;
}

/// Reads the cases, studies them, prints the table and writes the JSON.
int run(const Choices& choices, const std::function<Json(const Json&, double)>& study,
        const std::function<std::string(const Json&)>& table) {
  const auto cases = radbake::study::read_cases(choices.cases);
  if (!cases.ok()) return fail(cases.error(), kBadInput);
  const Json result = study(*cases, choices.tolerance);
  std::cout << table(result);
  if (choices.json.empty()) return kDone;
  const auto written = radbake::study::write_text(choices.json, result.dump(2) + "\n");
  return written.ok() ? kDone : fail(written.error(), kNotWritten);
}

/// Makes a folder where there is none, and writes a table and a plot of it there.
radbake::Result<void> write_study(const std::string& folder, const std::string& name, const std::string& csv,
                                  const radbake::study::Plot& plot) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) return radbake::internal_error("cannot make the folder " + folder + ": " + failure.message());
  RADBAKE_RETURN_IF_ERROR(radbake::study::write_text(std::filesystem::path(folder) / (name + ".csv"), csv));
  return radbake::study::draw(plot, folder, name);
}

int run_rates(const std::string& path, const std::string& folder) {
  const auto cases = radbake::study::read_cases(path);
  if (!cases.ok()) return fail(cases.error(), kBadInput);
  const auto study = radbake::study::study_rates(*cases, {});
  std::cout << radbake::study::rate_table(study);
  const auto written = write_study(folder, "rates", radbake::study::rate_csv(study), radbake::study::rate_plot(study));
  return written.ok() ? kDone : fail(written.error(), kNotWritten);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures the numeric methods of radbake: what is exact, by how much, and how long it takes");
  app.set_version_flag("--version", std::string("radbake-study ") + radbake::kEngineVersion);
  app.require_subcommand(1);
  const auto positive = [](const std::string& text) -> std::string {
    const double value = std::strtod(text.c_str(), nullptr);
    return value > 0 && std::isfinite(value) ? "" : "'" + text + "' is not a number above 0";
  };

  Choices form_factors{{}, 1e-4, {}, "analytic"};
  CLI::App* factors = app.add_subcommand("form-factors", "Form factors of polygon pairs, against known values");
  factors->add_option("CASES", form_factors.cases, "List of cases: polygons, from, to, occluders, exact")->required();
  factors->add_option("--tolerance", form_factors.tolerance, "Error that is asked for, absolute")
      ->check(positive, "")
      ->capture_default_str();
  factors
      ->add_option("--estimator", form_factors.estimator,
                   "How: analytic (by formula), hemisphere (rays) or hemicube; the sampled ones go on until the error "
                   "that they state is within the tolerance or their limit of rays ends it")
      ->check(
          [](const std::string& text) -> std::string {
            const auto estimator = radbake::study::pair_estimator_by_name(text);
            return estimator.ok() ? "" : estimator.error().message;
          },
          "")
      ->capture_default_str();
  factors->add_option("--json", form_factors.json, "Also write the results to this file");
  factors->footer("\nExample:\n  radbake-study form-factors tests/reference/form_factor_cases.json --tolerance 1e-6\n");

  Choices enclosures{{}, 5e-11, {}, {}};
  CLI::App* solve = app.add_subcommand("enclosures", "Enclosures with given form factors, by every solver");
  solve->add_option("CASES", enclosures.cases, "List of cases: F, areas, rho, E, B")->required();
  solve->add_option("--tolerance", enclosures.tolerance, "Error bound to stop at, over the mean radiosity")
      ->check(positive, "")
      ->capture_default_str();
  solve->add_option("--json", enclosures.json, "Also write the results to this file");
  solve->footer("\nExample:\n  radbake-study enclosures tests/reference/radiosity_cases.json --json solved.json\n");

  std::string rate_cases, rate_folder;
  CLI::App* rates = app.add_subcommand("rates", "How the errors of rays and hemicubes fall with their number");
  rates->add_option("CASES", rate_cases, "List of cases: polygons, from, to, occluders")->required();
  rates
      ->add_option("-o,--out", rate_folder,
                   "Folder for rates.csv, rates.svg and rates.png; is made where there is none")
      ->required()
      ->type_name("DIR");
  rates->footer("\nExample:\n  radbake-study rates tests/reference/form_factor_cases.json -o rates\n");

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  if (factors->parsed()) {
    const auto estimator = radbake::study::pair_estimator_by_name(form_factors.estimator).value();
    const auto study = [estimator](const Json& cases, double tolerance) {
      return radbake::study::study_form_factors(cases, estimator, tolerance);
    };
    return run(form_factors, study, radbake::study::form_factor_table);
  }
  if (rates->parsed()) return run_rates(rate_cases, rate_folder);
  return run(enclosures, radbake::study::study_enclosures, radbake::study::enclosure_table);
}
