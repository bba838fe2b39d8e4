#include <algorithm>
#include <array>
#include <limits>

#include "client/gltf/check_document.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;

constexpr double kHalfPi = 1.5707963267948966;
// Largest emissiveStrength and intensity: above the sun's surface (1.6e9 nit), and within tinygltf's int, to which it
// cuts whole numbers in extensions.
constexpr double kMaxStrength = 2e9;

// Coordinates are float32; so is what they are multiplied by.
constexpr double kMaxUv = std::numeric_limits<float>::max();

// Of a texture that is read.
Result<void> check_texture_transform(const Entry& owner, const char* key) {
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> info, owner.member(key));
  if (!info) return {};
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> transform, info->extension("KHR_texture_transform"));
  if (!transform) return {};
  RADBAKE_RETURN_IF_ERROR(transform->numbers("offset", 2, -kMaxUv, kMaxUv));
  RADBAKE_RETURN_IF_ERROR(transform->number("rotation", -kMaxUv, kMaxUv));
  RADBAKE_RETURN_IF_ERROR(transform->numbers("scale", 2, -kMaxUv, kMaxUv));
  return transform->whole_number("texCoord").ok() ? Result<void>()
                                                  : transform->error("texCoord is not a whole number >= 0");
}

Result<void> check_texture(const Entry& owner, const char* key, std::size_t num_textures) {
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> info, owner.member(key));
  if (!info) return {};
  RADBAKE_RETURN_IF_ERROR(info->required_whole_number("index"));
  RADBAKE_RETURN_IF_ERROR(info->index("index", num_textures, "textures"));
  return info->whole_number("texCoord").ok() ? Result<void>() : info->error("texCoord is not a whole number >= 0");
}

Result<void> check_material(const Entry& material, std::size_t num_textures) {
  RADBAKE_RETURN_IF_ERROR(material.text("name"));
  RADBAKE_RETURN_IF_ERROR(material.flag("doubleSided"));
  RADBAKE_RETURN_IF_ERROR(material.numbers("emissiveFactor", 3, 0, kMaxStrength));
  RADBAKE_RETURN_IF_ERROR(material.number("alphaCutoff", 0, kMaxStrength));
  RADBAKE_RETURN_IF_ERROR(material.text("alphaMode"));
  if (const json* mode = material.find("alphaMode")) {
    const std::string name = mode->get<std::string>();
    if (name != "OPAQUE" && name != "MASK" && name != "BLEND") return material.error("alphaMode is " + in_quotes(name));
  }
  for (const char* key : {"normalTexture", "occlusionTexture", "emissiveTexture"}) {
    RADBAKE_RETURN_IF_ERROR(check_texture(material, key, num_textures));
  }
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> pbr, material.member("pbrMetallicRoughness"));
  if (pbr) {
    RADBAKE_RETURN_IF_ERROR(pbr->numbers("baseColorFactor", 4, 0, kMaxStrength));
    RADBAKE_RETURN_IF_ERROR(pbr->number("metallicFactor", 0, 1));
    RADBAKE_RETURN_IF_ERROR(pbr->number("roughnessFactor", 0, 1));
    RADBAKE_RETURN_IF_ERROR(check_texture(*pbr, "baseColorTexture", num_textures));
    RADBAKE_RETURN_IF_ERROR(check_texture(*pbr, "metallicRoughnessTexture", num_textures));
    RADBAKE_RETURN_IF_ERROR(check_texture_transform(*pbr, "baseColorTexture"));
    RADBAKE_RETURN_IF_ERROR(check_texture_transform(*pbr, "metallicRoughnessTexture"));
  }
  RADBAKE_RETURN_IF_ERROR(check_texture_transform(material, "emissiveTexture"));
  RADBAKE_ASSIGN_OR_RETURN(const auto strength, material.extension("KHR_materials_emissive_strength"));
  if (strength) RADBAKE_RETURN_IF_ERROR(strength->number("emissiveStrength", 0, kMaxStrength));
  RADBAKE_ASSIGN_OR_RETURN(const auto transmission, material.extension("KHR_materials_transmission"));
  if (transmission) {
    RADBAKE_RETURN_IF_ERROR(transmission->number("transmissionFactor", 0, 1));
    RADBAKE_RETURN_IF_ERROR(check_texture(*transmission, "transmissionTexture", num_textures));
  }
  RADBAKE_ASSIGN_OR_RETURN(const auto diffuse, material.extension("KHR_materials_diffuse_transmission"));
  if (diffuse) {
    RADBAKE_RETURN_IF_ERROR(diffuse->number("diffuseTransmissionFactor", 0, 1));
    RADBAKE_RETURN_IF_ERROR(diffuse->numbers("diffuseTransmissionColorFactor", 3, 0, 1));
    for (const char* key : {"diffuseTransmissionTexture", "diffuseTransmissionColorTexture"}) {
      RADBAKE_RETURN_IF_ERROR(check_texture(*diffuse, key, num_textures));
      RADBAKE_RETURN_IF_ERROR(check_texture_transform(*diffuse, key));
    }
  }
  RADBAKE_ASSIGN_OR_RETURN(const auto volume, material.extension("KHR_materials_volume"));
  if (volume) RADBAKE_RETURN_IF_ERROR(volume->number("thicknessFactor", 0, kMaxStrength));
  RADBAKE_ASSIGN_OR_RETURN(const auto clear_coat, material.extension("KHR_materials_clearcoat"));
  if (clear_coat) RADBAKE_RETURN_IF_ERROR(clear_coat->number("clearcoatFactor", 0, 1));
  RADBAKE_ASSIGN_OR_RETURN(const auto refraction, material.extension("KHR_materials_ior"));
  if (refraction) RADBAKE_RETURN_IF_ERROR(refraction->number("ior", 0, kMaxStrength));
  return {};
}

}  // namespace

Result<void> check_materials(const Entry& root) {
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> images, root.list("images", "image"));
  for (const Entry& image : images) {
    RADBAKE_RETURN_IF_ERROR(image.text("uri"));
    RADBAKE_ASSIGN_OR_RETURN(const auto view,
                             image.index("bufferView", list_size(root, "bufferViews"), "buffer views"));
    if (view.has_value() == (image.find("uri") != nullptr)) {
      return image.error("it needs either a uri or a bufferView");
    }
  }
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> samplers, root.list("samplers", "sampler"));
  for (const Entry& sampler : samplers) {
    for (const char* key : {"wrapS", "wrapT"}) {
      RADBAKE_ASSIGN_OR_RETURN(const auto mode, sampler.whole_number(key));
      if (mode && *mode != 10497 && *mode != 33071 && *mode != 33648) {
        return sampler.error(std::string(key) + " is " + std::to_string(*mode) + ", which glTF does not know");
      }
    }
  }
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> textures, root.list("textures", "texture"));
  for (const Entry& texture : textures) {
    RADBAKE_RETURN_IF_ERROR(texture.index("sampler", samplers.size(), "samplers"));
    RADBAKE_RETURN_IF_ERROR(texture.index("source", images.size(), "images"));
  }
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> materials, root.list("materials", "material"));
  for (const Entry& material : materials) RADBAKE_RETURN_IF_ERROR(check_material(material, textures.size()));
  return {};
}

namespace {

Result<void> check_profiles(const Entry& root) {
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> extension, root.extension("EXT_lights_ies"));
  if (!extension) return {};
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> profiles, extension->list("lights", "light profile"));
  for (const Entry& profile : profiles) {
    RADBAKE_RETURN_IF_ERROR(profile.text("name"));
    RADBAKE_RETURN_IF_ERROR(profile.text("uri"));
    RADBAKE_ASSIGN_OR_RETURN(const auto view,
                             profile.index("bufferView", list_size(root, "bufferViews"), "buffer views"));
    if (view.has_value() == (profile.find("uri") != nullptr)) {
      return profile.error("it needs either a uri or a bufferView");
    }
  }
  return {};
}

}  // namespace

Result<void> check_lights(const Entry& root) {
  RADBAKE_RETURN_IF_ERROR(check_profiles(root));
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> extension, root.extension("KHR_lights_punctual"));
  if (!extension) return {};
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> lights, extension->list("lights", "light"));
  for (const Entry& light : lights) {
    RADBAKE_RETURN_IF_ERROR(light.numbers("color", 3, 0, kMaxStrength));
    RADBAKE_RETURN_IF_ERROR(light.number("intensity", 0, kMaxStrength));
    RADBAKE_RETURN_IF_ERROR(light.text("type"));
    const json* type = light.find("type");
    const std::string name = type == nullptr ? "" : type->get<std::string>();
    if (name != "point" && name != "spot" && name != "directional") return light.error("type is " + in_quotes(name));
    if (name != "spot") continue;
    RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> spot, light.member("spot"));
    if (!spot) return light.error("a spot light without its spot object");
    // The specification bounds the cone by a half space; exporters round pi / 2 to float.
    RADBAKE_RETURN_IF_ERROR(spot->number("innerConeAngle", 0, kHalfPi * (1 + 1e-6)));
    RADBAKE_RETURN_IF_ERROR(spot->number("outerConeAngle", 0, kHalfPi * (1 + 1e-6)));
  }
  return {};
}

}  // namespace radbake::gltf
