#include "server/radiosity/survey/survey.h"

#include <algorithm>
#include <cmath>

#include "common/base/sequence.h"
#include "server/radiosity/survey/scene_checks.h"

namespace radbake::radiosity {
namespace {

/// Points that a textured triangle's mean emission is taken over.
constexpr int kEmissionSamples = 64;

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

/// Mean exitance over a triangle: constant, or over a net of points where a texture varies it.
Vec3 mean_exitance(const Surfaces& surfaces, std::uint32_t triangle, const SobolPoints& points) {
  const Material& material = surfaces.material(triangle);
  if (max_component(material.emissive) <= 0) return {};
  if (!material.emissive_texture) return surfaces.exitance({triangle, 0, 0});
  Vec3 sum;
  for (int i = 0; i < kEmissionSamples; ++i) {
    const auto seeds = SobolPoints::seeds_of(triangle);
    double u = points.coordinate(i, 0, seeds), v = points.coordinate(i, 1, seeds);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    sum += surfaces.exitance({triangle, u, v});
  }
  return sum / kEmissionSamples;
}

/// Finds what glows, and which of it is small and bright against the scene's area mean.
void find_emitters(SurveyedScene& out) {
  Surfaces& surfaces = out.surfaces;
  const SobolPoints points(kEmissionSamples);
  double area = 0, flux = 0;
  surfaces.exitances.resize(surfaces.size());
  surfaces.is_emitter.assign(surfaces.size(), 0);
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    surfaces.exitances[t] = mean_exitance(surfaces, t, points);
    const int sides = surfaces.material(t).is_double_sided ? 2 : 1;
    area += surfaces.areas[t] * sides;
    flux += surfaces.areas[t] * sides * mean_component(surfaces.exitances[t]);
  }
  const double threshold = kEmitterThreshold * flux / area;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    const double exitance = mean_component(surfaces.exitances[t]);
    if (exitance <= 0) continue;
    surfaces.is_emitter[t] = exitance > threshold;
    ++(surfaces.is_emitter[t] ? out.survey.num_emitter_triangles : out.survey.num_glowing_triangles);
  }
  const double square_metres = surfaces.metres_per_unit * surfaces.metres_per_unit;
  out.survey.emitted_lumens = flux * square_metres;
  out.survey.area_m2 = 0;
  for (const double a : surfaces.areas) out.survey.area_m2 += a * square_metres;
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
  survey.has_sky = max_component(scene.sky) > 0;
  for (const Mesh& mesh : scene.meshes) {
    survey.num_vertices += mesh.positions.size();
    survey.max_reflectance =
        std::max(survey.max_reflectance, max_component(scene.materials[mesh.material].reflectance));
  }
  list_triangles(scene, out);
  survey.num_triangles = out.surfaces.size();
  if (survey.num_triangles == 0) return invalid_argument("the scene has no triangle with an area");
  if (survey.num_triangles_dropped > 0) {
    out.warnings.push_back({"triangles_dropped", std::to_string(survey.num_triangles_dropped) +
                                                     " triangles of zero area were dropped by the server"});
  }
  find_emitters(out);
  if (survey.emitted_lumens <= 0 && scene.lights.empty() && !survey.has_sky) {
    return invalid_argument(
        "the scene has no light: give a material an emissiveFactor, add a lamp (KHR_lights_punctual), or pass --sky or "
        "--sun");
  }
  return out;
}

}  // namespace radbake::radiosity
