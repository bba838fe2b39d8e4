#include "client/gltf/read_lights.h"

#include <algorithm>
#include <map>
#include <memory>

#include "client/gltf/container.h"
#include "client/gltf/entry.h"
#include "client/gltf/external_file.h"
#include "client/gltf/limits.h"
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

Result<void> check_ies_size(std::size_t num_bytes) {
  if (num_bytes <= kMaxIesBytes) return {};
  return invalid_argument("it has " + std::to_string(num_bytes) + " bytes, above the limit of " +
                          std::to_string(kMaxIesBytes));
}

Result<std::string> text_of_profile(const tinygltf::Model& model, const std::filesystem::path& folder,
                                    const tinygltf::Value& source) {
  if (source.Has("bufferView")) {
    const tinygltf::BufferView& view = model.bufferViews[source.Get("bufferView").GetNumberAsInt()];
    RADBAKE_RETURN_IF_ERROR(check_ies_size(view.byteLength));
    const auto first = model.buffers[view.buffer].data.begin() + static_cast<std::ptrdiff_t>(view.byteOffset);
    return std::string(first, first + static_cast<std::ptrdiff_t>(view.byteLength));
  }
  return read_ies_uri(folder, source.Get("uri").Get<std::string>());
}

Result<std::string> decoded_ies(const std::string& uri) {
  constexpr std::string_view kBase64 = ";base64,";
  const std::size_t marker = uri.substr(0, 200).find(kBase64);
  if (marker == std::string::npos) return invalid_argument("its data URI is not in base64");
  const std::size_t begin = marker + kBase64.size(), end = std::max(begin, uri.find_last_not_of('=') + 1);
  RADBAKE_RETURN_IF_ERROR(check_ies_size((end - begin) * 3 / 4));
  // tinygltf knows few media types.
  std::vector<unsigned char> bytes;
  std::string media_type;
  if (!tinygltf::DecodeDataURI(&bytes, media_type, "data:application/octet-stream;base64," + uri.substr(begin), 0,
                               false)) {
    return invalid_argument("its data URI holds nothing");
  }
  return std::string(bytes.begin(), bytes.end());
}

// What multiplies a luminaire's intensities.
Vec3 tint_of(const tinygltf::Value& instance) {
  Vec3 tint{1, 1, 1};
  if (instance.Has("color")) {
    // The extension clamps it.
    for (int c = 0; c < 3; ++c) tint[c] = std::clamp(instance.Get("color").Get(c).GetNumberAsDouble(), 0.0, 1.0);
  }
  if (instance.Has("multiplier")) tint *= instance.Get("multiplier").GetNumberAsDouble();
  return tint;
}

bool is_dark(const LightProfile& profile) {
  return std::all_of(profile.candela.begin(), profile.candela.end(), [](float candela) { return candela == 0; });
}

// A luminaire at its node.
Result<Light> read_luminaire(Vec3 tint, std::shared_ptr<const LightProfile> profile, const Transform& to_world) {
  ProfileLight light;
  light.position = to_world.translation;
  light.tint = tint;
  light.profile = std::move(profile);
  light.is_mirrored = to_world.determinant() < 0;
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

// The profiles of the file, each read once.
class Profiles {
 public:
  Profiles(const tinygltf::Model& model, const std::filesystem::path& folder) : model_(model), folder_(folder) {}

  Result<std::shared_ptr<const LightProfile>> get(int index) {
    if (const auto known = read_.find(index); known != read_.end()) return known->second;
    const tinygltf::Value& source = source_of(index);
    const std::string name = numbered("light profile", static_cast<std::size_t>(index), given_name(index));
    const Result<std::string> text = text_of_profile(model_, folder_, source);
    if (!text.ok()) return invalid_argument(name + ": " + text.error().message);
    // Many may name one long view.
    num_bytes_ += text->size();
    if (num_bytes_ > kMaxSceneIesBytes) {
      return invalid_argument(name + ": up to it the light profiles have " + std::to_string(num_bytes_) +
                              " bytes, above the limit of " + std::to_string(kMaxSceneIesBytes));
    }
    Result<LightProfile> profile = read_ies(*text);
    if (!profile.ok()) return invalid_argument(name + ": " + profile.error().message);
    return read_.emplace(index, std::make_shared<const LightProfile>(std::move(profile).value())).first->second;
  }
  std::string given_name(int index) const {
    return source_of(index).Has("name") ? source_of(index).Get("name").Get<std::string>() : "";
  }

 private:
  const tinygltf::Value& source_of(int index) const {
    return model_.extensions.at("EXT_lights_ies").Get("lights").Get(index);
  }

  const tinygltf::Model& model_;
  const std::filesystem::path& folder_;
  std::map<int, std::shared_ptr<const LightProfile>> read_;
  std::uint64_t num_bytes_ = 0;
};

}  // namespace

Result<std::string> read_ies_uri(const std::filesystem::path& folder, const std::string& uri) {
  if (uri.starts_with("data:")) return decoded_ies(uri);
  RADBAKE_ASSIGN_OR_RETURN(const std::filesystem::path path, resolve_uri(folder, uri));
  Result<std::string> text = read_file(path, kMaxIesBytes);
  if (!text.ok()) return invalid_argument("file " + in_quotes(uri) + ": " + text.error().message);
  return text;
}

Result<std::vector<Light>> read_lights(const tinygltf::Model& model, const std::filesystem::path& folder,
                                       std::span<const PlacedNode> nodes) {
  std::vector<Light> lights;
  Profiles profiles(model, folder);
  // A light is called as its node, else as it was given in the file.
  const auto add = [&](Result<Light> light, int node_index, const std::string& given_name) -> Result<void> {
    if (!light.ok()) return invalid_argument(node_name(model, node_index) + ": " + light.error().message);
    const std::string& called = model.nodes[node_index].name;
    light->name = printable(!called.empty()       ? called
                            : !given_name.empty() ? given_name
                                                  : "light" + std::to_string(lights.size()));
    lights.push_back(std::move(light).value());
    return {};
  };
  for (const PlacedNode& placed : nodes) {
    const tinygltf::Node& node = model.nodes[placed.node];
    if (const auto luminaire = node.extensions.find("EXT_lights_ies"); luminaire != node.extensions.end()) {
      const int index = luminaire->second.Get("light").GetNumberAsInt();
      const Vec3 tint = tint_of(luminaire->second);
      std::shared_ptr<const LightProfile> profile;
      if (!(tint == Vec3{})) {
        RADBAKE_ASSIGN_OR_RETURN(profile, profiles.get(index));
      }
      if (profile != nullptr && !is_dark(*profile)) {
        RADBAKE_RETURN_IF_ERROR(
            add(read_luminaire(tint, profile, placed.to_world), placed.node, profiles.given_name(index)));
      }
    }
    const auto extension = node.extensions.find("KHR_lights_punctual");
    if (extension == node.extensions.end()) continue;
    const tinygltf::Light& source = model.lights[extension->second.Get("light").GetNumberAsInt()];
    if (is_dark(source)) continue;
    RADBAKE_RETURN_IF_ERROR(add(read_light(source, placed.to_world), placed.node, source.name));
  }
  return lights;
}

}  // namespace radbake::gltf
