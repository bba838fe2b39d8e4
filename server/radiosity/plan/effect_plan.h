#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/radiosity/survey/effects.h"
#include "server/radiosity/survey/survey.h"

namespace radbake::radiosity {

enum class EffectState {
  kAbsent,  ///< neither the scene nor the settings have such a thing
  kOff,     ///< possible, and without effect here; may be forced
  kOn,
  kUnsupported,  ///< in the scene, and not simulated
};
/// "absent", "off", "on", "unsupported".
inline const char* effect_state_name(EffectState state) {
  switch (state) {
    case EffectState::kAbsent: return "absent";
    case EffectState::kOff: return "off";
    case EffectState::kOn: return "on";
    case EffectState::kUnsupported: return "unsupported";
  }
  return "unknown";
}

/// What a bake does of an effect. Field for field radbake.v1.EffectPlan.
struct EffectPlan {
  Effect effect = Effect::kEmitters;
  EffectState state = EffectState::kAbsent;
  std::string reason;
  double value = 0;  ///< the number in the reason: a count, a share, an angle
  bool is_forced = false;
};

/// Overrides by a user: true is on, false off; what is not in it is decided by the scene.
using EffectOverrides = std::map<Effect, bool>;

/// What a user asks for that is an effect of its own, or would be left of it.
struct AskedOutputs {
  bool lightmaps = true;
  bool vertices = false, layers = false, ambient_occlusion = false;
};

/// Decides which effects a bake of a scene simulates, each with its reason. A pure function.
///
/// Shapes: returns each effect once, in the order of Effect.
/// Errors: kInvalidArgument naming the effect, where an override contradicts the scene: on what it does not have, or
/// what is not simulated at all; off what leaves no light or nothing to put out.
Result<std::vector<EffectPlan>> plan_effects(const Survey& survey, const AskedOutputs& asked,
                                             const EffectOverrides& overrides);

/// Those that are on.
EffectSet effects_on(const std::vector<EffectPlan>& plan);

/// Whether a set has any kind of light.
bool has_light(const EffectSet& effects);

}  // namespace radbake::radiosity
