#pragma once

#include <cmath>
#include <memory>
#include <string>

#include "common/codec/scene_codec.h"
#include "common/scene/scene.h"

namespace radbake {

/// Decodes what encode_scene made, with the default limits.
inline Result<Scene> decode_encoded(const EncodedScene& encoded, const v1::Limits& limits = default_limits()) {
  const BlobReader read_blob = [&](const Digest& digest) -> Result<std::string> {
    for (const EncodedBlob& blob : encoded.blobs) {
      if (blob.digest == digest) return blob.bytes;
    }
    return Error{ErrorCode::kNotFound, "no blob " + digest.sha256};
  };
  return decode_scene(encoded.blobs.back().bytes, read_blob, limits);
}

/// A bumpy sheet of n x n quads over [0, size]^2, with smooth normals and both texture coordinates.
inline Mesh bumpy_sheet(int n, double size, Vec3 corner = {}) {
  Mesh mesh;
  mesh.name = "sheet#0";
  for (int row = 0; row <= n; ++row) {
    for (int column = 0; column <= n; ++column) {
      const double u = static_cast<double>(column) / n, v = static_cast<double>(row) / n;
      const double height = 0.05 * size * std::sin(7 * u) * std::cos(5 * v);
      mesh.positions.push_back(corner + Vec3{size * u, size * v, height});
      const Vec3 normal{-0.05 * 7 * std::cos(7 * u) * std::cos(5 * v), 0.05 * 5 * std::sin(7 * u) * std::sin(5 * v), 1};
      mesh.normals.push_back(normalized(normal));
      mesh.texcoord0.push_back({3 * u, 3 * v});
      mesh.texcoord1.push_back({0.9 * u, 0.9 * v});
    }
  }
  for (int row = 0; row < n; ++row) {
    for (int column = 0; column < n; ++column) {
      const auto a = static_cast<std::uint32_t>(row * (n + 1) + column), b = a + 1;
      const std::uint32_t c = a + static_cast<std::uint32_t>(n) + 1, d = c + 1;
      mesh.triangles.push_back({a, b, d});
      mesh.triangles.push_back({a, d, c});
    }
  }
  return mesh;
}

/// One sheet, a textured material, one light of each kind and a sky.
inline Scene sheet_scene(int n = 8) {
  Scene scene;
  scene.meshes = {bumpy_sheet(n, 4)};
  scene.materials = {{.name = "paint",
                      .reflectance = {0.25, 0.5, 0.75},
                      .reflectance_texture = TextureReference{0, 0},
                      .emissive = {1, 2, 3},
                      .emissive_texture = TextureReference{1, 1},
                      .is_double_sided = true,
                      .alpha_mode = AlphaMode::kMask,
                      .alpha = 0.75,
                      .alpha_cutoff = 0.25}};
  scene.textures = {{.name = "wood", .width = 2, .height = 1, .channels = 3, .values = {0, 0.125F, 0.25F, 0.5F, 1, 2}},
                    {.name = "lamp",
                     .width = 1,
                     .height = 1,
                     .channels = 4,
                     .wrap_s = Wrap::kClamp,
                     .wrap_t = Wrap::kMirror,
                     .values = {1, 2, 3, 0.5F}}};
  scene.lights = {{"bulb", PointLight{{1, 2, 3}, {10, 20, 30}}},
                  {"spot", SpotLight{{4, 5, 6}, {0, 0, -1}, {1, 2, 3}, 0.25, 0.5}},
                  {"sun", DirectionalLight{{0, -1, 0}, {1000, 900, 800}}}};
  scene.sky = {5, 6, 7};
  return scene;
}

/// The same with a curtain for a sheet, and three luminaires of two kinds for lights.
inline Scene luminaire_scene() {
  Scene scene = sheet_scene();
  scene.materials[0].diffuse_transmittance = {0.5, 0.25, 0.125};
  scene.materials[0].diffuse_transmittance_texture = TextureReference{1, 1};
  const auto narrow = std::make_shared<const LightProfile>(LightProfile{{0, 30}, {0}, {100, 10}});
  const auto aside = std::make_shared<const LightProfile>(LightProfile{{0, 90}, {0, 180}, {1, 2, 3, 4}});
  scene.lights = {{"one", ProfileLight{{1, 2, 3}, {0, -1, 0}, {1, 0, 0}, {1, 0.5, 0.25}, narrow}},
                  {"two", ProfileLight{{4, 5, 6}, {0, -1, 0}, {0, 0, 1}, {2, 2, 2}, aside, true}},
                  {"three", ProfileLight{{7, 8, 9}, {0, -1, 0}, {1, 0, 0}, {1, 1, 1}, narrow}}};
  return scene;
}

/// The same under a sky of 4 x 2 directions, all of different light.
inline Scene environment_scene() {
  Scene scene = sheet_scene();
  scene.sky = {};
  scene.environment = TexturePlane{.name = "dawn", .width = 4, .height = 2, .channels = 3, .values = {}};
  for (int i = 0; i < 24; ++i) scene.environment->values.push_back(0.25F * static_cast<float>(i));
  return scene;
}

}  // namespace radbake
