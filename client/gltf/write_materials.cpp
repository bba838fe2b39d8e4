#include "client/gltf/write_materials.h"

#include <functional>
#include <optional>

namespace radbake::gltf {
namespace {

constexpr char kExtension[] = "MOZ_lightmap";
constexpr char kVariants[] = "KHR_materials_variants";
constexpr int kLinear = 9729, kClampToEdge = 33071;
constexpr std::size_t kNoMaterial = static_cast<std::size_t>(-1);

/// Sends whatever in a material looks up TEXCOORD_1 to another one: texture infos of any extension, and the transforms
/// that override them.
void redirect_texcoord1(OrderedJson& object, int texcoord) {
  for (auto& [key, value] : object.items()) {
    if (key == "extras" || key == kExtension) continue;
    if (key == "texCoord" && value == 1) {
      value = texcoord;
    } else if (value.is_structured()) {
      redirect_texcoord1(value, texcoord);
    }
  }
}

/// glTF's default material, spelled out.
OrderedJson default_material() {
  return {{"name", "default"},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", {1.0, 1.0, 1.0, 1.0}}, {"metallicFactor", 1.0}, {"roughnessFactor", 1.0}}},
          {"emissiveFactor", {0.0, 0.0, 0.0}},
          {"alphaMode", "OPAQUE"},
          {"doubleSided", false}};
}

class LightmapAttacher {
 public:
  LightmapAttacher(Document& document, const std::vector<LightmapImage>& lightmaps)
      : document_(document), lightmaps_(lightmaps), textures_(lightmaps.size()) {}

  void attach(const MaterialUses& uses) {
    // Who uses each material, and how?
    for_each_reference(uses, [&](std::size_t material, const MaterialUse& use, OrderedJson*) {
      if (use.lightmap < 0) places_[{material, use}] = material;
    });
    // Each other use gets the material itself if it is free, else a copy.
    for_each_reference(uses, [&](std::size_t material, const MaterialUse& use, OrderedJson* reference) {
      if (use.lightmap >= 0) *reference = place_of(material, use);
    });
    for (const auto& [key, place] : places_) {
      if (key.second.lightmap >= 0) finish(document_.json["materials"].at(place), key.second);
    }
  }

 private:
  using Visit = std::function<void(std::size_t material, const MaterialUse& use, OrderedJson* reference)>;

  /// Visits every place in meshes that names a material, in the file's order.
  void for_each_reference(const MaterialUses& uses, const Visit& visit) {
    // The array itself: what is added to the document does not move it.
    auto& meshes = document_.json["meshes"].get_ref<OrderedJson::array_t&>();
    for (std::size_t mesh = 0; mesh < meshes.size(); ++mesh) {
      OrderedJson& primitives = meshes[mesh].at("primitives");
      for (std::size_t i = 0; i < primitives.size(); ++i) {
        const auto it = uses.find({mesh, i});
        const MaterialUse use = it == uses.end() ? MaterialUse() : it->second;
        OrderedJson& primitive = primitives[i];
        if (primitive.contains("material")) {
          visit(primitive["material"].get<std::size_t>(), use, &primitive["material"]);
        } else if (use.lightmap >= 0) {
          OrderedJson material;
          visit(kNoMaterial, use, &material);
          if (!material.is_null()) primitive["material"] = material;
        }
        if (!primitive.contains("extensions") || !primitive["extensions"].contains(kVariants)) continue;
        for (OrderedJson& mapping : primitive["extensions"][kVariants].at("mappings")) {
          visit(mapping.at("material").get<std::size_t>(), use, &mapping["material"]);
        }
      }
    }
  }

  std::size_t place_of(std::size_t material, const MaterialUse& use) {
    const auto known = places_.find({material, use});
    if (known != places_.end()) return known->second;
    // Places of one material stand side by side, the one as it was first.
    const auto first = places_.lower_bound({material, MaterialUse()});
    const bool is_free = first == places_.end() || first->first.first != material;
    std::size_t place = material;
    if (material == kNoMaterial) {
      place = document_.add("materials", default_material());
    } else if (!is_free) {
      place = document_.add("materials", OrderedJson(document_.json["materials"].at(material)));
    }
    return places_[{material, use}] = place;
  }

  void finish(OrderedJson& material, const MaterialUse& use) {
    if (use.moved_texcoord1 > 0) redirect_texcoord1(material, use.moved_texcoord1);
    const auto lightmap = static_cast<std::size_t>(use.lightmap);
    material["extensions"][kExtension] = {
        {"index", texture_of(lightmap)}, {"texCoord", 1}, {"intensity", lightmaps_[lightmap].intensity}};
    document_.use_extension(kExtension);
  }

  std::size_t texture_of(std::size_t lightmap) {
    if (textures_[lightmap]) return *textures_[lightmap];
    const std::size_t image = document_.add_image(lightmaps_[lightmap].name, lightmaps_[lightmap].png, "image/png");
    if (!sampler_) {
      // What lies beside a map is not its other side.
      sampler_ = document_.add(
          "samplers",
          {{"magFilter", kLinear}, {"minFilter", kLinear}, {"wrapS", kClampToEdge}, {"wrapT", kClampToEdge}});
    }
    textures_[lightmap] =
        document_.add("textures", {{"name", lightmaps_[lightmap].name}, {"sampler", *sampler_}, {"source", image}});
    return *textures_[lightmap];
  }

  Document& document_;
  const std::vector<LightmapImage>& lightmaps_;
  std::map<std::pair<std::size_t, MaterialUse>, std::size_t> places_;  // where each use of a material finds it
  std::vector<std::optional<std::size_t>> textures_;
  std::optional<std::size_t> sampler_;
};

}  // namespace

void attach_lightmaps(Document& document, const MaterialUses& uses, const std::vector<LightmapImage>& lightmaps) {
  if (!uses.empty()) LightmapAttacher(document, lightmaps).attach(uses);
}

}  // namespace radbake::gltf
