#pragma once

#include <array>
#include <string_view>

#include "client/options/bake_options.h"

namespace radbake::options {

/// The effects that a plan decides, by the ids of Plan.effects and in its order.
inline constexpr std::array<std::string_view, 22> kEffectNames = {"emitters",
                                                                  "point",
                                                                  "spot",
                                                                  "directional",
                                                                  "sun",
                                                                  "sky",
                                                                  "hdri",
                                                                  "occlusion",
                                                                  "interreflection",
                                                                  "color",
                                                                  "textured_reflectance",
                                                                  "textured_emission",
                                                                  "alpha_mask",
                                                                  "tint",
                                                                  "two_sided",
                                                                  "vertices",
                                                                  "layers",
                                                                  "ambient_occlusion",
                                                                  "specular",
                                                                  "refraction",
                                                                  "normal_map",
                                                                  "volume"};

/// Gives a command --effect, --layers and --ao-distance. `choices` outlives it. Bad values throw CLI11's exception when
/// it parses.
void add_effect_options(CLI::App& command, BakeChoices& choices);

/// What is wrong with choices that are fine one by one; empty: nothing.
std::string find_contradiction(const BakeChoices& choices);

}  // namespace radbake::options
