// radbake-study: what the numeric library's methods cost and how exact they are.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdlib>
#include <string>

#include "common/base/version.h"
#include "server/study/commands.h"

namespace {

using radbake::study::AccuracyChoices;
using radbake::study::CaseChoices;
using radbake::study::SceneChoices;
using radbake::study::ViewChoices;

std::string check_positive(const std::string& text) {
  const double value = std::strtod(text.c_str(), nullptr);
  return value > 0 && std::isfinite(value) ? "" : "'" + text + "' is not a number above 0";
}

std::string check_estimator(const std::string& text) {
  const auto estimator = radbake::study::pair_estimator_by_name(text);
  return estimator.ok() ? "" : estimator.error().message;
}

CLI::App* add_form_factors(CLI::App& app, CaseChoices& choices) {
  CLI::App* sub = app.add_subcommand("form-factors", "Form factors of polygon pairs, against known values");
  sub->add_option("CASES", choices.cases, "List of cases: polygons, from, to, occluders, exact")->required();
  sub->add_option(
         "--estimator", choices.estimator,
         "How: analytic (by formula), hemisphere (rays), hemicube, or adaptive (near and large pairs by formula, "
         "others by rays); what is sampled goes on until the error that it states is within the tolerance or "
         "its limit of rays ends it")
      ->check(check_estimator, "")
      ->capture_default_str();
  sub->add_option("--tolerance", choices.tolerance, "Error that is asked for, absolute")
      ->check(check_positive, "")
      ->capture_default_str();
  sub->add_option("--json", choices.json, "Also write the results to this file");
  sub->footer("\nExample:\n  radbake-study form-factors tests/reference/form_factor_cases.json --tolerance 1e-6\n");
  return sub;
}

CLI::App* add_enclosures(CLI::App& app, CaseChoices& choices) {
  CLI::App* sub = app.add_subcommand("enclosures", "Enclosures with given form factors, by every solver");
  sub->add_option("CASES", choices.cases, "List of cases: F, areas, rho, E, B")->required();
  sub->add_option("--tolerance", choices.tolerance, "Error bound to stop at, over the mean radiosity")
      ->check(check_positive, "")
      ->capture_default_str();
  sub->add_option("--json", choices.json, "Also write the results to this file");
  sub->footer("\nExample:\n  radbake-study enclosures tests/reference/radiosity_cases.json --json solved.json\n");
  return sub;
}

void add_folder(CLI::App& command, std::string& folder, const std::string& what) {
  command.add_option("-o,--out", folder, "Folder for " + what + "; is made where there is none")
      ->required()
      ->type_name("DIR");
}

CLI::App* add_rates(CLI::App& app, CaseChoices& choices, std::string& folder) {
  CLI::App* sub = app.add_subcommand("rates", "How the errors of rays and hemicubes fall with their number");
  sub->add_option("CASES", choices.cases, "List of cases: polygons, from, to, occluders")->required();
  add_folder(*sub, folder, "rates.csv, rates.svg and rates.png");
  sub->footer("\nExample:\n  radbake-study rates tests/reference/form_factor_cases.json -o rates\n");
  return sub;
}

CLI::App* add_convergence(CLI::App& app, SceneChoices& choices) {
  CLI::App* sub = app.add_subcommand("convergence", "How fast the solvers converge on a scene, side by side");
  sub->add_option("SCENE", choices.scene, "A .glb or .gltf file")->required();
  add_folder(*sub, choices.folder, "convergence.csv, convergence.svg and convergence.png");
  sub->add_option("--tolerance", choices.tolerance, "Error bound to stop at, over the mean radiosity")
      ->check(check_positive, "")
      ->capture_default_str();
  radbake::options::add_bake_options(*sub, choices.bake);
  sub->footer(
      "\nThe options of a bake decide the patches and their form factors; --solver is not looked at.\n"
      "\nExample:\n  radbake-study convergence tests/scenes/cornell.glb -o convergence --max-patches 1000\n");
  return sub;
}

CLI::App* add_bake(CLI::App& app, SceneChoices& choices) {
  CLI::App* sub = app.add_subcommand("bake", "Bakes in this process and prints the seconds of the bake itself");
  sub->add_option("SCENE", choices.scene, "A .glb or .gltf file")->required();
  add_folder(*sub, choices.folder, "the lightmaps, as EXR");
  radbake::options::add_bake_options(*sub, choices.bake);
  sub->footer("\nExample:\n  radbake-study bake tests/scenes/cornell.glb -o baked --form-factors hemicube\n");
  return sub;
}

CLI::App* add_accuracy(CLI::App& app, AccuracyChoices& choices) {
  CLI::App* sub =
      app.add_subcommand("accuracy", "What accuracy costs: bakes by some forty settings, against a reference");
  sub->add_option("SCENE", choices.scene.scene, "A .glb or .gltf file")->required();
  add_folder(*sub, choices.scene.folder, "accuracy.md, accuracy.csv, accuracy.svg and accuracy.png");
  CLI::Option* reference =
      sub->add_option("--reference", choices.reference,
                      "EXR to measure against; default: two dense bakes with form factors of near pairs by formula")
          ->type_name("FILE");
  sub->add_option("--reference-scale", choices.reference_scale, "Factor on it: 3.14159265359 for irradiance / pi")
      ->check(check_positive, "")
      ->needs(reference)
      ->type_name("S");
  sub->add_option("--reference-error", choices.reference_error, "Its own relative error, as a fraction")
      ->check(check_positive, "")
      ->needs(reference)
      ->type_name("E");
  sub->add_option("--reference-rays", choices.reference_rays,
                  "Rays of each texel of the reference that is baked; light samples in proportion; default: 8192")
      ->check(CLI::Range(64, 65536))
      ->excludes(reference)
      ->type_name("N");
  sub->add_option("--bake-limit", choices.bake_limit_seconds,
                  "Seconds that a fixed setting may take: what takes longer is left out; default: 120")
      ->check(check_positive, "")
      ->type_name("SECONDS");
  radbake::options::add_bake_options(*sub, choices.scene.bake);
  sub->footer(
      "\nRays, patches, light samples, spacing, form factors, solvers and targets are what is swept: options that set "
      "them\nchange the progressive bakes at most.\n"
      "\nExamples:\n  radbake-study accuracy tests/scenes/cornell.glb -o accuracy --atlas-size 256\n"
      "  radbake-study accuracy tests/scenes/cornell.glb -o accuracy --atlas-size 256 --reference-error 0.003 "
      "--reference-scale 3.14159265359 --reference tests/golden/cornell_ref.exr\n");
  return sub;
}

CLI::App* add_view(CLI::App& app, ViewChoices& choices) {
  CLI::App* sub = app.add_subcommand("view", "Draws a baked room with its lightmaps, as a PNG");
  sub->add_option("DIR", choices.folder, "Folder that `radbake submit` wrote")->required();
  sub->add_option("-o,--out", choices.picture, "Picture to write, PNG")->required()->type_name("FILE");
  sub->add_option(
         "--camera", choices.camera,
         "Eye and target in metres, and degrees across the longer side; default: from a corner across the room")
      ->type_name("X,Y,Z,X,Y,Z[,DEGREES]");
  sub->add_option("--size", choices.size, "Pixels")->type_name("WxH")->capture_default_str();
  sub->add_option("--samples", choices.samples, "Rays along either side of a pixel")
      ->check(CLI::Range(1, 16))
      ->type_name("N")
      ->capture_default_str();
  sub->add_option("--exposure", choices.exposure, "White for a luminance of 4 / E nit; default: by the brightest parts")
      ->check(check_positive, "")
      ->type_name("E");
  sub->add_option("--background", choices.background, "Luminance outside, nit; default: black")
      ->delimiter(',')
      ->expected(3)
      ->type_name("R,G,B");
  sub->footer(
      "\nExample:\n  radbake submit tests/scenes/cornell.glb -o baked --max-error 2%\n"
      "  radbake-study view baked -o cornell.png\n");
  return sub;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace radbake::study;
  CLI::App app("Measures the numeric methods of radbake: what is exact, by how much, and how long it takes");
  app.set_version_flag("--version", std::string("radbake-study ") + radbake::kEngineVersion);
  app.require_subcommand(1);
  CaseChoices form_factors{{}, 1e-4, {}, "analytic"}, enclosures{{}, 5e-11, {}, {}}, rates;
  std::string rates_folder;
  SceneChoices convergence{{}, {}, 1e-8, {}}, bake;
  const CLI::App* for_form_factors = add_form_factors(app, form_factors);
  const CLI::App* for_enclosures = add_enclosures(app, enclosures);
  const CLI::App* for_rates = add_rates(app, rates, rates_folder);
  const CLI::App* for_convergence = add_convergence(app, convergence);
  AccuracyChoices accuracy;
  const CLI::App* for_accuracy = add_accuracy(app, accuracy);
  ViewChoices view;
  const CLI::App* for_view = add_view(app, view);
  add_bake(app, bake);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  if (for_form_factors->parsed()) return run_form_factors(form_factors);
  if (for_enclosures->parsed()) return run_enclosures(enclosures);
  if (for_rates->parsed()) return run_rates(rates.cases, rates_folder);
  if (for_convergence->parsed()) return run_convergence(convergence);
  if (for_accuracy->parsed()) return run_accuracy(accuracy);
  if (for_view->parsed()) return run_view(view);
  return run_bake(bake);
}
