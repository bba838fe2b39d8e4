#pragma once

#include <array>
#include <string_view>

namespace radbake {

/// The effects that a plan decides, by the ids that users see, in the order of Plan.effects.
inline constexpr std::array<std::string_view, 24> kEffectNames = {"emitters",
                                                                  "point",
                                                                  "spot",
                                                                  "ies",
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
                                                                  "diffuse_transmission",
                                                                  "two_sided",
                                                                  "vertices",
                                                                  "layers",
                                                                  "ambient_occlusion",
                                                                  "specular",
                                                                  "refraction",
                                                                  "normal_map",
                                                                  "volume"};

}  // namespace radbake
