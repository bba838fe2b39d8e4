#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "client/gltf/load_model.h"
#include "client/gltf/read_gltf.h"
#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::gltf {

/// What a file says of a material and a diffuse bake does not follow, or not fully.
struct MaterialFacts {
  double limited_share = 0;  ///< of its surface, by texels: reflectance above the limit
  Vec3 untextured;           ///< base colour factor before it was limited; zero where a texture multiplies it
  bool is_metallic = false;
  bool is_translucent = false;  ///< masked or blended, and not opaque in fact
  bool is_transmissive = false;
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
  /// Reflectance is base colour factor times texture, each channel at most the limit: with factor f' = min(f, limit)
  /// and texture t' = min(f t, limit) / f', the product is exact where it needs no limit.
  /// Errors: kInvalidArgument, naming the material and the texture or image.
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
  };

  Result<void> read(const tinygltf::Material& source, Material& material, MaterialFacts& facts);
  Result<void> read_reflectance(const tinygltf::Material& source, Material& material, MaterialFacts& facts);
  Result<void> read_emission(const tinygltf::Material& source, Material& material);
  bool is_metallic(const tinygltf::Material& source);
  Result<const TexturePlane*> decoded(int texture, bool is_srgb);
  Result<int> scene_texture(const PlaneUse& use);

  const tinygltf::Model& model_;
  const ImageDecoder& decode_image_;
  const ReadOptions& options_;
  std::vector<Material> materials_;
  std::vector<MaterialFacts> facts_;
  std::vector<TexturePlane> textures_;
  std::map<int, int> scene_materials_;                   // of the file -> of the scene
  std::map<std::pair<int, bool>, TexturePlane> images_;  // by texture and whether it is sRGB
  std::map<std::array<double, 8>, int> scene_textures_;  // by PlaneUse
};

}  // namespace radbake::gltf
