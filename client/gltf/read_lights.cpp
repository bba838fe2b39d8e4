#include "client/gltf/read_lights.h"

#include <fstream>
#include <map>

#include "client/gltf/entry.h"
#include "client/gltf/external_file.h"
#include "client/gltf/read_ies.h"

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

Result<std::string> text_of_profile(const tinygltf::Model& model, const std::filesystem::path& folder,
                                    const tinygltf::Value& source) {
  if (source.Has("bufferView")) {
    const tinygltf::BufferView& view = model.bufferViews[source.Get("bufferView").GetNumberAsInt()];
    const auto first = model.buffers[view.buffer].data.begin() + static_cast<std::ptrdiff_t>(view.byteOffset);
    return std::string(first, first + static_cast<std::ptrdiff_t>(view.byteLength));
  }
  const std::string uri = source.Get("uri").Get<std::string>();
  if (uri.rfind("data:", 0) == 0) return invalid_argument("it is a data: URI, which is not read; use a bufferView");
  RADBAKE_ASSIGN_OR_RETURN(const std::filesystem::path path, resolve_uri(folder, uri));
  std::ifstream file(path, std::ios::binary);
  // One byte more than is allowed tells that there are too many.
  std::string text(kMaxIesBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (file.bad() || text.empty()) return invalid_argument("file " + in_quotes(uri) + " cannot be read or is empty");
  return text;
}

// A luminaire at its node.
Result<Light> read_luminaire(const tinygltf::Value& instance, LightProfile profile, const Transform& to_world) {
  ProfileLight light;
  light.position = to_world.translation;
  light.profile = std::move(profile);
  if (instance.Has("color")) {
    for (int c = 0; c < 3; ++c) light.tint[c] = instance.Get("color").Get(c).GetNumberAsDouble();
  }
  if (instance.Has("multiplier")) light.tint *= instance.Get("multiplier").GetNumberAsDouble();
  const Vec3 axis = to_world.apply_to_vector({0, 0, -1}), side = to_world.apply_to_vector({1, 0, 0});
  light.direction = axis / length(axis);
  // At right angles also where the node is skewed.
  const Vec3 across = side - light.direction * dot(side, light.direction);
  light.zero_side = across / length(across);
  if (!is_finite(light.position) || !is_finite(light.direction) || !is_finite(light.zero_side)) {
    return invalid_argument("the luminaire's position is not finite, or its direction is lost by its transform");
  }
  return Light{{}, std::move(light)};
}

bool is_dark(const tinygltf::Light& light) {
  if (light.intensity == 0) return true;
  return !light.color.empty() && light.color[0] == 0 && light.color[1] == 0 && light.color[2] == 0;
}

}  // namespace

Result<std::vector<Light>> read_lights(const tinygltf::Model& model, const std::filesystem::path& folder,
                                       std::span<const PlacedNode> nodes) {
  std::vector<Light> lights;
  std::map<int, LightProfile> profiles;
  for (const PlacedNode& placed : nodes) {
    const tinygltf::Node& node = model.nodes[placed.node];
    if (const auto luminaire = node.extensions.find("EXT_lights_ies"); luminaire != node.extensions.end()) {
      const int index = luminaire->second.Get("light").GetNumberAsInt();
      const tinygltf::Value& source = model.extensions.at("EXT_lights_ies").Get("lights").Get(index);
      const std::string given = source.Has("name") ? source.Get("name").Get<std::string>() : "";
      if (!profiles.contains(index)) {
        const std::string name = numbered("light profile", static_cast<std::size_t>(index), given);
        const Result<std::string> text = text_of_profile(model, folder, source);
        if (!text.ok()) return invalid_argument(name + ": " + text.error().message);
        Result<LightProfile> profile = read_ies(*text);
        if (!profile.ok()) return invalid_argument(name + ": " + profile.error().message);
        profiles.emplace(index, std::move(profile).value());
      }
      Result<Light> light = read_luminaire(luminaire->second, profiles.at(index), placed.to_world);
      if (!light.ok()) return invalid_argument(node_name(model, placed.node) + ": " + light.error().message);
      light->name = printable(!node.name.empty() ? node.name
                              : !given.empty()   ? given
                                                 : "light" + std::to_string(lights.size()));
      lights.push_back(std::move(light).value());
    }
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
