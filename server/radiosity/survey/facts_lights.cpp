#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "server/radiosity/survey/facts.h"

namespace radbake::radiosity {
namespace {

/// Lamps nearer to a wall than this, in scene units, are not taken to be inside: rounding may put them behind it.
constexpr double kLampMargin = 0x1p-18;
/// Of the cosine between two unit vectors in double precision.
constexpr double kCosineRounding = 1e-12;
constexpr std::size_t kMostNames = 3;

/// What the place of a lamp or the direction of parallel light tells.
struct Place {
  bool is_facing = false, is_outside = true, is_beyond = true;
};

Place place_of_lamp(const Surfaces& surfaces, const ScenePlanes& planes, Vec3 world) {
  const Vec3 at = (world - surfaces.centre) / surfaces.metres_per_unit;
  Place place;
  for (std::uint32_t t = 0; t < surfaces.size() && !place.is_facing; ++t) {
    const double height = dot(surfaces.normals[t], at - surfaces.corners[t][0]);
    place.is_facing = surfaces.material(t).is_double_sided ? height != 0 : height > 0;
  }
  const auto is_behind = [&](double margin) {
    return std::any_of(planes.planes.begin(), planes.planes.end(),
                       [&](const ScenePlanes::Plane& plane) { return dot(plane.normal, at) < plane.offset + margin; });
  };
  place.is_outside = !planes.is_convex || is_behind(kLampMargin);
  place.is_beyond = planes.is_convex && is_behind(-kLampMargin);
  return place;
}

Place place_of_sun(const Surfaces& surfaces, const ScenePlanes& planes, const DirectionalLight& sun) {
  const Vec3 towards = -sun.direction;
  const double widening = std::sin(sun.angular_diameter_radians / 2);
  Place place;
  for (std::uint32_t t = 0; t < surfaces.size() && !place.is_facing; ++t) {
    const double cosine = dot(surfaces.normals[t], towards);
    place.is_facing = (surfaces.material(t).is_double_sided ? std::fabs(cosine) : cosine) > -widening;
  }
  place.is_outside = !planes.is_convex ||
                     std::any_of(planes.planes.begin(), planes.planes.end(), [&](const ScenePlanes::Plane& plane) {
                       return dot(plane.normal, towards) < widening - kCosineRounding;
                     });
  return place;
}

void add(Vec3 intensity, const Place& place, LightFacts& facts) {
  ++facts.num;
  if (max_component(intensity) <= 0) return;
  ++facts.num_lit;
  facts.num_facing += place.is_facing;
  facts.num_outside += place.is_outside;
  facts.num_beyond += place.is_beyond;
}

/// The meshes that emit most, with their lumens.
std::vector<std::string> brightest_meshes(const Surfaces& surfaces) {
  std::vector<double> lumens(surfaces.scene->meshes.size(), 0);
  const double square_metres = surfaces.metres_per_unit * surfaces.metres_per_unit;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    const int sides = surfaces.material(t).is_double_sided ? 2 : 1;
    lumens[surfaces.meshes[t]] += surfaces.areas[t] * sides * mean_component(surfaces.exitances[t]) * square_metres;
  }
  std::vector<std::size_t> order;
  for (std::size_t m = 0; m < lumens.size(); ++m) {
    if (lumens[m] > 0) order.push_back(m);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return lumens[a] > lumens[b]; });
  std::vector<std::string> names;
  for (std::size_t k = 0; k < std::min(order.size(), kMostNames); ++k) {
    std::ostringstream text;
    text.precision(3);
    text << surfaces.scene->meshes[order[k]].name << " (" << lumens[order[k]] << " lm)";
    names.push_back(text.str());
  }
  return names;
}

}  // namespace

double spot_lumens(const SpotLight& spot) {
  const double inner = std::cos(spot.inner_cone_radians), outer = std::cos(spot.outer_cone_radians);
  return 2 * std::numbers::pi * (1 - inner + (inner - outer) / 3) * mean_component(spot.intensity);
}

void find_light_facts(const Surfaces& surfaces, const ScenePlanes& planes, Survey& survey) {
  const Scene& scene = *surfaces.scene;
  for (const Light& light : scene.lights) {
    if (const auto* point = std::get_if<PointLight>(&light.kind)) {
      add(point->intensity, place_of_lamp(surfaces, planes, point->position), survey.point);
      survey.lamp_lumens += 4 * std::numbers::pi * mean_component(point->intensity);
      survey.is_grey &= is_grey(point->intensity);
    } else if (const auto* spot = std::get_if<SpotLight>(&light.kind)) {
      add(spot->intensity, place_of_lamp(surfaces, planes, spot->position), survey.spot);
      survey.lamp_lumens += spot_lumens(*spot);
      survey.is_grey &= is_grey(spot->intensity);
    } else if (const auto* luminaire = std::get_if<ProfileLight>(&light.kind)) {
      const double lumens = luminaire->profile->lumens();
      add(luminaire->tint * lumens, place_of_lamp(surfaces, planes, luminaire->position), survey.ies);
      survey.lamp_lumens += lumens * mean_component(luminaire->tint);
      survey.is_grey &= is_grey(luminaire->tint);
    } else if (const auto* sun = std::get_if<DirectionalLight>(&light.kind)) {
      const bool is_disc = sun->angular_diameter_radians > 0;
      add(sun->illuminance, place_of_sun(surfaces, planes, *sun), is_disc ? survey.sun : survey.directional);
      survey.sun_diameter_radians = std::max(survey.sun_diameter_radians, sun->angular_diameter_radians);
      survey.is_grey &= is_grey(sun->illuminance);
    }
  }
  survey.is_grey &= is_grey(scene.sky);
  if (scene.environment) {
    survey.has_environment = true;
    const std::vector<float>& values = scene.environment->values;
    for (std::size_t at = 0; at + 2 < values.size(); at += 3) {
      survey.is_environment_lit |= values[at] > 0 || values[at + 1] > 0 || values[at + 2] > 0;
      survey.is_grey &= values[at] == values[at + 1] && values[at + 1] == values[at + 2];
    }
  }
  survey.brightest_emitters = brightest_meshes(surfaces);
}

}  // namespace radbake::radiosity
