#include "client/gltf/read_materials.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "client/gltf/entry.h"

namespace radbake::gltf {
namespace {

// A texture of 8 bits cannot say less than this.
constexpr double kSmallestMetallic = 1.0 / 255;
// Smoother surfaces than this show the lights in themselves.
constexpr double kGlossyRoughness = 0.5;
// Of glass, and of what says nothing else: KHR_materials_ior.
constexpr double kDefaultIor = 1.5;

const tinygltf::Value* extension(const tinygltf::ExtensionMap& extensions, const char* name) {
  const auto it = extensions.find(name);
  return it == extensions.end() ? nullptr : &it->second;
}

double number(const tinygltf::Value* object, const char* key, double otherwise) {
  return object != nullptr && object->Has(key) ? object->Get(key).GetNumberAsDouble() : otherwise;
}

Wrap wrap_of(int mode) {
  if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::kClamp;
  return mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::kMirror : Wrap::kRepeat;
}

AlphaMode alpha_mode_of(const std::string& mode) {
  return mode == "MASK" ? AlphaMode::kMask : mode == "BLEND" ? AlphaMode::kBlend : AlphaMode::kOpaque;
}

// KHR_texture_transform may name other coordinates than the texture does.
int texcoord_set(const tinygltf::TextureInfo& info) {
  const tinygltf::Value* transform = extension(info.extensions, "KHR_texture_transform");
  return transform != nullptr && transform->Has("texCoord") ? transform->Get("texCoord").GetNumberAsInt()
                                                            : info.texCoord;
}

Vec2 pair(const tinygltf::Value* object, const char* key, Vec2 otherwise) {
  if (object == nullptr || !object->Has(key)) return otherwise;
  const tinygltf::Value& numbers = object->Get(key);
  return {numbers.Get(0).GetNumberAsDouble(), numbers.Get(1).GetNumberAsDouble()};
}

// uv' = T R S uv. The image's y points down: a positive angle turns the coordinates counter-clockwise as they are seen
// on the image, so R = (c, s; -s, c). (The listing in the extension's text has it the other way round.)
TextureReference reference(const tinygltf::TextureInfo& info) {
  TextureReference result{0, texcoord_set(info) == 1 ? 1 : 0, {}};
  const tinygltf::Value* transform = extension(info.extensions, "KHR_texture_transform");
  const double angle = number(transform, "rotation", 0), c = std::cos(angle), s = std::sin(angle);
  const Vec2 scale = pair(transform, "scale", {1, 1});
  result.transform = {Vec2{c, -s} * scale.x, Vec2{s, c} * scale.y, pair(transform, "offset", {0, 0})};
  return result;
}

bool is_unlit(const tinygltf::Material& material) {
  return extension(material.extensions, "KHR_materials_unlit") != nullptr;
}

// The share of light that a sheet lets through; unlit surfaces have nothing but their base colour.
double transmission_of(const tinygltf::Material& material) {
  if (is_unlit(material)) return 0;
  return number(extension(material.extensions, "KHR_materials_transmission"), "transmissionFactor", 0);
}

// What a diffuse bake does not simulate.
void read_flags(const tinygltf::Material& source, Material& material, const MaterialFacts& facts) {
  material.has_normal_map = facts.has_normal_map;
  if (facts.is_unlit) return;
  const double clear_coat = number(extension(source.extensions, "KHR_materials_clearcoat"), "clearcoatFactor", 0);
  material.is_specular =
      facts.is_metallic || clear_coat > 0 || source.pbrMetallicRoughness.roughnessFactor < kGlossyRoughness;
  material.has_volume = number(extension(source.extensions, "KHR_materials_volume"), "thicknessFactor", 0) > 0;
  const double ior = number(extension(source.extensions, "KHR_materials_ior"), "ior", kDefaultIor);
  material.is_refractive = transmission_of(source) > 0 && (material.has_volume || ior != kDefaultIor);
}

const tinygltf::Value* diffuse_transmission(const tinygltf::Material& material) {
  return is_unlit(material) ? nullptr : extension(material.extensions, "KHR_materials_diffuse_transmission");
}

Vec3 diffuse_transmission_color(const tinygltf::Value& diffuse) {
  Vec3 color{1, 1, 1};
  if (!diffuse.Has("diffuseTransmissionColorFactor")) return color;
  const tinygltf::Value& factors = diffuse.Get("diffuseTransmissionColorFactor");
  for (int c = 0; c < 3; ++c) color[c] = factors.Get(c).GetNumberAsDouble();
  return color;
}

bool is_translucent(const tinygltf::Material& material) {
  const tinygltf::Value* diffuse = diffuse_transmission(material);
  return number(diffuse, "diffuseTransmissionFactor", 0) > 0 && max_component(diffuse_transmission_color(*diffuse)) > 0;
}

// A texture that an extension uses: tinygltf leaves it as it stands in the file. Index -1: there is none.
tinygltf::TextureInfo texture_info(const tinygltf::Value* object, const char* key) {
  tinygltf::TextureInfo info;
  if (object == nullptr || !object->Has(key)) return info;
  const tinygltf::Value& texture = object->Get(key);
  info.index = texture.Get("index").GetNumberAsInt();
  info.texCoord = static_cast<int>(number(&texture, "texCoord", 0));
  if (!texture.Has("extensions")) return info;
  const tinygltf::Value& extensions = texture.Get("extensions");
  for (const std::string& name : extensions.Keys()) info.extensions[name] = extensions.Get(name);
  return info;
}

bool is_emissive(const tinygltf::Material& material) {
  if (number(extension(material.extensions, "KHR_materials_emissive_strength"), "emissiveStrength", 1) <= 0)
    return false;
  return std::any_of(material.emissiveFactor.begin(), material.emissiveFactor.end(), [](double f) { return f > 0; });
}

// A decoder is injected: a plane that is not one would crash us later.
std::string fault_of(const TexturePlane& plane) {
  if (plane.width <= 0 || plane.height <= 0 || plane.channels < 3 || plane.channels > 4 ||
      plane.values.size() != std::size_t(plane.width) * std::size_t(plane.height) * std::size_t(plane.channels)) {
    return "its decoded size is impossible";
  }
  const bool is_fine = std::all_of(plane.values.begin(), plane.values.end(),
                                   [](float value) { return value >= 0 && std::isfinite(value); });
  return is_fine ? "" : "it holds a value that is negative or not finite";
}

}  // namespace

Result<const TexturePlane*> MaterialReader::decoded(int index, bool is_srgb) {
  if (const auto it = images_.find({index, is_srgb}); it != images_.end()) return &it->second;
  const tinygltf::Texture& texture = model_.textures[index];
  const std::string texture_name = numbered("texture", static_cast<std::size_t>(index), texture.name);
  if (texture.source < 0) return invalid_argument(texture_name + " has no image of a kind that this version reads");
  const tinygltf::Image& image = model_.images[texture.source];
  const std::string label = image.name.empty() ? image.uri : image.name;
  const std::string name = numbered("image", static_cast<std::size_t>(texture.source), label);
  if (image.image.empty()) return invalid_argument(name + ": the image file is missing or empty");
  Result<TexturePlane> plane = decode_image_(std::as_bytes(std::span(image.image)), name, is_srgb);
  if (!plane.ok()) return invalid_argument(name + ": " + plane.error().message);
  if (const std::string fault = fault_of(*plane); !fault.empty()) return invalid_argument(name + ": " + fault);
  plane->name = label.empty() ? "image" + std::to_string(texture.source) : printable(label);
  if (texture.sampler >= 0) {
    plane->wrap_s = wrap_of(model_.samplers[texture.sampler].wrapS);
    plane->wrap_t = wrap_of(model_.samplers[texture.sampler].wrapT);
  }
  return &images_.emplace(std::pair(index, is_srgb), std::move(plane).value()).first->second;
}

Result<int> MaterialReader::scene_texture(const PlaneUse& use) {
  const std::array<double, 11> key = {double(use.texture),
                                      use.ratio.x,
                                      use.ratio.y,
                                      use.ratio.z,
                                      use.bound.x,
                                      use.bound.y,
                                      use.bound.z,
                                      double(use.keeps_opacity),
                                      double(use.metal_texture),
                                      use.metal.metallic,
                                      use.metal.roughness};
  if (const auto it = scene_textures_.find(key); it != scene_textures_.end()) return it->second;
  RADBAKE_ASSIGN_OR_RETURN(const TexturePlane* source, decoded(use.texture, true));
  TexturePlane plane = *source;
  plane.channels = use.keeps_opacity ? source->channels : 3;
  plane.values.clear();
  plane.values.reserve(std::size_t(plane.width) * std::size_t(plane.height) * std::size_t(plane.channels));
  for (std::size_t at = 0; at < source->values.size(); at += std::size_t(source->channels)) {
    const double share = share_at(use, *source, at / std::size_t(source->channels));
    for (int c = 0; c < 3; ++c) {
      float value = static_cast<float>(source->values[at + c] * share * use.ratio[c]);
      // Rounding to float must not lift a value over its bound.
      if (use.bound[c] > 0 && value > use.bound[c]) value = std::nextafter(static_cast<float>(use.bound[c]), 0.0f);
      plane.values.push_back(value);
    }
    if (plane.channels == 4) plane.values.push_back(source->values[at + 3]);
  }
  textures_.push_back(std::move(plane));
  const int index = static_cast<int>(textures_.size()) - 1;
  scene_textures_[key] = index;
  return index;
}

double MaterialReader::share_at(const PlaneUse& use, const TexturePlane& base, std::size_t texel) const {
  if (use.metal_texture < 0) return 1;
  const std::size_t width = std::size_t(base.width);
  const Vec2 centre{(double(texel % width) + 0.5) / base.width, (double(texel / width) + 0.5) / base.height};
  return diffuse_share_at(use.metal, images_.at({use.metal_texture, false}), centre);
}

Result<MaterialReader::MetalUse> MaterialReader::read_metal(const tinygltf::Material& source) {
  const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
  MetalUse use;
  use.factors = {pbr.metallicFactor, pbr.roughnessFactor};
  if (is_unlit(source)) use.factors.metallic = 0;
  use.mean = metal_shares(use.factors);
  const int texture = pbr.metallicRoughnessTexture.index;
  if (use.factors.metallic <= 0 || texture < 0) return use;
  RADBAKE_ASSIGN_OR_RETURN(const TexturePlane* metal, decoded(texture, false));
  use.mean = mean_metal_shares(use.factors, *metal);
  if (transmission_of(source) > 0 || pbr.baseColorTexture.index < 0) return use;
  // Both looked up alike: texel by texel.
  const tinygltf::TextureInfo &info = pbr.metallicRoughnessTexture, &base = pbr.baseColorTexture;
  if (texcoord_set(info) != texcoord_set(base) || reference(info).transform != reference(base).transform) return use;
  RADBAKE_ASSIGN_OR_RETURN(const TexturePlane* color, decoded(base.index, true));
  if (metal->wrap_s == color->wrap_s && metal->wrap_t == color->wrap_t) use.texture = texture;
  return use;
}

Result<void> MaterialReader::read_reflectance(const tinygltf::Material& source, Material& material,
                                              MaterialFacts& facts) {
  const tinygltf::PbrMetallicRoughness& pbr = source.pbrMetallicRoughness;
  const double limit = options_.max_reflectance;
  material.alpha = pbr.baseColorFactor[3];
  material.alpha_mode = alpha_mode_of(source.alphaMode);
  material.alpha_cutoff = source.alphaCutoff;
  RADBAKE_ASSIGN_OR_RETURN(const MetalUse metal, read_metal(source));
  facts.is_metallic = 1 - metal.mean.dielectric >= kSmallestMetallic;

  // Divide the base colour: what goes through, and what is reflected. A sheet's shares are of one.
  const double through = transmission_of(source) * metal.mean.dielectric;
  Vec3 base{pbr.baseColorFactor[0], pbr.baseColorFactor[1], pbr.baseColorFactor[2]};
  if (through > 0) base = {std::fmin(base.x, 1), std::fmin(base.y, 1), std::fmin(base.z, 1)};
  const Vec3 factor = base * (metal.texture < 0 ? metal.mean.diffuse - through : 1.0);
  material.transmittance = base * through;
  material.reflectance = {std::fmin(factor.x, limit), std::fmin(factor.y, limit), std::fmin(factor.z, limit)};
  if (pbr.baseColorTexture.index < 0) {
    facts.limited_share = max_component(factor) > limit ? 1 : 0;
    facts.untextured = factor;
    return {};
  }
  material.reflectance_texture = reference(pbr.baseColorTexture);
  RADBAKE_ASSIGN_OR_RETURN(const TexturePlane* plane, decoded(pbr.baseColorTexture.index, true));
  PlaneUse use;
  use.texture = pbr.baseColorTexture.index;
  use.keeps_opacity = material.alpha_mode != AlphaMode::kOpaque;
  use.metal_texture = metal.texture;
  if (metal.texture >= 0) use.metal = metal.factors;

  // Count the texels that are too bright.
  const std::size_t num_texels = std::size_t(plane->width) * std::size_t(plane->height);
  std::size_t num_limited = 0;
  for (std::size_t i = 0; i < num_texels; ++i) {
    const float* texel = &plane->values[i * std::size_t(plane->channels)];
    const Vec3 color = Vec3{texel[0], texel[1], texel[2]} * share_at(use, *plane, i);
    if (max_component(scaled_by(factor, color)) > limit) ++num_limited;
  }
  facts.limited_share = double(num_limited) / double(num_texels);
  for (int c = 0; c < 3; ++c) {
    if (material.reflectance[c] <= 0) continue;
    use.ratio[c] = factor[c] / material.reflectance[c];
    if (num_limited > 0) use.bound[c] = limit / material.reflectance[c];
    // The texture multiplies both: what its ratio adds for the reflectance is taken off here.
    material.transmittance[c] /= use.ratio[c];
  }
  RADBAKE_ASSIGN_OR_RETURN(material.reflectance_texture->texture, scene_texture(use));
  return {};
}

Result<void> MaterialReader::read_diffuse_transmission(const tinygltf::Material& source, Material& material,
                                                       MaterialFacts& facts) {
  const tinygltf::Value* diffuse = diffuse_transmission(source);
  double share = number(diffuse, "diffuseTransmissionFactor", 0);
  if (share <= 0) return {};
  const tinygltf::TextureInfo shares = texture_info(diffuse, "diffuseTransmissionTexture");
  if (shares.index >= 0) {
    // The share stands in the alpha channel; where there is none it is 1.
    RADBAKE_ASSIGN_OR_RETURN(const TexturePlane* plane, decoded(shares.index, false));
    double sum = 0;
    const auto step = static_cast<std::size_t>(plane->channels);
    for (std::size_t at = 0; at < plane->values.size(); at += step) sum += step == 4 ? plane->values[at + 3] : 1.0;
    share *= sum / (static_cast<double>(plane->width) * plane->height);
    facts.has_diffuse_transmission_texture = true;
  }
  // What goes straight through comes first, and metal lets nothing through.
  RADBAKE_ASSIGN_OR_RETURN(const MetalUse metal, read_metal(source));
  Vec3 color = diffuse_transmission_color(*diffuse);
  for (int c = 0; c < 3; ++c) color[c] = std::fmin(color[c], options_.max_reflectance);
  material.diffuse_transmittance = color * (share * metal.mean.dielectric * (1 - transmission_of(source)));
  material.reflectance *= 1 - share * metal.mean.dielectric;
  if (max_component(material.diffuse_transmittance) <= 0) return {};
  material.is_double_sided = true;
  const tinygltf::TextureInfo colors = texture_info(diffuse, "diffuseTransmissionColorTexture");
  if (colors.index < 0) return {};
  material.diffuse_transmittance_texture = reference(colors);
  RADBAKE_ASSIGN_OR_RETURN(material.diffuse_transmittance_texture->texture, scene_texture({.texture = colors.index}));
  return {};
}

Result<void> MaterialReader::read_emission(const tinygltf::Material& source, Material& material) {
  for (int c = 0; c < 3 && !source.emissiveFactor.empty(); ++c) material.emissive[c] = source.emissiveFactor[c];
  material.emissive *= number(extension(source.extensions, "KHR_materials_emissive_strength"), "emissiveStrength", 1);
  if (source.emissiveTexture.index < 0 || max_component(material.emissive) == 0) return {};
  material.emissive_texture = reference(source.emissiveTexture);
  RADBAKE_ASSIGN_OR_RETURN(material.emissive_texture->texture,
                           scene_texture({.texture = source.emissiveTexture.index}));
  return {};
}

Result<void> MaterialReader::read(const tinygltf::Material& source, Material& material, MaterialFacts& facts) {
  RADBAKE_RETURN_IF_ERROR(read_reflectance(source, material, facts));
  facts.limited = material.reflectance;
  RADBAKE_RETURN_IF_ERROR(read_emission(source, material));
  material.is_double_sided = source.doubleSided;
  RADBAKE_RETURN_IF_ERROR(read_diffuse_transmission(source, material, facts));
  facts.is_unlit = is_unlit(source);
  facts.has_normal_map = source.normalTexture.index >= 0;
  const tinygltf::Value* transmission = extension(source.extensions, "KHR_materials_transmission");
  facts.has_transmission_texture = transmission_of(source) > 0 && transmission->Has("transmissionTexture");
  read_flags(source, material, facts);
  return {};
}

Result<int> MaterialReader::texcoord0_set(int index) const {
  if (index < 0) return 0;
  const tinygltf::Material& material = model_.materials[index];
  const tinygltf::TextureInfo& color = material.pbrMetallicRoughness.baseColorTexture;
  const tinygltf::TextureInfo& emission = material.emissiveTexture;
  const tinygltf::TextureInfo through = texture_info(diffuse_transmission(material), "diffuseTransmissionColorTexture");
  std::vector<std::pair<int, std::string>> sets;
  if (color.index >= 0) sets.emplace_back(texcoord_set(color), "baseColorTexture");
  if (emission.index >= 0 && is_emissive(material)) sets.emplace_back(texcoord_set(emission), "emissiveTexture");
  if (through.index >= 0 && is_translucent(material)) {
    sets.emplace_back(texcoord_set(through), "diffuseTransmissionColorTexture");
  }
  std::erase_if(sets, [](const auto& use) { return use.first == 1; });
  if (sets.empty()) return 0;
  const auto other =
      std::find_if(sets.begin(), sets.end(), [&](const auto& use) { return use.first != sets.front().first; });
  if (other == sets.end()) return sets.front().first;
  return invalid_argument(numbered("material", static_cast<std::size_t>(index), material.name) + ": " +
                          sets.front().second + " uses TEXCOORD_" + std::to_string(sets.front().first) + " and " +
                          other->second + " TEXCOORD_" + std::to_string(other->first) +
                          "; beside TEXCOORD_1 one set is read");
}

Result<int> MaterialReader::scene_material(int index) {
  if (const auto it = scene_materials_.find(index); it != scene_materials_.end()) return it->second;
  const tinygltf::Material standard;
  const tinygltf::Material& source = index < 0 ? standard : model_.materials[index];
  Material material;
  MaterialFacts facts;
  const Result<void> is_read = read(source, material, facts);
  if (!is_read.ok()) {
    return invalid_argument(numbered("material", static_cast<std::size_t>(index), source.name) + ": " +
                            is_read.error().message);
  }
  material.name = index < 0             ? "glTF's default material"
                  : source.name.empty() ? "material" + std::to_string(index)
                                        : printable(source.name);
  materials_.push_back(std::move(material));
  facts_.push_back(facts);
  const int scene_index = static_cast<int>(materials_.size()) - 1;
  scene_materials_[index] = scene_index;
  return scene_index;
}

}  // namespace radbake::gltf
