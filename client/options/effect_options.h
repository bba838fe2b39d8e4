#pragma once

#include <string>

#include "client/options/bake_options.h"
#include "common/scene/effect_names.h"

namespace radbake::options {

/// Gives a command --effect, --layers and --ao-distance. `choices` outlives it. Bad values throw CLI11's exception when
/// it parses.
void add_effect_options(CLI::App& command, BakeChoices& choices);

/// What is wrong with choices that are fine one by one; empty: nothing.
std::string find_contradiction(const BakeChoices& choices);

}  // namespace radbake::options
