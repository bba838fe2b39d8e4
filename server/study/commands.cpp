#include "server/study/commands.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "client/image/write_image.h"
#include "server/settings/to_options.h"
#include "server/study/accuracy_report.h"
#include "server/study/accuracy_study.h"
#include "server/study/bake_study.h"
#include "server/study/cases.h"
#include "server/study/convergence_study.h"
#include "server/study/enclosure_study.h"
#include "server/study/rates_study.h"
#include "server/study/study_scene.h"
#include "server/study/view_scene.h"

namespace radbake::study {
namespace {

using Json = nlohmann::ordered_json;

ExitCode fail(const Error& error, ExitCode code) {
  std::cerr << "radbake-study: error: " << error.message << '\n';
  return code;
}

/// Reads the cases, studies them, prints the table and writes the JSON.
ExitCode run_cases(const CaseChoices& choices, const std::function<Json(const Json&)>& study,
                   const std::function<std::string(const Json&)>& table) {
  const auto cases = read_cases(choices.cases);
  if (!cases.ok()) return fail(cases.error(), kBadInput);
  const Json result = study(*cases);
  std::cout << table(result);
  if (choices.json.empty()) return kDone;
  const auto written = write_text(choices.json, result.dump(2) + "\n");
  return written.ok() ? kDone : fail(written.error(), kNotWritten);
}

Result<void> make_folder(const std::string& folder) {
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) return internal_error("cannot make the folder " + folder + ": " + failure.message());
  return {};
}

/// Writes a table and a plot of it to a folder. The table is there even where the plot cannot be drawn.
ExitCode write_study(const std::string& folder, const std::string& name, const std::string& csv, const Plot& plot) {
  const std::filesystem::path table = std::filesystem::path(folder) / (name + ".csv");
  const auto written = write_text(table, csv);
  if (!written.ok()) return fail(written.error(), kNotWritten);
  const auto drawn = draw(plot, folder, name);
  if (drawn.ok()) return kDone;
  Error error = drawn.error();
  error.message += "; the numbers are in " + table.string();
  return fail(error, kNotWritten);
}

/// Reads a scene and prints its warnings.
Result<Scene> read_scene(const SceneChoices& choices) {
  RADBAKE_ASSIGN_OR_RETURN(StudyScene read, read_study_scene(choices.scene, choices.bake));
  for (const Warning& warning : read.warnings) std::cerr << "radbake-study: warning: " << warning.text << '\n';
  return std::move(read.scene);
}

radiosity::BakeOptions bake_options(const SceneChoices& choices) {
  return settings::to_options(options::to_settings(choices.bake), options::to_run_options(choices.bake));
}

}  // namespace

ExitCode run_form_factors(const CaseChoices& choices) {
  const auto estimator = pair_estimator_by_name(choices.estimator);
  if (!estimator.ok()) return fail(estimator.error(), kUsage);
  const auto study = [&](const Json& cases) { return study_form_factors(cases, *estimator, choices.tolerance); };
  return run_cases(choices, study, form_factor_table);
}

ExitCode run_enclosures(const CaseChoices& choices) {
  const auto study = [&](const Json& cases) { return study_enclosures(cases, choices.tolerance); };
  return run_cases(choices, study, enclosure_table);
}

ExitCode run_rates(const std::string& path, const std::string& folder) {
  const auto cases = read_cases(path);
  if (!cases.ok()) return fail(cases.error(), kBadInput);
  // Before the minutes that follow.
  if (const auto made = make_folder(folder); !made.ok()) return fail(made.error(), kNotWritten);
  const RateStudy study = study_rates(*cases, {});
  std::cout << rate_table(study);
  return write_study(folder, "rates", rate_csv(study), rate_plot(study));
}

ExitCode run_convergence(const SceneChoices& choices) {
  const auto scene = read_scene(choices);
  if (!scene.ok()) return fail(scene.error(), kBadInput);
  if (const auto made = make_folder(choices.folder); !made.ok()) return fail(made.error(), kNotWritten);
  const auto study = study_convergence_of(*scene, bake_options(choices), choices.tolerance);
  if (!study.ok()) return fail(study.error(), kBadInput);
  std::cout << convergence_table(*study);
  return write_study(choices.folder, "convergence", convergence_csv(*study), convergence_plot(*study));
}

ExitCode run_bake(const SceneChoices& choices) {
  const auto scene = read_scene(choices);
  if (!scene.ok()) return fail(scene.error(), kBadInput);
  if (const auto made = make_folder(choices.folder); !made.ok()) return fail(made.error(), kNotWritten);
  const auto bake = bake_timed(*scene, bake_options(choices));
  if (!bake.ok()) {
    return fail(bake.error(), bake.error().code == ErrorCode::kInvalidArgument ? kBadInput : kFailed);
  }
  for (const Warning& warning : bake->outcome.report.warnings) {
    std::cerr << "radbake-study: warning: " << warning.text << '\n';
  }
  std::cout << bake_table(*bake);
  const auto written = write_lightmaps(bake->outcome, choices.folder);
  return written.ok() ? kDone : fail(written.error(), kNotWritten);
}

namespace {

/// A file, or two bakes.
Result<AccuracyReference> find_reference(const AccuracyChoices& choices, const Scene& scene,
                                         const radiosity::BakeOptions& base) {
  if (choices.reference.empty()) {
    ReferenceEffort effort;
    if (choices.reference_rays > 0) {
      effort.light_samples = std::max(4, choices.reference_rays * effort.light_samples / effort.rays);
      effort.rays = choices.reference_rays;
    }
    std::cerr << "radbake-study: baking the reference\n";
    return make_reference(scene, base, effort);
  }
  AccuracyReference reference;
  RADBAKE_ASSIGN_OR_RETURN(reference.map, image::read_exr(choices.reference));
  const auto channels = static_cast<std::size_t>(reference.map.channels);
  for (std::size_t k = 0; k < reference.map.values.size(); ++k) {
    if (k % channels < 3) reference.map.values[k] *= static_cast<float>(choices.reference_scale);
  }
  reference.error = choices.reference_error;
  reference.origin = "`" + std::filesystem::path(choices.reference).filename().string() + "`";
  reference.is_ours = false;
  return reference;
}

}  // namespace

ExitCode run_accuracy(const AccuracyChoices& choices) {
  const auto scene = read_scene(choices.scene);
  if (!scene.ok()) return fail(scene.error(), kBadInput);
  // Before the minutes that follow.
  const std::string& folder = choices.scene.folder;
  if (const auto made = make_folder(folder); !made.ok()) return fail(made.error(), kNotWritten);
  AccuracySweep sweep = default_sweep(bake_options(choices.scene));
  if (choices.bake_limit_seconds > 0) sweep.bake_limit_seconds = choices.bake_limit_seconds;
  auto reference = find_reference(choices, *scene, sweep.base);
  if (!reference.ok()) {
    return fail(reference.error(), reference.error().code == ErrorCode::kInvalidArgument ? kBadInput : kFailed);
  }
  const auto on_bake = [](std::size_t done, std::size_t total, const std::string& what) {
    std::cerr << "radbake-study: " << done + 1 << " of " << total << ": " << what << '\n';
  };
  auto study = study_accuracy(*scene, sweep, std::move(*reference), on_bake);
  if (!study.ok()) return fail(study.error(), kBadInput);
  study->scene = std::filesystem::path(choices.scene.scene).filename().string();
  const std::string page = accuracy_page(*study, "accuracy.png");
  std::cout << page;
  const auto written = write_text(std::filesystem::path(folder) / "accuracy.md", page);
  if (!written.ok()) return fail(written.error(), kNotWritten);
  return write_study(folder, "accuracy", accuracy_csv(*study), accuracy_plot(*study));
}

namespace {

/// "960x640"
Result<std::pair<int, int>> parse_size(const std::string& text) {
  constexpr int kMost = 8192;
  int width = 0, height = 0, end = 0;
  if (std::sscanf(text.c_str(), "%5dx%5d%n", &width, &height, &end) == 2 &&
      static_cast<std::size_t>(end) == text.size() && width >= 1 && height >= 1 && width <= kMost && height <= kMost) {
    return std::pair(width, height);
  }
  return invalid_argument("size '" + text + "' is not WIDTHxHEIGHT, each from 1 to " + std::to_string(kMost));
}

}  // namespace

ExitCode run_view(const ViewChoices& choices) {
  ViewOptions options;
  const auto size = parse_size(choices.size);
  if (!size.ok()) return fail(size.error(), kUsage);
  std::tie(options.width, options.height) = *size;
  options.samples = choices.samples;
  if (choices.background.size() == 3) {
    options.background = {choices.background[0], choices.background[1], choices.background[2]};
  }
  Camera camera;
  if (!choices.camera.empty()) {
    const auto parsed = parse_camera(choices.camera);
    if (!parsed.ok()) return fail(parsed.error(), kUsage);
    camera = *parsed;
  }
  const auto baked = read_baked_scene(choices.folder);
  if (!baked.ok()) return fail(baked.error(), kBadInput);
  if (choices.camera.empty()) camera = default_camera(baked->scene);
  const auto picture = render_view(*baked, camera, options);
  if (!picture.ok()) return fail(picture.error(), kUsage);
  const auto written =
      image::write_png(choices.picture, options.width, options.height, developed(*picture, choices.exposure));
  return written.ok() ? kDone : fail(written.error(), kNotWritten);
}

}  // namespace radbake::study
