#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "common/geometry/transform.h"
#include "common/geometry/vector.h"
#include "common/scene/light_profile.h"

namespace radbake {

enum class Wrap { kRepeat, kClamp, kMirror };

/// An image in linear light, float32, rows from the top (glTF's UV origin), channels interleaved.
/// Shapes: values [height * width * channels], channels 3 or 4; the fourth is opacity.
struct TexturePlane {
  std::string name;
  int width = 0;
  int height = 0;
  int channels = 3;
  Wrap wrap_s = Wrap::kRepeat;
  Wrap wrap_t = Wrap::kRepeat;
  std::vector<float> values;
};

/// Affine map of texture coordinates: uv -> x_axis u + y_axis v + offset. Numbers as float32 holds them: products with
/// coordinates and sizes then stay finite in double.
struct UvTransform {
  Vec2 x_axis{1, 0};
  Vec2 y_axis{0, 1};
  Vec2 offset;

  Vec2 apply(Vec2 uv) const { return x_axis * uv.x + y_axis * uv.y + offset; }
  bool is_within_float() const {
    constexpr double kMax = std::numeric_limits<float>::max();
    const auto is_within = [](Vec2 v) { return std::fabs(v.x) <= kMax && std::fabs(v.y) <= kMax; };
    return is_within(x_axis) && is_within(y_axis) && is_within(offset);
  }
  bool operator==(const UvTransform&) const = default;
};

/// Which texture multiplies a material's factor, and which of the mesh's texture coordinates it uses.
struct TextureReference {
  int texture = 0;             ///< index into Scene::textures
  int texcoord = 0;            ///< 0 or 1
  UvTransform transform = {};  ///< of the mesh's coordinate, before it is looked up
};

enum class AlphaMode { kOpaque, kMask, kBlend };

/// A diffuse surface. Colours are linear Rec.709.
struct Material {
  std::string name;
  Vec3 reflectance{0.8, 0.8, 0.8};  ///< each channel in [0, 1)
  std::optional<TextureReference> reflectance_texture;
  Vec3 emissive;  ///< luminance, nit; exitance E = pi * emissive
  std::optional<TextureReference> emissive_texture;
  bool is_double_sided = false;
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  double alpha = 1;
  double alpha_cutoff = 0.5;
  /// A thin sheet: this share of the light goes straight through. The reflectance texture multiplies it too;
  /// reflectance + transmittance <= 1 in each channel.
  Vec3 transmittance = {};
  /// A leaf, a curtain: this share tau of the light that arrives on one side leaves the other one, scattered; the
  /// texture multiplies it. reflectance + diffuse_transmittance < 1 in each channel. Both sides send and receive light
  /// then.
  Vec3 diffuse_transmittance = {};
  std::optional<TextureReference> diffuse_transmittance_texture = std::nullopt;
  // What the file asks for and a diffuse bake does not simulate.
  bool is_specular = false;    ///< mirrors or shines: metal, clear coat, roughness below one half
  bool is_refractive = false;  ///< has an inside that bends light
  bool has_normal_map = false;
  bool has_volume = false;  ///< absorbs or scatters inside

  /// The textures that look something up by the mesh's coordinates; absent ones too.
  std::array<std::optional<TextureReference>, 3> textures() const {
    return {reflectance_texture, emissive_texture, diffuse_transmittance_texture};
  }
};

/// Bounds of Mesh::texel_density.
inline constexpr double kMinTexelDensity = 1.0 / 64, kMaxTexelDensity = 64;

/// Triangles of one material. Front is where the vertices turn counter-clockwise.
/// Shapes: positions [n]; normals, texcoord0, texcoord1, colors [n] or empty; triangles [m] of indices below n.
struct Mesh {
  std::string name;          ///< for messages: node/mesh#primitive
  int object = 0;            ///< meshes of one object share one layout of texcoord1, and lie in one lightmap
  double texel_density = 1;  ///< factor on the bake's texels per metre
  int material = 0;
  std::vector<Vec3> positions;  ///< metres
  std::vector<Vec3> normals;    ///< unit length
  std::vector<Vec2> texcoord0;
  std::vector<Vec2> texcoord1;  ///< the lightmap's layout: (0, 0) is the top left corner of the atlas
  std::vector<Vec3> colors;     ///< multiply the material's reflectance, each channel in [0, 1]
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Intensity in cd; no falloff but the inverse square.
struct PointLight {
  Vec3 position;
  Vec3 intensity;
};

/// Full intensity (cd) inside the inner cone, smooth to zero at the outer one, as KHR_lights_punctual recommends.
struct SpotLight {
  Vec3 position;
  Vec3 direction;  ///< in which the light travels, unit length
  Vec3 intensity;
  double inner_cone_radians = 0;
  double outer_cone_radians = 0.7853981633974483;
};

/// The sun: light from a disc in the sky, illuminance in lx on a facing surface.
struct DirectionalLight {
  Vec3 direction;  ///< in which the light travels, unit length
  Vec3 illuminance;
  double angular_diameter_radians = 0;  ///< of the disc, below pi; 0: parallel light, hard shadows
};

/// A luminaire's measured intensities, at a point (EXT_lights_ies).
struct ProfileLight {
  Vec3 position;
  Vec3 direction;  ///< of vertical angle 0, unit length
  Vec3 zero_side;  ///< of horizontal angle 0, unit length, at right angles to `direction`
  Vec3 tint{1, 1, 1};
  std::shared_ptr<const LightProfile> profile;  ///< not null; luminaires of one kind share it
  bool is_mirrored = false;                     ///< horizontal angles turn the other way
};

struct Light {
  std::string name;
  std::variant<PointLight, SpotLight, DirectionalLight, ProfileLight> kind;
};

/// Direction in which one looks -> place in an equirectangular image: u = atan2(z, x) / 2 pi + 1/2, v = acos(y) / pi.
inline Vec2 equirectangular(Vec3 unit) {
  constexpr double kPi = 3.14159265358979323846;
  return {std::atan2(unit.z, unit.x) / (2 * kPi) + 0.5, std::acos(std::fmax(-1.0, std::fmin(unit.y, 1.0))) / kPi};
}

/// What is baked: meshes in world space, their materials, and the lights. Plain data.
struct Scene {
  std::vector<Mesh> meshes;
  std::vector<Material> materials;
  std::vector<TexturePlane> textures;
  std::vector<Light> lights;
  Vec3 sky;  ///< luminance of a constant sky, nit; 0: none
  /// A sky of every direction instead, luminance in nit, equirectangular(), 3 channels, width = 2 height.
  std::optional<TexturePlane> environment = std::nullopt;
  std::uint64_t num_instances = 0;  ///< of meshes that the file places more than once
};

/// A mesh placed in the world, as a file tells it.
struct Instance {
  std::string name;  ///< of the node
  int mesh = 0;
  Transform transform;
};

/// Copies a mesh into the world: positions, normals, and the winding where the transform mirrors.
/// Triangles keep their order. Source: glTF 2.0, 3.7.4 (a negative determinant reverses the winding).
Mesh placed_in_world(const Mesh& mesh, const Transform& transform);

/// A message that the user should see, with a short stable id.
struct Warning {
  std::string id;
  std::string text;
};

}  // namespace radbake
