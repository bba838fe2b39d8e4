#pragma once

#include <array>
#include <string>
#include <string_view>

#include "client/options/bake_options.h"

namespace radbake::options {

/// An error to reach that has a name.
struct Quality {
  std::string_view name;
  double max_error;  ///< relative RMSE, as a fraction
};
inline constexpr std::array<Quality, 4> kQualities = {
    {{"draft", 0.10}, {"preview", 0.05}, {"production", 0.02}, {"reference", 0.01}}};

/// Gives a command --max-error, --quality and --time-budget. `choices` outlives it. Bad values throw CLI11's exception
/// when it parses.
void add_target_options(CLI::App& command, BakeChoices& choices);

/// The error that is to be reached, by number or by name; 0: none.
double asked_error(const BakeChoices& choices);

/// What is wrong with targets that are fine one by one; empty: nothing.
std::string find_target_contradiction(const BakeChoices& choices);

}  // namespace radbake::options
