#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "client/gltf/load_model.h"
#include "client/gltf/metal.h"
#include "client/gltf/read_gltf.h"
#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::gltf {

/// What a file says of a material and a diffuse bake does not follow, or not fully.
struct MaterialFacts {
  double limited_share = 0;  ///< of its surface, by texels: reflectance above the limit
  Vec3 untextured;           ///< reflectance before it was limited; zero where a texture multiplies it
  Vec3 limited;              ///< and after, before diffuse transmission takes its share
  bool is_metallic = false;
  bool has_transmission_texture = false;
  bool has_diffuse_transmission_texture = false;  ///< of the share, not of the colour
  bool has_normal_map = false;
  bool is_unlit = false;
};

/// Reads materials and their textures as meshes ask for them: what no mesh uses is neither read nor decoded.
class MaterialReader {
 public:
  /// The arguments must outlive this.
  MaterialReader(const tinygltf::Model& model, const ImageDecoder& decode_image, const ReadOptions& options)
      : model_(model), decode_image_(decode_image), options_(options) {}

  /// Index into materials() of a material of the file, -1 being glTF's default material.
  ///
  /// Reflectance is base colour factor times texture times what metalness and transmission leave of it, each channel
  /// at most the limit: with factor f' = min(f, limit) and texture t' = min(f t, limit) / f', the product is exact
  /// where it needs no limit. The shares are those of metal_shares(), and of the dielectric part transmission takes its
  /// own:
  ///
  ///   reflectance = base (diffuse - T dielectric),   transmittance = base T dielectric,   T: transmission factor
  ///
  /// Diffuse transmission takes its share D of what is reflected: reflectance (1 - D), diffuse transmittance D times
  /// its colour, at most the limit; D is the mean where a texture multiplies it. A texture of metalness and roughness
  /// is followed texel by texel, at the centres of the base colour's texels, where both are looked up alike and nothing
  /// is transmitted; elsewhere by the mean of its shares. Errors: kInvalidArgument, naming the material and the texture
  /// or image.
  Result<int> scene_material(int material);

  /// Which TEXCOORD_n becomes the texcoord0 of a mesh of a material of the file: the one that its textures use beside
  /// TEXCOORD_1, else 0. Errors: kInvalidArgument, naming the material whose textures use two.
  Result<int> texcoord0_set(int material) const;

  std::vector<Material>& materials() { return materials_; }
  std::vector<TexturePlane>& textures() { return textures_; }
  const std::vector<MaterialFacts>& facts() const { return facts_; }

 private:
  // Factors of a plane's values, and their upper bounds. Equal planes are shared.
  struct PlaneUse {
    int texture = 0;
    Vec3 ratio{1, 1, 1};
    Vec3 bound = {};  // 0: none
    bool keeps_opacity = false;
    int metal_texture = -1;  // whose shares multiply each texel
    MetalRoughness metal = {};
  };
  // What metalness leaves of the base colour.
  struct MetalUse {
    MetalShares mean;
    int texture = -1;  // that is followed texel by texel
    MetalRoughness factors;
  };

  Result<void> read(const tinygltf::Material& source, Material& material, MaterialFacts& facts);
  Result<void> read_reflectance(const tinygltf::Material& source, Material& material, MaterialFacts& facts);
  Result<void> read_diffuse_transmission(const tinygltf::Material& source, Material& material, MaterialFacts& facts);
  Result<void> read_emission(const tinygltf::Material& source, Material& material);
  Result<MetalUse> read_metal(const tinygltf::Material& source);
  double share_at(const PlaneUse& use, const TexturePlane& base, std::size_t texel) const;
  Result<const TexturePlane*> decoded(int texture, bool is_srgb);
  Result<int> scene_texture(const PlaneUse& use);

  const tinygltf::Model& model_;
  const ImageDecoder& decode_image_;
  const ReadOptions& options_;
  std::vector<Material> materials_;
  std::vector<MaterialFacts> facts_;
  std::vector<TexturePlane> textures_;
  std::map<int, int> scene_materials_;                    // of the file -> of the scene
  std::map<std::pair<int, bool>, TexturePlane> images_;   // by texture and whether it is sRGB
  std::map<std::array<double, 11>, int> scene_textures_;  // by PlaneUse
};

}  // namespace radbake::gltf
