#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene.h"
#include "server/radiosity/survey/surfaces.h"

namespace radbake::radiosity {

/// Facts of the lights of one kind.
struct LightFacts {
  std::uint64_t num = 0;
  std::uint64_t num_lit = 0;     ///< of those, with an intensity above zero
  std::uint64_t num_facing = 0;  ///< of those, before some surface: the light can arrive
  /// Of num_lit, lamps not inside the convex enclosure, or directions in which a ray from inside may meet a surface.
  std::uint64_t num_outside = 0;
  std::uint64_t num_beyond = 0;  ///< of num_lit, those that can only shine in from outside; parallel light always
};

/// Facts of what varies a property over a surface, of the materials in use.
struct VariationFacts {
  std::uint64_t num = 0;       ///< textures; of reflectance also meshes with vertex colours
  std::uint64_t num_flat = 0;  ///< of those, of one value in fact (vertex colours: on each triangle)
};

/// Facts of a scene, counted before a ray is traced. Up to brightest_emitters field for field radbake.v1.Survey.
struct Survey {
  std::uint64_t num_meshes = 0;
  std::uint64_t num_vertices = 0;
  std::uint64_t num_triangles = 0;          ///< that are baked
  std::uint64_t num_triangles_dropped = 0;  ///< of zero area
  std::uint64_t num_materials = 0;
  std::uint64_t num_textures = 0;
  std::uint64_t num_lights = 0;
  std::uint64_t num_emitter_triangles = 0;  ///< lit by sampling (small and bright)
  std::uint64_t num_glowing_triangles = 0;  ///< emit, but stay in the rows
  double area_m2 = 0;                       ///< one side of every triangle
  double emitted_lumens = 0;                ///< by surfaces, mean of the three channels
  double max_reflectance = 0;
  double extent_m = 0;   ///< longest side of the bounding box
  bool has_sky = false;  ///< of one luminance
  double min_reflectance = 0;
  std::uint64_t num_instances = 0;  ///< of meshes that the file places more than once
  bool is_grey = false;             ///< reflectance, emission and lights have equal channels everywhere
  bool is_convex = false;   ///< every vertex lies on or before every triangle's plane: nothing can hide anything;
                            ///< false where light reaches fronts through backs
  bool is_closed = false;   ///< convex, and every edge is shared: nothing escapes
  double escape_share = 0;  ///< of probe rays from all fronts
  double escape_share_interval = 0;  ///< half of its 95 % interval
  std::uint64_t num_probe_rays = 0;
  double area_masked_m2 = 0;       ///< by materials that are masked or blended and not opaque in fact
  double area_tinted_m2 = 0;       ///< that light passes straight through
  double area_translucent_m2 = 0;  ///< that lets light through scattered
  double area_double_sided_m2 = 0;
  double area_specular_m2 = 0;  ///< not simulated, as the three that follow
  double area_refractive_m2 = 0;
  double area_normal_mapped_m2 = 0;
  double area_volume_m2 = 0;
  std::uint64_t num_textures_flat = 0;          ///< of one value in fact
  double lamp_lumens = 0;                       ///< of point and spot lights and luminaires
  std::vector<std::string> brightest_emitters;  ///< up to 3 meshes with most lumens
  // What decides about effects beside.
  LightFacts point = {}, spot = {}, ies = {}, directional = {}, sun = {};
  double sun_diameter_radians = 0;  ///< of the widest
  bool has_environment = false, is_environment_lit = false;
  VariationFacts varying_reflectance = {}, varying_emission = {};
  std::uint64_t num_emissive_materials = 0;  ///< in use, with an emissive factor above zero
  std::uint64_t num_emissive_dark = 0;       ///< of those, under a texture that is black in fact
  std::uint64_t num_alpha_materials = 0;     ///< in use, masked or blended
  std::uint64_t num_alpha_opaque = 0;        ///< of those, opaque in fact
  bool is_exposed = false;  ///< every vertex lies on or behind every triangle's plane: no front sees any surface
};

/// A scene that passed every check, as one list of triangles, with its facts.
struct SurveyedScene {
  Surfaces surfaces;  ///< refers to the scene: keep it alive
  Survey survey;
  std::vector<Warning> warnings;
};

/// Surfaces brighter than this many times the scene's area mean of E light by sampling; dimmer ones stay in the rows.
inline constexpr double kEmitterThreshold = 4;

/// Checks a scene and gathers its facts. Traces no ray.
///
/// Errors: kInvalidArgument, naming mesh, triangle, vertex, material or light and the value: index out of range,
/// non-finite position, normal or texture coordinate, reflectance outside [0, 1), negative or non-finite emission,
/// texture of impossible size, an environment that is not twice as wide as high, no triangle with area, no light.
Result<SurveyedScene> survey_scene(const Scene& scene);

}  // namespace radbake::radiosity
