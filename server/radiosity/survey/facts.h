#pragma once

#include <vector>

#include "server/radiosity/survey/survey.h"

namespace radbake::radiosity {

/// The planes that a scene's triangles lie in, each once, as far as they had to be looked at.
struct ScenePlanes {
  /// In front where dot(normal, x) >= offset.
  struct Plane {
    Vec3 normal;
    double offset = 0;
  };
  std::vector<Plane> planes;  ///< all of them where is_convex or is_exposed
  bool is_convex = false;     ///< every vertex lies on or before every plane
  bool is_exposed = false;    ///< every vertex lies on or behind every plane
};

/// How far a vertex may lie on the wrong side of a plane, in scene units: a quarter of what rays are lifted off
/// surfaces by, so that no ray meets such a bump.
inline constexpr double kPlaneTolerance = 0x1p-22;

/// Finds out whether a scene is convex, seen from inside or from outside.
///
/// In a convex scene no segment between points before all planes is blocked; on an exposed one no front sees anything.
/// Cost: planes x vertices, up to a bound beyond which a scene is neither; one pass over the triangles, sorted by area,
/// where the first planes tell.
ScenePlanes find_scene_planes(const Surfaces& surfaces);

inline bool is_grey(Vec3 color) { return color.x == color.y && color.y == color.z; }

/// Lumens of a spot, mean of the channels: 2 pi int falloff dcos is 1 within the inner cone, and outside, where it is a
/// square of a linear ramp in the cosine, a third.
double spot_lumens(const SpotLight& spot);

/// Whether every edge is shared by two triangles, by position.
bool is_watertight(const Surfaces& surfaces);

/// Whether a material stops all light though it is masked or blended, bilinear values between texels included.
/// Shapes: least_opacity of its reflectance texture, 1 without one.
inline bool is_opaque_in_fact(const Material& material, double least_opacity) {
  const double least = material.alpha * least_opacity;
  return material.alpha_mode == AlphaMode::kMask ? least >= material.alpha_cutoff : least >= 1;
}

/// Whether light goes through a material scattered: its texture may be black.
/// Shapes: brightest value of its texture of diffuse transmittance, 1 without one.
inline bool is_translucent_in_fact(const Material& material, Vec3 brightest) {
  return max_component(scaled_by(material.diffuse_transmittance, brightest)) > 0;
}

/// Fills in what materials, textures and vertex colours tell. Everything is simulated in `surfaces`.
void find_material_facts(const Surfaces& surfaces, Survey& survey);

/// Fills in what lights, sky and emitters tell. Adds to Survey::is_grey: after the materials.
void find_light_facts(const Surfaces& surfaces, const ScenePlanes& planes, Survey& survey);

}  // namespace radbake::radiosity
