#include "client/options/effect_options.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <sstream>
#include <string>

#include "client/options/target_options.h"
#include "client/options/words.h"

namespace radbake::options {
namespace {

const std::map<std::string, v1::EffectChoice> kEffectChoices = {
    {"on", v1::EFFECT_CHOICE_ON}, {"off", v1::EFFECT_CHOICE_OFF}, {"auto", v1::EFFECT_CHOICE_AUTO}};
const std::map<std::string, v1::ExtraLayer> kLayers = {
    {"direct", v1::EXTRA_LAYER_DIRECT}, {"indirect", v1::EXTRA_LAYER_INDIRECT}, {"ao", v1::EXTRA_LAYER_AO}};
constexpr double kMaxDistance = 1e6;

/// "NAME=on|off|auto".
void add_override(const std::string& text, std::map<std::string, v1::EffectChoice>& effects) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) {
    throw CLI::ValidationError("--effect", "'" + text + "': expected NAME=on, NAME=off or NAME=auto");
  }
  const std::string name = text.substr(0, equals);
  if (std::find(kEffectNames.begin(), kEffectNames.end(), name) == kEffectNames.end()) {
    std::string known;
    for (const std::string_view effect : kEffectNames) known += (known.empty() ? "" : ", ") + std::string(effect);
    throw CLI::ValidationError("--effect", "'" + name + "' is none of " + known);
  }
  const v1::EffectChoice choice = word_or_throw("--effect", kEffectChoices, text.substr(equals + 1));
  if (!effects.emplace(name, choice).second) throw CLI::ValidationError("--effect", "'" + name + "' is named twice");
}

std::set<v1::ExtraLayer> parse_layers(const std::string& text) {
  std::set<v1::ExtraLayer> layers;
  std::istringstream words(text + ",");
  for (std::string word; std::getline(words, word, ',');) layers.insert(word_or_throw("--layers", kLayers, word));
  return layers;
}

std::string check_distance(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (!text.empty() && *end == '\0' && value > 0 && value <= kMaxDistance) return "";
  return "'" + text + "' is not a number of metres above 0, at most 1000000";
}

}  // namespace

void add_effect_options(CLI::App& command, BakeChoices& choices) {
  command
      .add_option_function<std::vector<std::string>>(
          "--effect",
          [&choices](const std::vector<std::string>& texts) {
            choices.effects.clear();
            for (const std::string& text : texts) add_override(text, choices.effects);
          },
          "Simulates an effect or leaves it out, whatever the plan says; auto is the plan. May be given for several. "
          "radbake plan names them all, with its reasons; to force one that the scene has not is an error")
      ->type_name("NAME=on|off|auto")
      ->allow_extra_args(false);
  command
      .add_option_function<std::string>(
          "--layers", [&choices](const std::string& text) { choices.layers = parse_layers(text); },
          "Lightmaps beside the one of all light, one or more of direct (straight from lights), indirect (what "
          "surfaces "
          "reflect; both sum to all) and ao (openness, 0 to 1)")
      ->type_name("LIST");
  command
      .add_option("--ao-distance", choices.ao_distance, "Metres within which surfaces close in on openness; default: 1")
      ->check(check_distance, "")
      ->type_name("M");
}

std::string find_contradiction(const BakeChoices& choices) {
  if (!choices.layers.empty() && choices.output == v1::OUTPUT_VERTICES) {
    return "--layers are lightmaps, and --output vertices makes none";
  }
  if (choices.ao_distance > 0 && !choices.layers.contains(v1::EXTRA_LAYER_AO)) return "--ao-distance needs --layers ao";
  return find_target_contradiction(choices);
}

}  // namespace radbake::options
