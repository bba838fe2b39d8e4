#include "server/radiosity/plan/effect_plan.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <sstream>

namespace radbake::radiosity {
namespace {

constexpr std::array kLightEffects = {Effect::kEmitters,    Effect::kPoint, Effect::kSpot, Effect::kIes,
                                      Effect::kDirectional, Effect::kSun,   Effect::kSky,  Effect::kHdri};

std::string number(double value) {
  std::ostringstream text;
  text.precision(3);
  text << value;
  return text.str();
}
std::string counted(std::uint64_t n, const std::string& thing) {
  return std::to_string(n) + " " + thing + (n == 1 ? "" : "s");
}

/// What a scene by itself calls for.
struct Decision {
  EffectState state = EffectState::kAbsent;
  std::string reason;
  double value = 0;
};
Decision absent(const std::string& reason) { return {EffectState::kAbsent, reason, 0}; }
Decision off(const std::string& reason, double value = 0) { return {EffectState::kOff, reason, value}; }
Decision on(const std::string& reason, double value = 0) { return {EffectState::kOn, reason, value}; }

/// Decides effect after effect: some depend on others, and on what is forced of them.
class EffectPlanner {
 public:
  EffectPlanner(const Survey& survey, const AskedOutputs& asked, const EffectOverrides& overrides)
      : survey_(survey), asked_(asked), overrides_(overrides) {}

  Result<std::vector<EffectPlan>> plan() {
    decide(Effect::kAlphaMask, alpha_mask());
    decide(Effect::kTint, tint());
    decide(Effect::kTwoSided, two_sided());
    decide(Effect::kDiffuseTransmission, diffuse_transmission());
    // Light from outside enters where there is an opening, a hole or a sheet.
    is_sealed_ = survey_.is_closed && !is_on(Effect::kAlphaMask) && !is_on(Effect::kTint);
    decide(Effect::kEmitters, emitters());
    decide(Effect::kPoint, light(survey_.point, "point light"));
    decide(Effect::kSpot, light(survey_.spot, "spot light"));
    decide(Effect::kIes, light(survey_.ies, "luminaire with measured intensities"));
    decide(Effect::kDirectional, light(survey_.directional, "directional light"));
    decide(Effect::kSun, sun());
    decide(Effect::kSky, sky());
    decide(Effect::kHdri, hdri());
    decide(Effect::kOcclusion, occlusion());
    decide(Effect::kInterreflection, interreflection());
    decide(Effect::kColor, color());
    decide(Effect::kTexturedReflectance, textured_reflectance());
    decide(Effect::kTexturedEmission, textured_emission());
    decide(Effect::kVertices, output(asked_.vertices, "light by vertex"));
    decide(Effect::kLayers, output(asked_.layers, "layers of direct or indirect light"));
    decide(Effect::kAmbientOcclusion, output(asked_.ambient_occlusion, "ambient occlusion"));
    decide(Effect::kSpecular, unsupported(survey_.area_specular_m2, "mirrors or shines and is baked as diffuse"));
    decide(Effect::kRefraction, unsupported(survey_.area_refractive_m2, "bends light that passes"));
    decide(Effect::kNormalMap,
           unsupported(survey_.area_normal_mapped_m2, "has a normal map, which the lightmap does not show"));
    decide(Effect::kVolume, unsupported(survey_.area_volume_m2, "absorbs or scatters light inside"));
    RADBAKE_RETURN_IF_ERROR(check_overrides());
    return std::vector<EffectPlan>(plans_.begin(), plans_.end());
  }

 private:
  /// Keeps a decision, or what an override makes of it.
  void decide(Effect effect, const Decision& own) {
    EffectPlan& plan = plans_[static_cast<std::size_t>(effect)];
    plan = {effect, own.state, own.reason, own.value, false};
    const auto found = overrides_.find(effect);
    if (found == overrides_.end() || own.state == EffectState::kAbsent || own.state == EffectState::kUnsupported) {
      return;
    }
    plan.is_forced = true;
    plan.state = found->second ? EffectState::kOn : EffectState::kOff;
    plan.reason = std::string(found->second ? "forced on" : "forced off") +
                  (own.state == plan.state          ? ": "
                   : own.state == EffectState::kOff ? ", without need: "
                                                    : ", despite: ") +
                  own.reason;
  }
  bool is_on(Effect effect) const { return plans_[static_cast<std::size_t>(effect)].state == EffectState::kOn; }

  std::string area(double square_metres) const {
    return number(100 * square_metres / survey_.area_m2) + " % of the area (" + number(square_metres) + " m2)";
  }

  Decision alpha_mask() const {
    const std::uint64_t num = survey_.num_alpha_materials, opaque = survey_.num_alpha_opaque;
    if (num == 0) return absent("no material is masked or blended");
    if (opaque == num) {
      return off(std::to_string(opaque) + " of " + counted(num, "masked or blended material") +
                     (num == 1 ? " is" : " are") + " opaque in fact",
                 static_cast<double>(opaque));
    }
    if (survey_.is_exposed) return off(exposed() + ": what would shine through a hole meets no front");
    return on(area(survey_.area_masked_m2) + " has holes or is partly transparent",
              survey_.area_masked_m2 / survey_.area_m2);
  }

  Decision tint() const {
    if (survey_.area_tinted_m2 <= 0) return absent("no material lets light straight through");
    if (survey_.is_exposed) return off(exposed() + ": what shines through a sheet meets no front");
    return on("light passes straight through " + area(survey_.area_tinted_m2),
              survey_.area_tinted_m2 / survey_.area_m2);
  }

  Decision diffuse_transmission() const {
    if (survey_.area_translucent_m2 <= 0) return absent("no material lets light through scattered");
    if (!is_on(Effect::kTwoSided)) return off("backs are not simulated");
    return on("light goes scattered through " + area(survey_.area_translucent_m2),
              survey_.area_translucent_m2 / survey_.area_m2);
  }

  Decision emitters() const {
    const std::uint64_t num = survey_.num_emissive_materials;
    if (num == 0) return absent("no material emits");
    if (survey_.num_emissive_dark == num) {
      return off(counted(num, "emissive texture") + (num == 1 ? " is" : " are") + " black in fact",
                 static_cast<double>(num));
    }
    const std::uint64_t triangles = survey_.num_emitter_triangles + survey_.num_glowing_triangles;
    return on(counted(triangles, "triangle") + (triangles == 1 ? " emits " : " emit ") +
                  number(survey_.emitted_lumens) + " lm",
              survey_.emitted_lumens);
  }

  Decision light(const LightFacts& facts, const std::string& name) const {
    const auto some = static_cast<double>(facts.num);
    if (facts.num == 0) return absent("the scene has no " + name);
    if (facts.num_lit == 0) return off(counted(facts.num, name) + " of zero intensity", some);
    const std::string lit = counted(facts.num_lit, name);
    if (facts.num_facing == 0) return off("no surface faces the " + lit, some);
    if (is_sealed_ && facts.num_beyond == facts.num_lit) {
      return off("closed: no light of the " + lit + " outside enters", some);
    }
    return on(lit, static_cast<double>(facts.num_lit));
  }

  Decision sun() const {
    Decision own = light(survey_.sun, "light with an angular diameter");
    if (own.state != EffectState::kOn) return own;
    const double degrees = survey_.sun_diameter_radians * 180 / std::numbers::pi;
    const std::string wide = " of " + number(degrees) + " degrees: soft shadows";
    return on((survey_.sun.num_lit == 1 ? "a disc" : std::to_string(survey_.sun.num_lit) + " discs, the widest") + wide,
              degrees);
  }

  Decision sky() const {
    if (!survey_.has_sky) return absent("no sky of one luminance is given");
    if (is_sealed_) return off("closed: no light of the sky enters");
    return on("a sky of one luminance");
  }

  Decision hdri() const {
    if (!survey_.has_environment) return absent("no sky of every direction is given");
    if (!survey_.is_environment_lit) return off("the sky of every direction is black");
    if (is_sealed_) return off("closed: no light of the sky enters");
    return on("a sky of every direction");
  }

  std::string exposed() const {
    return "exposed: nothing lies before any of " + counted(survey_.num_triangles, "triangle");
  }

  Decision occlusion() const {
    const auto triangles = static_cast<double>(survey_.num_triangles);
    if (survey_.is_exposed) return off(exposed(), triangles);
    const auto is_inside = [this](Effect effect, const LightFacts& facts) {
      return !is_on(effect) || facts.num_outside == 0;
    };
    if (survey_.is_convex && !is_on(Effect::kHdri) && is_inside(Effect::kPoint, survey_.point) &&
        is_inside(Effect::kSpot, survey_.spot) && is_inside(Effect::kIes, survey_.ies) &&
        is_inside(Effect::kDirectional, survey_.directional) && is_inside(Effect::kSun, survey_.sun)) {
      return off("convex: " + counted(survey_.num_triangles, "triangle") + " see all of each other and of the lights",
                 triangles);
    }
    return on(survey_.is_convex ? "light comes from outside of a convex scene"
                                : counted(survey_.num_triangles, "triangle") + " may hide light from each other",
              triangles);
  }

  Decision interreflection() const {
    if (survey_.max_reflectance <= 0) return off("no surface reflects");
    if (survey_.is_exposed) return off(exposed(), static_cast<double>(survey_.num_triangles));
    return on((survey_.area_translucent_m2 > 0 ? "surfaces send on up to " : "surfaces reflect up to ") +
                  number(100 * survey_.max_reflectance) + " %",
              survey_.max_reflectance);
  }

  Decision color() const {
    if (survey_.is_grey) return off("grey: one channel is solved", 1);
    return on("materials or lights differ by channel: three are solved", 3);
  }

  Decision textured_reflectance() const {
    const VariationFacts& facts = survey_.varying_reflectance;
    if (facts.num == 0) return absent("no texture or vertex colour of reflectance");
    if (facts.num_flat == facts.num) return off(flat(facts), static_cast<double>(facts.num));
    if (!is_on(Effect::kInterreflection) && !is_on(Effect::kTint) && !is_on(Effect::kDiffuseTransmission)) {
      return off("no reflected light is simulated", static_cast<double>(facts.num));
    }
    return on(varying(facts), static_cast<double>(facts.num - facts.num_flat));
  }

  Decision textured_emission() const {
    const VariationFacts& facts = survey_.varying_emission;
    if (facts.num == 0) return absent("no texture of emission");
    if (facts.num_flat == facts.num) return off(flat(facts), static_cast<double>(facts.num));
    if (!is_on(Effect::kEmitters)) return off("no emission is simulated", static_cast<double>(facts.num));
    return on(varying(facts), static_cast<double>(facts.num - facts.num_flat));
  }

  static std::string flat(const VariationFacts& facts) {
    return std::to_string(facts.num_flat) + " of " + counted(facts.num, "texture") + (facts.num == 1 ? " is" : " are") +
           " of one value";
  }
  static std::string varying(const VariationFacts& facts) {
    const std::uint64_t num = facts.num - facts.num_flat;
    return std::to_string(num) + " of " + counted(facts.num, "texture") + (num == 1 ? " varies" : " vary");
  }

  Decision two_sided() const {
    const double square_metres = survey_.area_double_sided_m2;
    if (square_metres <= 0) return absent("no material is double-sided");
    if (survey_.is_exposed) return off(exposed());
    if (survey_.is_convex) return off("convex: no back is seen", square_metres / survey_.area_m2);
    return on(area(square_metres) + " reflects on its back", square_metres / survey_.area_m2);
  }

  static Decision output(bool is_asked, const std::string& name) {
    return is_asked ? on(name + " is asked for") : absent(name + " is not asked for");
  }

  Decision unsupported(double square_metres, const std::string& what) const {
    if (square_metres <= 0) return absent("no material " + what);
    return {EffectState::kUnsupported, area(square_metres) + " " + what, square_metres / survey_.area_m2};
  }

  /// What overrides cannot have.
  Result<void> check_overrides() const {
    for (const auto& [effect, is_on] : overrides_) {
      const EffectPlan& plan = plans_[static_cast<std::size_t>(effect)];
      const std::string name = "effect '" + std::string(effect_name(effect)) + "'";
      if (is_on && effect >= Effect::kSpecular) {
        return invalid_argument(name + " cannot be forced on: it is not simulated");
      }
      if (is_on && plan.state == EffectState::kAbsent) {
        return invalid_argument(name + " cannot be forced on: " + plan.reason);
      }
      if (is_on && effect == Effect::kDiffuseTransmission && !this->is_on(Effect::kTwoSided)) {
        return invalid_argument(name + " cannot be forced on: 'two_sided' is forced off");
      }
      if (!is_on && effect == Effect::kVertices && plan.is_forced && !asked_.lightmaps) {
        return invalid_argument(name + " cannot be forced off: nothing else is put out");
      }
    }
    if (has_light(effects_on({plans_.begin(), plans_.end()}))) return {};
    for (const Effect light : kLightEffects) {
      const EffectPlan& plan = plans_[static_cast<std::size_t>(light)];
      if (plan.is_forced) {
        return invalid_argument("effect '" + std::string(effect_name(light)) +
                                "' cannot be forced off: no light is left in the scene");
      }
    }
    return {};
  }

  const Survey& survey_;
  const AskedOutputs& asked_;
  const EffectOverrides& overrides_;
  bool is_sealed_ = false;
  std::array<EffectPlan, kNumEffects> plans_;
};

}  // namespace

Result<std::vector<EffectPlan>> plan_effects(const Survey& survey, const AskedOutputs& asked,
                                             const EffectOverrides& overrides) {
  return EffectPlanner(survey, asked, overrides).plan();
}

EffectSet effects_on(const std::vector<EffectPlan>& plan) {
  EffectSet set;
  for (const EffectPlan& effect : plan) set.set(effect.effect, effect.state == EffectState::kOn);
  return set;
}

bool has_light(const EffectSet& effects) {
  return std::any_of(kLightEffects.begin(), kLightEffects.end(), [&](Effect light) { return effects.has(light); });
}

}  // namespace radbake::radiosity
