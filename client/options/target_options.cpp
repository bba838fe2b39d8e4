#include "client/options/target_options.h"

#include <map>

#include "client/options/values.h"
#include "client/options/words.h"

namespace radbake::options {
namespace {

std::map<std::string, double> errors_by_name() {
  std::map<std::string, double> errors;
  for (const Quality& quality : kQualities) errors.emplace(quality.name, quality.max_error);
  return errors;
}

}  // namespace

void add_target_options(CLI::App& command, BakeChoices& choices) {
  command
      .add_option_function<std::string>(
          "--max-error",
          [&choices](const std::string& text) { choices.max_error = value_or_throw("--max-error", parse_share(text)); },
          "Error to reach: root mean square error of the lightmaps' texels over their mean irradiance, as a percentage "
          "or a fraction; the bake is refined pass by pass until its estimate holds it")
      ->type_name("N%");
  command
      .add_option_function<std::string>(
          "--quality",
          [&choices](const std::string& text) {
            word_or_throw("--quality", errors_by_name(), text);
            choices.quality = text;
          },
          "An error to reach by its name: draft (10 %), preview (5 %), production (2 %) or reference (1 %)")
      ->type_name("NAME");
  command
      .add_option_function<std::string>(
          "--time-budget",
          [&choices](const std::string& text) {
            choices.time_budget_ms = value_or_throw("--time-budget", parse_milliseconds(text));
          },
          "Time from the server's acceptance of the bake to the last tile, a wait in its queue included: N or Ns, Nms, "
          "Nm, Nh. Passes follow as long as they fit; with an error to reach, until it is reached or the time is up")
      ->type_name("TIME");
}

double asked_error(const BakeChoices& choices) {
  return choices.quality.empty() ? choices.max_error : errors_by_name().at(choices.quality);
}

std::string find_target_contradiction(const BakeChoices& choices) {
  const std::string target = choices.quality.empty() ? "--max-error" : "--quality";
  if (!choices.quality.empty() && choices.max_error > 0)
    return "--quality is a name for a --max-error: give one of them";
  if (choices.rays > 0 && asked_error(choices) > 0) {
    return "--rays says how much is done, " + target + " what is to be reached: give one of them";
  }
  if (choices.rays > 0 && choices.time_budget_ms > 0) {
    return "--rays says how much is done, --time-budget how long it may take: give one of them";
  }
  return "";
}

}  // namespace radbake::options
