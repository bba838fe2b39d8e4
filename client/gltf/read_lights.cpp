#include "client/gltf/read_lights.h"

#include "client/gltf/entry.h"

namespace radbake::gltf {
namespace {

Result<Light> read_light(const tinygltf::Light& source, const Transform& to_world) {
  Vec3 intensity{1, 1, 1};
  for (int i = 0; i < 3 && !source.color.empty(); ++i) intensity[i] = source.color[i];
  intensity *= source.intensity;
  const Vec3 position = to_world.translation;
  if (!is_finite(position)) return invalid_argument("the light's position is not finite");
  if (source.type == "point") return Light{{}, PointLight{position, intensity}};
  // The image of -Z. A transform that flattens Z leaves no direction.
  const Vec3 axis = to_world.apply_to_vector({0, 0, -1});
  if (!(length(axis) > 0) || !is_finite(axis / length(axis))) {
    return invalid_argument("the light's direction is lost: the transform is singular");
  }
  const Vec3 direction = normalized(axis);
  if (source.type == "directional") return Light{{}, DirectionalLight{direction, intensity}};
  if (!(source.spot.innerConeAngle < source.spot.outerConeAngle)) {
    return invalid_argument("innerConeAngle " + std::to_string(source.spot.innerConeAngle) +
                            " is not below outerConeAngle " + std::to_string(source.spot.outerConeAngle));
  }
  return Light{{}, SpotLight{position, direction, intensity, source.spot.innerConeAngle, source.spot.outerConeAngle}};
}

bool is_dark(const tinygltf::Light& light) {
  if (light.intensity == 0) return true;
  return !light.color.empty() && light.color[0] == 0 && light.color[1] == 0 && light.color[2] == 0;
}

}  // namespace

Result<std::vector<Light>> read_lights(const tinygltf::Model& model, std::span<const PlacedNode> nodes) {
  std::vector<Light> lights;
  for (const PlacedNode& placed : nodes) {
    const tinygltf::Node& node = model.nodes[placed.node];
    const auto extension = node.extensions.find("KHR_lights_punctual");
    if (extension == node.extensions.end()) continue;
    const tinygltf::Light& source = model.lights[extension->second.Get("light").GetNumberAsInt()];
    if (is_dark(source)) continue;
    Result<Light> light = read_light(source, placed.to_world);
    if (!light.ok()) return invalid_argument(node_name(model, placed.node) + ": " + light.error().message);
    light->name = printable(!node.name.empty()     ? node.name
                            : !source.name.empty() ? source.name
                                                   : "light" + std::to_string(lights.size()));
    lights.push_back(std::move(light).value());
  }
  return lights;
}

}  // namespace radbake::gltf
