#include "server/radiosity/survey/survey.h"

#include <algorithm>
#include <cmath>

#include "server/radiosity/survey/facts.h"
#include "server/radiosity/survey/scene_checks.h"

namespace radbake::radiosity {
namespace {

struct Bounds {
  Vec3 low, high;
  bool is_empty = true;

  void add(Vec3 p) {
    if (is_empty) low = high = p;
    is_empty = false;
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
};

/// Recentres, scales by a power of two, and lists the triangles that have an area.
void list_triangles(const Scene& scene, SurveyedScene& out) {
  Surfaces& surfaces = out.surfaces;
  surfaces.scene = &scene;
  Bounds bounds;
  for (const Mesh& mesh : scene.meshes) {
    for (const auto& triangle : mesh.triangles) {
      for (const std::uint32_t vertex : triangle) bounds.add(mesh.positions[vertex]);
    }
  }
  if (bounds.is_empty) return;
  surfaces.centre = (bounds.low + bounds.high) * 0.5;
  const double extent = max_component(bounds.high - bounds.low);
  if (!(extent > 0)) return;
  surfaces.metres_per_unit = std::exp2(std::floor(std::log2(extent)));
  out.survey.extent_m = extent;

  const double units_per_metre = 1 / surfaces.metres_per_unit;
  for (std::uint32_t m = 0; m < scene.meshes.size(); ++m) {
    const Mesh& mesh = scene.meshes[m];
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      std::array<Vec3, 3> corners;
      double farthest = 0;
      for (int k = 0; k < 3; ++k) {
        corners[k] = (mesh.positions[mesh.triangles[t][k]] - surfaces.centre) * units_per_metre;
        for (int axis = 0; axis < 3; ++axis) farthest = std::max(farthest, std::fabs(corners[k][axis]));
      }
      const Vec3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
      const double twice_area = length(normal);
      if (!(twice_area > 0)) {
        ++out.survey.num_triangles_dropped;
        continue;
      }
      surfaces.corners.push_back(corners);
      surfaces.normals.push_back(normal / twice_area);
      surfaces.areas.push_back(twice_area / 2);
      surfaces.meshes.push_back(m);
      surfaces.in_mesh.push_back(t);
      // Single precision moves a plane through points of size `farthest` by a few times 2^-24 of it.
      surfaces.ray_offsets.push_back(farthest * 0x1p-20);
    }
  }
}

/// Counts what emits, and how much.
void count_emitters(SurveyedScene& out) {
  const Surfaces& surfaces = out.surfaces;
  const double square_metres = surfaces.metres_per_unit * surfaces.metres_per_unit;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    const int sides = surfaces.material(t).is_double_sided ? 2 : 1;
    out.survey.area_m2 += surfaces.areas[t] * square_metres;
    out.survey.emitted_lumens += surfaces.areas[t] * sides * mean_component(surfaces.exitances[t]) * square_metres;
    if (max_component(surfaces.exitances[t]) <= 0) continue;
    ++(surfaces.is_emitter[t] ? out.survey.num_emitter_triangles : out.survey.num_glowing_triangles);
  }
}

}  // namespace

Result<SurveyedScene> survey_scene(const Scene& scene) {
  RADBAKE_RETURN_IF_ERROR(check_scene_values(scene));
  SurveyedScene out;
  Survey& survey = out.survey;
  survey.num_meshes = scene.meshes.size();
  survey.num_materials = scene.materials.size();
  survey.num_textures = scene.textures.size();
  survey.num_lights = scene.lights.size();
  survey.num_instances = scene.num_instances;
  survey.has_sky = max_component(scene.sky) > 0;
  for (const Mesh& mesh : scene.meshes) survey.num_vertices += mesh.positions.size();
  list_triangles(scene, out);
  survey.num_triangles = out.surfaces.size();
  if (survey.num_triangles == 0) return invalid_argument("the scene has no triangle with an area");
  if (survey.num_triangles_dropped > 0) {
    out.warnings.push_back({"triangles_dropped", std::to_string(survey.num_triangles_dropped) +
                                                     " triangles of zero area were dropped by the server"});
  }
  out.surfaces.simulate(EffectSet::all());
  count_emitters(out);
  find_material_facts(out.surfaces, survey);
  const ScenePlanes planes = find_scene_planes(out.surfaces);
  // Planes tell of fronts: what light enters by backs is another matter.
  const bool is_of_fronts = survey.area_translucent_m2 <= 0;
  survey.is_convex = is_of_fronts && planes.is_convex;
  survey.is_exposed = is_of_fronts && planes.is_exposed;
  survey.is_closed = survey.is_convex && is_watertight(out.surfaces);
  find_light_facts(out.surfaces, planes, survey);
  if (survey.emitted_lumens <= 0 && scene.lights.empty() && !survey.has_sky && !scene.environment) {
    return invalid_argument(
        "the scene has no light: give a material an emissiveFactor, add a lamp (KHR_lights_punctual), or pass --sky, "
        "--hdri or --sun");
  }
  return out;
}

}  // namespace radbake::radiosity
