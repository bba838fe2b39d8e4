#pragma once

#include <bitset>
#include <optional>
#include <string_view>

#include "common/scene/effect_names.h"

namespace radbake::radiosity {

/// One thing that light can do in a scene, or that a bake can say of it.
enum class Effect {
  kEmitters,             ///< surfaces that emit
  kPoint,                ///< point lights
  kSpot,                 ///< spot lights
  kIes,                  ///< luminaires of measured intensities
  kDirectional,          ///< parallel light
  kSun,                  ///< light from a disc in the sky: soft shadows
  kSky,                  ///< a sky of one luminance
  kHdri,                 ///< a sky of every direction
  kOcclusion,            ///< shadows of direct light, and what stands across a receiver
  kInterreflection,      ///< light that surfaces reflect
  kColor,                ///< three channels are solved; off: one
  kTexturedReflectance,  ///< textures and vertex colours in the bounce; off: the mean of each triangle
  kTexturedEmission,     ///< off: the mean of each triangle
  kAlphaMask,            ///< holes and partial coverage; off: opaque
  kTint,                 ///< sheets that light passes straight through; off: opaque
  kDiffuseTransmission,  ///< leaves, curtains: light that goes through scattered; off: they only reflect
  kTwoSided,             ///< backs reflect; off: they absorb
  kVertices,             ///< output: light by vertex
  kLayers,               ///< output: direct and indirect light apart
  kAmbientOcclusion,     ///< output: openness
  kSpecular,             ///< not simulated: mirrors, gloss
  kRefraction,           ///< not simulated
  kNormalMap,            ///< not simulated in the lightmap
  kVolume,               ///< not simulated: absorption and scattering inside
};
inline constexpr int kNumEffects = 24;

/// The ids that users see, in the order of Effect.
using radbake::kEffectNames;
static_assert(kEffectNames.size() == kNumEffects);
inline std::string_view effect_name(Effect effect) { return kEffectNames[static_cast<std::size_t>(effect)]; }
inline std::optional<Effect> effect_by_name(std::string_view name) {
  for (int e = 0; e < kNumEffects; ++e) {
    if (kEffectNames[static_cast<std::size_t>(e)] == name) return static_cast<Effect>(e);
  }
  return std::nullopt;
}

/// Which effects a bake simulates.
class EffectSet {
 public:
  static EffectSet all() {
    EffectSet set;
    set.bits_.set();
    return set;
  }
  bool has(Effect effect) const { return bits_[static_cast<std::size_t>(effect)]; }
  void set(Effect effect, bool is_on = true) { bits_[static_cast<std::size_t>(effect)] = is_on; }
  bool operator==(const EffectSet&) const = default;

 private:
  std::bitset<kNumEffects> bits_;
};

}  // namespace radbake::radiosity
