#include "client/options/scene_light.h"

#include <algorithm>

namespace radbake::options {
namespace {

bool emits(const Material& material, const Scene& scene) {
  if (max_component(material.emissive) <= 0) return false;
  if (!material.emissive_texture) return true;
  // A black texture switches a factor off; opacity, the fourth channel, is no light.
  const TexturePlane& plane = scene.textures[material.emissive_texture->texture];
  for (std::size_t i = 0; i < plane.values.size(); ++i) {
    const int channel = static_cast<int>(i % plane.channels);
    if (channel < 3 && plane.values[i] > 0 && material.emissive[channel] > 0) return true;
  }
  return false;
}

Vec3 strength(const Light& light) {
  return std::visit(
      [](const auto& kind) {
        if constexpr (requires { kind.illuminance; }) {
          return kind.illuminance;
        } else if constexpr (requires { kind.profile; }) {
          return kind.tint * kind.profile->lumens();
        } else {
          return kind.intensity;
        }
      },
      light.kind);
}

}  // namespace

Result<void> add_sky_and_sun(const BakeChoices& choices, const EnvironmentReader& read_environment, Scene& scene) {
  if (choices.sky) scene.sky = *choices.sky;
  if (choices.sun) scene.lights.push_back({"sun", *choices.sun});
  if (choices.sky_image) {
    RADBAKE_ASSIGN_OR_RETURN(scene.environment, read_environment(choices.sky_image->file, choices.sky_image->scale));
  }
  return {};
}

bool has_light(const Scene& scene) {
  if (max_component(scene.sky) > 0) return true;
  if (scene.environment && std::any_of(scene.environment->values.begin(), scene.environment->values.end(),
                                       [](float luminance) { return luminance > 0; })) {
    return true;
  }
  const auto shines = [](const Light& light) { return max_component(strength(light)) > 0; };
  if (std::any_of(scene.lights.begin(), scene.lights.end(), shines)) return true;
  return std::any_of(scene.meshes.begin(), scene.meshes.end(), [&](const Mesh& mesh) {
    return !mesh.triangles.empty() && emits(scene.materials[mesh.material], scene);
  });
}

Result<void> require_light(const Scene& scene, const std::string& scene_name) {
  if (has_light(scene)) return {};
  return invalid_argument(
      scene_name +
      ": no light at all: no material in use emits, and there is no lamp, no sky and no sun. Add one: a sky with --sky "
      "1000,1000,1000 or --hdri dawn.hdr, a sun with --sun 0.3,-1,0.2:50000,48000,45000, or in the scene an emissive "
      "factor or a lamp "
      "(KHR_lights_punctual)");
}

}  // namespace radbake::options
