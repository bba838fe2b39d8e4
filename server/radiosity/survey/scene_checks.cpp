#include "server/radiosity/survey/scene_checks.h"

#include <numbers>
#include <sstream>

#include "server/radiosity/survey/texture.h"

namespace radbake::radiosity {
namespace {

/// "mesh 'floor'", or its number where it has no name.
template <typename T>
std::string named(const char* kind, const std::vector<T>& all, std::size_t index) {
  const std::string& name = all[index].name;
  return std::string(kind) + " " + (name.empty() ? std::to_string(index) : "'" + name + "'");
}

std::string in_words(Vec3 v) {
  std::ostringstream out;
  out << "(" << v.x << ", " << v.y << ", " << v.z << ")";
  return out.str();
}

Result<void> check_mesh(const Scene& scene, std::size_t m) {
  const Mesh& mesh = scene.meshes[m];
  const std::string name = named("mesh", scene.meshes, m);
  if (mesh.material < 0 || static_cast<std::size_t>(mesh.material) >= scene.materials.size()) {
    return invalid_argument(name + ": material " + std::to_string(mesh.material) + " does not exist; there are " +
                            std::to_string(scene.materials.size()));
  }
  const std::size_t n = mesh.positions.size();
  const auto has_wrong_length = [n](std::size_t length) { return length != 0 && length != n; };
  if (has_wrong_length(mesh.normals.size()) || has_wrong_length(mesh.texcoord0.size()) ||
      has_wrong_length(mesh.texcoord1.size()) || has_wrong_length(mesh.colors.size())) {
    return invalid_argument(name + ": attributes differ in length from its " + std::to_string(n) + " positions");
  }
  // Vertices that no triangle uses may hold anything.
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t vertex : mesh.triangles[t]) {
      const auto where = [&] {
        return name + ", triangle " + std::to_string(t) + ", vertex " + std::to_string(vertex);
      };
      if (vertex >= n) return invalid_argument(where() + ": index out of range; the mesh has " + std::to_string(n));
      if (!is_finite(mesh.positions[vertex])) {
        return invalid_argument(where() + ": position " + in_words(mesh.positions[vertex]) + " is not finite");
      }
      if (!mesh.normals.empty() && !is_finite(mesh.normals[vertex])) {
        return invalid_argument(where() + ": normal " + in_words(mesh.normals[vertex]) + " is not finite");
      }
      if ((!mesh.texcoord0.empty() && !is_finite(mesh.texcoord0[vertex])) ||
          (!mesh.texcoord1.empty() && !is_finite(mesh.texcoord1[vertex]))) {
        return invalid_argument(where() + ": a texture coordinate is not finite");
      }
      if (!mesh.colors.empty() && !(is_finite(mesh.colors[vertex]) && min_component(mesh.colors[vertex]) >= 0 &&
                                    max_component(mesh.colors[vertex]) <= 1)) {
        return invalid_argument(where() + ": colour " + in_words(mesh.colors[vertex]) + " is not within [0, 1]");
      }
    }
  }
  // A textured material needs the coordinates that it names.
  const Material& material = scene.materials[mesh.material];
  for (const auto& reference : material.textures()) {
    if (reference && (reference->texcoord == 0 ? mesh.texcoord0 : mesh.texcoord1).empty() && !mesh.triangles.empty()) {
      return invalid_argument(name + ": its material uses a texture by TEXCOORD_" +
                              std::to_string(reference->texcoord) + ", which the mesh does not have");
    }
  }
  return {};
}

Result<void> check_material(const Scene& scene, std::size_t i) {
  const Material& material = scene.materials[i];
  const std::string name = named("material", scene.materials, i);
  if (!is_finite(material.reflectance) || min_component(material.reflectance) < 0 ||
      max_component(material.reflectance) >= 1) {
    return invalid_argument(name + ": reflectance " + in_words(material.reflectance) + " is not within [0, 1)");
  }
  if (!is_finite(material.emissive) || min_component(material.emissive) < 0) {
    return invalid_argument(name + ": emissive luminance " + in_words(material.emissive) +
                            " nit is not within [0, inf)");
  }
  // What was rounded on its way here may add up to a little more than one.
  constexpr double kRounding = 1e-6;
  const Vec3 passed_on = material.reflectance + material.transmittance;
  if (!is_finite(material.transmittance) || min_component(material.transmittance) < 0 ||
      max_component(material.transmittance) > 1) {
    return invalid_argument(name + ": transmittance " + in_words(material.transmittance) + " is not within [0, 1]");
  }
  if (max_component(passed_on) > 1 + kRounding) {
    return invalid_argument(name + ": reflectance + transmittance reaches " + in_words(passed_on) + ", above 1");
  }
  const Vec3 sent_on = material.reflectance + material.diffuse_transmittance;
  if (!is_finite(material.diffuse_transmittance) || min_component(material.diffuse_transmittance) < 0 ||
      max_component(sent_on) >= 1) {
    return invalid_argument(name + ": reflectance " + in_words(material.reflectance) + " and diffuse transmittance " +
                            in_words(material.diffuse_transmittance) + " are not at least 0 and below 1 together");
  }
  if (max_component(material.diffuse_transmittance) > 0 && !material.is_double_sided) {
    return invalid_argument(name + ": light goes through it scattered, but it is single-sided");
  }
  for (const auto& reference : material.textures()) {
    if (!reference) continue;
    if (reference->texture < 0 || static_cast<std::size_t>(reference->texture) >= scene.textures.size()) {
      return invalid_argument(name + ": texture " + std::to_string(reference->texture) + " does not exist; there are " +
                              std::to_string(scene.textures.size()));
    }
    if (reference->texcoord != 0 && reference->texcoord != 1) {
      return invalid_argument(name + ": TEXCOORD_" + std::to_string(reference->texcoord) +
                              " is not supported (0 or 1)");
    }
    if (!reference->transform.is_within_float()) {
      const UvTransform& transform = reference->transform;
      return invalid_argument(name + ": the transform of its texture coordinates, " +
                              in_words({transform.x_axis.x, transform.y_axis.x, transform.offset.x}) + " and " +
                              in_words({transform.x_axis.y, transform.y_axis.y, transform.offset.y}) +
                              ", is not finite in single precision");
    }
  }
  // The product of factor and texture must send on less than it gets, everywhere.
  const Vec3 base = brightest(scene, material.reflectance_texture);
  const Vec3 in_all = scaled_by(passed_on, base) + scaled_by(material.diffuse_transmittance,
                                                             brightest(scene, material.diffuse_transmittance_texture));
  if (max_component(material.diffuse_transmittance) > 0 && max_component(in_all) >= 1) {
    return invalid_argument(name +
                            ": reflectance, transmittance and diffuse transmittance, with their textures, reach " +
                            in_words(in_all) + ", not below 1");
  }
  if (material.reflectance_texture) {
    const Vec3 product = scaled_by(material.reflectance, base);
    if (max_component(product) >= 1) {
      return invalid_argument(name + ": reflectance times texture reaches " + in_words(product) + ", not below 1");
    }
    const Vec3 both = scaled_by(passed_on, base);
    if (max_component(both) > 1 + kRounding) {
      return invalid_argument(name + ": reflectance + transmittance times texture reaches " + in_words(both) +
                              ", above 1");
    }
  }
  return {};
}

Result<void> check_texture(const Scene& scene, std::size_t i) {
  const TexturePlane& texture = scene.textures[i];
  const std::string name = named("texture", scene.textures, i);
  const bool is_possible = texture.width > 0 && texture.height > 0 &&
                           (texture.channels == 3 || texture.channels == 4) &&
                           texture.values.size() == static_cast<std::size_t>(texture.width) * texture.height *
                                                        static_cast<std::size_t>(texture.channels);
  if (!is_possible) {
    return invalid_argument(name + ": " + std::to_string(texture.values.size()) + " values for " +
                            std::to_string(texture.width) + " x " + std::to_string(texture.height) + " x " +
                            std::to_string(texture.channels));
  }
  for (std::size_t at = 0; at < texture.values.size(); ++at) {
    if (!std::isfinite(texture.values[at]) || texture.values[at] < 0) {
      return invalid_argument(name + ": value " + std::to_string(texture.values[at]) + " at " + std::to_string(at) +
                              " is not within [0, inf)");
    }
  }
  return {};
}

bool is_direction(Vec3 d) {
  constexpr double kUnitTolerance = 1e-6;  // of directions that were normalised in single precision
  return is_finite(d) && std::fabs(length(d) - 1) < kUnitTolerance;
}

bool is_amount(Vec3 v) { return is_finite(v) && min_component(v) >= 0; }

Result<void> check_light(const Scene& scene, std::size_t i) {
  const std::string name = named("light", scene.lights, i);
  const auto& kind = scene.lights[i].kind;
  if (const auto* point = std::get_if<PointLight>(&kind)) {
    if (!is_finite(point->position)) return invalid_argument(name + ": position is not finite");
    if (!is_amount(point->intensity))
      return invalid_argument(name + ": intensity " + in_words(point->intensity) + " cd");
  } else if (const auto* spot = std::get_if<SpotLight>(&kind)) {
    if (!is_finite(spot->position)) return invalid_argument(name + ": position is not finite");
    if (!is_direction(spot->direction)) return invalid_argument(name + ": direction is not of unit length");
    if (!is_amount(spot->intensity)) return invalid_argument(name + ": intensity " + in_words(spot->intensity) + " cd");
    if (!(0 <= spot->inner_cone_radians && spot->inner_cone_radians <= spot->outer_cone_radians &&
          spot->outer_cone_radians <= std::numbers::pi / 2)) {
      return invalid_argument(name + ": cone angles must be 0 <= inner <= outer <= pi/2, not " +
                              std::to_string(spot->inner_cone_radians) + " and " +
                              std::to_string(spot->outer_cone_radians));
    }
  } else if (const auto* luminaire = std::get_if<ProfileLight>(&kind)) {
    if (!is_finite(luminaire->position)) return invalid_argument(name + ": position is not finite");
    if (!is_direction(luminaire->direction) || !is_direction(luminaire->zero_side)) {
      return invalid_argument(name + ": direction or zero side is not of unit length");
    }
    if (!is_amount(luminaire->tint)) return invalid_argument(name + ": tint " + in_words(luminaire->tint));
    if (luminaire->profile == nullptr) return invalid_argument(name + ": it has no profile");
    const Result<void> profile = check_profile(*luminaire->profile);
    if (!profile.ok()) return invalid_argument(name + ": " + profile.error().message);
  } else if (const auto* sun = std::get_if<DirectionalLight>(&kind)) {
    if (!is_direction(sun->direction)) return invalid_argument(name + ": direction is not of unit length");
    if (!is_amount(sun->illuminance))
      return invalid_argument(name + ": illuminance " + in_words(sun->illuminance) + " lx");
    const double diameter = sun->angular_diameter_radians;
    if (!(diameter >= 0 && diameter < std::numbers::pi)) {
      return invalid_argument(name + ": angular diameter " + std::to_string(diameter) + " is not within [0, pi)");
    }
  }
  return {};
}

Result<void> check_environment(const Scene& scene) {
  const TexturePlane& sky = *scene.environment;
  const std::string name = "environment '" + sky.name + "'";
  if (!(scene.sky == Vec3{})) {
    return invalid_argument(name + " and a constant sky of " + in_words(scene.sky) + " nit exclude each other");
  }
  const std::string size = std::to_string(sky.width) + " x " + std::to_string(sky.height);
  if (sky.height < 1 || sky.width != 2 * sky.height) {
    return invalid_argument(name + ": " + size + " pixels are not twice as wide as high");
  }
  if (sky.channels != 3 || sky.values.size() != static_cast<std::size_t>(sky.width) * sky.height * 3) {
    return invalid_argument(name + ": " + std::to_string(sky.values.size()) + " values for " + size + " x 3");
  }
  for (std::size_t at = 0; at < sky.values.size(); ++at) {
    if (std::isfinite(sky.values[at]) && sky.values[at] >= 0) continue;
    const std::size_t pixel = at / 3, width = static_cast<std::size_t>(sky.width);
    return invalid_argument(name + ": luminance " + std::to_string(sky.values[at]) + " nit at column " +
                            std::to_string(pixel % width) + ", row " + std::to_string(pixel / width) +
                            " is not within [0, inf)");
  }
  return {};
}

}  // namespace

Result<void> check_scene_values(const Scene& scene) {
  for (std::size_t i = 0; i < scene.textures.size(); ++i) RADBAKE_RETURN_IF_ERROR(check_texture(scene, i));
  for (std::size_t i = 0; i < scene.materials.size(); ++i) RADBAKE_RETURN_IF_ERROR(check_material(scene, i));
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) RADBAKE_RETURN_IF_ERROR(check_mesh(scene, i));
  for (std::size_t i = 0; i < scene.lights.size(); ++i) RADBAKE_RETURN_IF_ERROR(check_light(scene, i));
  if (!is_amount(scene.sky)) return invalid_argument("sky: luminance " + in_words(scene.sky) + " nit");
  if (scene.environment) RADBAKE_RETURN_IF_ERROR(check_environment(scene));
  return {};
}

}  // namespace radbake::radiosity
