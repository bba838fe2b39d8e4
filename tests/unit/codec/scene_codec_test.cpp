#include "common/codec/scene_codec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "common/base/limits.h"
#include "common/codec/grid.h"
#include "common/codec/mesh_codec.h"
#include "tests/unit/codec/codec_scenes.h"

namespace radbake {
namespace {

using ::testing::HasSubstr;

// Octahedral coordinates of 16 bits: half a cell is 1/65534, stretched by at most 3 on the sphere.
constexpr double kOctahedral16Bits = 1e-4;

double angle_between(Vec3 a, Vec3 b) { return std::atan2(length(cross(a, b)), dot(a, b)); }

TEST(SceneCodec, KeepsMaterialsTexturesLightsAndSky) {
  const Scene scene = sheet_scene();
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok()) << encoded.error().message;
  EXPECT_EQ(encoded->blobs.size(), 4U);
  EXPECT_EQ(encoded->blobs.back().digest, encoded->manifest);
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;

  const Material& material = decoded->materials.at(0);
  EXPECT_EQ(material.name, "paint");
  EXPECT_EQ(material.reflectance, (Vec3{0.25, 0.5, 0.75}));
  EXPECT_EQ(material.reflectance_texture->texture, 0);
  EXPECT_EQ(material.reflectance_texture->texcoord, 0);
  EXPECT_EQ(material.emissive, (Vec3{1, 2, 3}));
  EXPECT_EQ(material.emissive_texture->texture, 1);
  EXPECT_EQ(material.emissive_texture->texcoord, 1);
  EXPECT_TRUE(material.is_double_sided);
  EXPECT_EQ(material.alpha_mode, AlphaMode::kMask);
  EXPECT_EQ(material.alpha, 0.75);
  EXPECT_EQ(material.alpha_cutoff, 0.25);

  ASSERT_EQ(decoded->textures.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(decoded->textures[i].name, scene.textures[i].name);
    EXPECT_EQ(decoded->textures[i].values, scene.textures[i].values);
    EXPECT_EQ(decoded->textures[i].width, scene.textures[i].width);
    EXPECT_EQ(decoded->textures[i].channels, scene.textures[i].channels);
    EXPECT_EQ(decoded->textures[i].wrap_s, scene.textures[i].wrap_s);
    EXPECT_EQ(decoded->textures[i].wrap_t, scene.textures[i].wrap_t);
  }

  ASSERT_EQ(decoded->lights.size(), 3U);
  const auto& point = std::get<PointLight>(decoded->lights[0].kind);
  EXPECT_EQ(decoded->lights[0].name, "bulb");
  EXPECT_EQ(point.position, (Vec3{1, 2, 3}));
  EXPECT_EQ(point.intensity, (Vec3{10, 20, 30}));
  const auto& spot = std::get<SpotLight>(decoded->lights[1].kind);
  EXPECT_EQ(spot.position, (Vec3{4, 5, 6}));
  EXPECT_EQ(spot.direction, (Vec3{0, 0, -1}));
  EXPECT_EQ(spot.intensity, (Vec3{1, 2, 3}));
  EXPECT_EQ(spot.inner_cone_radians, 0.25);
  EXPECT_EQ(spot.outer_cone_radians, 0.5);
  const auto& sun = std::get<DirectionalLight>(decoded->lights[2].kind);
  EXPECT_EQ(sun.direction, (Vec3{0, -1, 0}));
  EXPECT_EQ(sun.illuminance, (Vec3{1000, 900, 800}));
  EXPECT_EQ(decoded->sky, (Vec3{5, 6, 7}));
}

TEST(SceneCodec, KeepsSheetsFlagsSunsDiscAndInstances) {
  Scene scene = sheet_scene();
  scene.materials[0].transmittance = {0.5, 0.25, 0.125};
  scene.num_instances = 12;
  std::get<DirectionalLight>(scene.lights[2].kind).angular_diameter_radians = 0.00925;
  // One flag at a time: none may stand for another.
  for (bool Material::*flag :
       {&Material::is_specular, &Material::is_refractive, &Material::has_normal_map, &Material::has_volume}) {
    Scene flagged = scene;
    flagged.materials[0].*flag = true;
    const auto encoded = encode_scene(flagged, {});
    ASSERT_TRUE(encoded.ok()) << encoded.error().message;
    const auto decoded = decode_encoded(*encoded);
    ASSERT_TRUE(decoded.ok()) << decoded.error().message;
    const Material &before = flagged.materials[0], &after = decoded->materials.at(0);
    EXPECT_EQ(after.transmittance, before.transmittance);
    EXPECT_EQ(after.is_specular, before.is_specular);
    EXPECT_EQ(after.is_refractive, before.is_refractive);
    EXPECT_EQ(after.has_normal_map, before.has_normal_map);
    EXPECT_EQ(after.has_volume, before.has_volume);
    EXPECT_EQ(std::get<DirectionalLight>(decoded->lights[2].kind).angular_diameter_radians, 0.00925);
    EXPECT_EQ(decoded->num_instances, 12U);
  }
}

TEST(SceneCodec, KeepsCurtainsAndLuminairesAndSendsEachProfileOnce) {
  const Scene scene = luminaire_scene();
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok()) << encoded.error().message;
  v1::SceneManifest manifest;
  ASSERT_TRUE(manifest.ParseFromString(encoded->blobs.back().bytes));
  EXPECT_EQ(manifest.light_profiles_size(), 2);
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;

  EXPECT_EQ(decoded->materials.at(0).diffuse_transmittance, (Vec3{0.5, 0.25, 0.125}));
  ASSERT_TRUE(decoded->materials[0].diffuse_transmittance_texture.has_value());
  EXPECT_EQ(decoded->materials[0].diffuse_transmittance_texture->texture, 1);
  EXPECT_EQ(decoded->materials[0].diffuse_transmittance_texture->texcoord, 1);

  ASSERT_EQ(decoded->lights.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(decoded->lights[i].name, scene.lights[i].name);
    const auto& before = std::get<ProfileLight>(scene.lights[i].kind);
    const auto& after = std::get<ProfileLight>(decoded->lights[i].kind);
    EXPECT_EQ(after.position, before.position);
    EXPECT_EQ(after.direction, before.direction);
    EXPECT_EQ(after.zero_side, before.zero_side);
    EXPECT_EQ(after.tint, before.tint);
    EXPECT_EQ(after.is_mirrored, before.is_mirrored);
    EXPECT_EQ(*after.profile, *before.profile);
  }
  EXPECT_EQ(std::get<ProfileLight>(decoded->lights[0].kind).profile,
            std::get<ProfileLight>(decoded->lights[2].kind).profile);
}

TEST(SceneCodec, KeepsASkyOfEveryDirection) {
  const Scene scene = environment_scene();
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok()) << encoded.error().message;
  EXPECT_EQ(encoded->blobs.size(), 5U);  // a mesh, two textures, the sky, the manifest
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  ASSERT_TRUE(decoded->environment.has_value());
  EXPECT_EQ(decoded->environment->name, "dawn");
  EXPECT_EQ(decoded->environment->width, 4);
  EXPECT_EQ(decoded->environment->height, 2);
  EXPECT_EQ(decoded->environment->channels, 3);
  EXPECT_EQ(decoded->environment->values, scene.environment->values);
  EXPECT_EQ(decoded->sky, Vec3{});
}

TEST(SceneCodec, ReadsManifestsOfTheTimeBeforeSheetsAndSkies) {
  v1::SceneManifest manifest;
  EncodedScene encoded = *encode_scene(sheet_scene(), {});
  ASSERT_TRUE(manifest.ParseFromString(encoded.blobs.back().bytes));
  // What was not there then is not sent: such scenes keep their bytes, and so their digests.
  EXPECT_FALSE(manifest.materials(0).has_transmittance());
  EXPECT_FALSE(manifest.has_environment());
  const auto decoded = decode_encoded(encoded);
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(decoded->materials[0].transmittance, Vec3{});
  EXPECT_FALSE(decoded->materials[0].is_specular || decoded->materials[0].has_volume);
  EXPECT_EQ(std::get<DirectionalLight>(decoded->lights[2].kind).angular_diameter_radians, 0);
  EXPECT_FALSE(decoded->environment.has_value());
  EXPECT_EQ(decoded->num_instances, 0U);
}

TEST(SceneCodec, EncodesTheSameSceneToTheSameBytes) {
  const auto first = encode_scene(sheet_scene(), {}), second = encode_scene(sheet_scene(), {});
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(first->manifest, second->manifest);
}

TEST(SceneCodec, MovesNoPositionByMoreThanAThousandthOfTheSmallTexel) {
  for (const double texels_per_meter : {0.5, 32.0, 1000.0, 2400.0}) {
    const Scene scene = sheet_scene();
    const auto encoded = encode_scene(scene, {.texels_per_meter = texels_per_meter});
    ASSERT_TRUE(encoded.ok());
    EXPECT_GT(encoded->transfer.position_bits(), 0U);
    EXPECT_LE(encoded->transfer.position_bits(), 24U);
    const auto decoded = decode_encoded(*encoded);
    ASSERT_TRUE(decoded.ok());
    double largest = 0;
    for (std::size_t i = 0; i < scene.meshes[0].positions.size(); ++i) {
      largest = std::max(largest, length(decoded->meshes[0].positions[i] - scene.meshes[0].positions[i]));
    }
    EXPECT_LE(largest * texels_per_meter, kPositionMoveTexels) << texels_per_meter;
    EXPECT_GT(largest, 0);
    EXPECT_NEAR(encoded->transfer.max_position_move_texels(), largest * texels_per_meter, 1e-12);
  }
}

TEST(SceneCodec, TakesMoreBitsForSmallerTexels) {
  const auto coarse = encode_scene(sheet_scene(), {.texels_per_meter = 1});
  const auto fine = encode_scene(sheet_scene(), {.texels_per_meter = 1024});
  ASSERT_TRUE(coarse.ok() && fine.ok());
  EXPECT_EQ(fine->transfer.position_bits(), coarse->transfer.position_bits() + 10);
}

TEST(SceneCodec, SendsFloat32WhereTexelsAreTooSmallForTheGrid) {
  // 24 bits reach 4 m with a step of 1/1000 texel up to 2400 texels a metre or so.
  const Scene scene = sheet_scene();
  const auto encoded = encode_scene(scene, {.texels_per_meter = 5000});
  ASSERT_TRUE(encoded.ok()) << encoded.error().message;
  EXPECT_EQ(encoded->transfer.position_bits(), 0U);
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok());
  for (std::size_t i = 0; i < scene.meshes[0].positions.size(); ++i) {
    // float32 of a coordinate within 2 m of the origin.
    EXPECT_LE(length(decoded->meshes[0].positions[i] - scene.meshes[0].positions[i]),
              std::sqrt(3.0) * std::ldexp(1.0, -24));
  }
}

TEST(SceneCodec, KeepsSharedBordersSharedOverAllMeshes) {
  // Meshes of very different size that meet in random points far from the origin of the world.
  std::mt19937 random(7);
  std::uniform_real_distribution<double> in_room(-5, 5);
  std::vector<Vec3> shared(60);
  for (Vec3& point : shared)
    point = Vec3{1000.1, -77.7, 12345.6} + Vec3{in_room(random), in_room(random), in_room(random)};
  Scene scene;
  scene.materials.resize(1);
  for (int i = 0; i < 4; ++i) {
    Mesh mesh;
    mesh.name = "soup" + std::to_string(i);
    for (int k = 0; k < 30; ++k) mesh.positions.push_back(shared[random() % shared.size()]);
    mesh.positions.push_back(shared[0] + Vec3{0.001, 100.0 * i, 0});
    for (std::uint32_t k = 0; k + 2 < mesh.positions.size(); ++k) mesh.triangles.push_back({k, k + 1, k + 2});
    scene.meshes.push_back(mesh);
  }
  for (const double texels_per_meter : {8.0, 1e9}) {
    const auto encoded = encode_scene(scene, {.texels_per_meter = texels_per_meter});
    ASSERT_TRUE(encoded.ok()) << encoded.error().message;
    const auto decoded = decode_encoded(*encoded);
    ASSERT_TRUE(decoded.ok()) << decoded.error().message;
    int num_equal = 0;
    for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
      for (std::size_t n = 0; n < m; ++n) {
        for (std::size_t i = 0; i < scene.meshes[m].positions.size(); ++i) {
          for (std::size_t k = 0; k < scene.meshes[n].positions.size(); ++k) {
            if (scene.meshes[m].positions[i] != scene.meshes[n].positions[k]) continue;
            ++num_equal;
            EXPECT_EQ(decoded->meshes[m].positions[i], decoded->meshes[n].positions[k]);
          }
        }
      }
    }
    EXPECT_GT(num_equal, 50);
  }
}

TEST(SceneCodec, LeavesRoundCoordinatesWhereTheyAre) {
  Scene scene;
  scene.materials.resize(1);
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {2.5, 0, 0.125}, {0, 7, 0}, {-3.75, 1.1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes = {mesh};
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok());
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(decoded->meshes[0].positions[i], mesh.positions[i]);
  EXPECT_EQ(decoded->meshes[0].positions[3].x, -3.75);
}

TEST(SceneCodec, TakesTheTexelFromTheLayoutAndTheAtlas) {
  // One square metre over a quarter of the atlas in each direction: 64 texels a metre at 256.
  Scene scene;
  scene.materials.resize(1);
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.texcoord1 = {{0, 0}, {0.25, 0}, {0.25, 0.25}, {0, 0.25}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene.meshes = {mesh};
  EXPECT_DOUBLE_EQ(choose_position_grid(scene, 256, 32)->texel_size, 1.0 / 64);
  EXPECT_DOUBLE_EQ(choose_position_grid(scene, 0, 32)->texel_size, 1.0 / 32);
  scene.meshes[0].texcoord1.clear();
  EXPECT_DOUBLE_EQ(choose_position_grid(scene, 256, 32)->texel_size, 1.0 / 32);
}

TEST(SceneCodec, TakesTheFifthPercentileOfTheTexels) {
  // 100 triangles, the k-th with k times as many metres a texel: the 5th percentile is the fifth smallest.
  Scene scene;
  scene.materials.resize(1);
  Mesh mesh;
  for (std::uint32_t k = 1; k <= 100; ++k) {
    const double size = k;
    mesh.positions.insert(mesh.positions.end(), {{0, 0, 0}, {size, 0, 0}, {0, size, 0}});
    mesh.texcoord1.insert(mesh.texcoord1.end(), {{0, 0}, {0.5, 0}, {0, 0.5}});
    mesh.triangles.push_back({3 * k - 3, 3 * k - 2, 3 * k - 1});
  }
  scene.meshes = {mesh};
  EXPECT_DOUBLE_EQ(choose_position_grid(scene, 64, 32)->texel_size, 5.0 / 32);
}

TEST(SceneCodec, MovesNoTextureCoordinateByMoreThanAHundredthOfATexel) {
  const Scene scene = sheet_scene();
  for (const int atlas_size : {0, 64, 4096}) {
    const auto encoded = encode_scene(scene, {.atlas_size = atlas_size});
    ASSERT_TRUE(encoded.ok());
    const auto decoded = decode_encoded(*encoded);
    ASSERT_TRUE(decoded.ok());
    double largest = 0;
    for (std::size_t i = 0; i < scene.meshes[0].texcoord1.size(); ++i) {
      const Vec2 move1 = decoded->meshes[0].texcoord1[i] - scene.meshes[0].texcoord1[i];
      const Vec2 move0 = decoded->meshes[0].texcoord0[i] - scene.meshes[0].texcoord0[i];
      largest = std::max(largest, std::hypot(move1.x, move1.y) * (atlas_size == 0 ? 4096 : atlas_size));
      largest = std::max(largest, std::hypot(move0.x, move0.y) * scene.textures[0].width);
    }
    EXPECT_LE(largest, kUvMoveTexels);
    EXPECT_GT(largest, 0);
    EXPECT_NEAR(encoded->transfer.max_uv_move_texels(), largest, 1e-9);
    EXPECT_EQ(encoded->transfer.num_meshes_uv_unquantised(), 0U);
  }
}

TEST(SceneCodec, SendsTextureCoordinatesAsFloat32WhereTheGridDoesNotReach) {
  Scene scene = sheet_scene();
  scene.meshes.push_back(bumpy_sheet(2, 1));
  for (Vec2& texcoord : scene.meshes[1].texcoord1) texcoord = texcoord + Vec2{1e6, 0};
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok()) << encoded.error().message;
  EXPECT_EQ(encoded->transfer.num_meshes_uv_unquantised(), 1U);
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok());
  for (std::size_t i = 0; i < scene.meshes[1].texcoord1.size(); ++i) {
    EXPECT_EQ(decoded->meshes[1].texcoord1[i].x, static_cast<float>(scene.meshes[1].texcoord1[i].x));
    EXPECT_EQ(decoded->meshes[1].texcoord1[i].y, static_cast<float>(scene.meshes[1].texcoord1[i].y));
  }
}

TEST(SceneCodec, KeepsVertexColoursToTheLastBit) {
  Scene scene = sheet_scene();
  Mesh& mesh = scene.meshes[0];
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    const auto channel = [i](std::size_t period) {
      return static_cast<float>(i % period) / static_cast<float>(period);
    };
    mesh.colors.push_back({channel(3), channel(7), channel(255)});
  }
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok()) << encoded.error().message;
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  EXPECT_EQ(decoded->meshes[0].colors, mesh.colors);
}

TEST(SceneCodec, KeepsTheTransformOfATexturesCoordinates) {
  Scene scene = sheet_scene();
  const UvTransform transform{{0.5, 0.25}, {-0.125, 3}, {0.1, -7}};
  scene.materials[0].emissive_texture->transform = transform;
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok()) << encoded.error().message;
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  EXPECT_EQ(decoded->materials[0].emissive_texture->transform, transform);
  EXPECT_EQ(decoded->materials[0].reflectance_texture->transform, UvTransform{});
}

TEST(SceneCodec, SendsNothingNewForScenesWithoutColoursAndTransforms) {
  v1::SceneManifest manifest;
  ASSERT_TRUE(manifest.ParseFromString(encode_scene(sheet_scene(), {})->blobs.back().bytes));
  EXPECT_FALSE(manifest.meshes(0).has_colors());
  EXPECT_FALSE(manifest.materials(0).reflectance_texture().has_transform());
}

TEST(SceneCodec, BoundsTheMoveOfATextureCoordinateAfterItsTransform) {
  // A texture of 2 x 1 texels, repeated 1000 times one way: the largest singular value is 1000.
  Scene scene = sheet_scene(7);  // sevenths are on no grid
  scene.materials[0].reflectance_texture->transform = {{600, 800}, {-0.8, 0.6}, {5, 5}};
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok()) << encoded.error().message;
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok());
  double largest = 0;
  for (std::size_t i = 0; i < scene.meshes[0].texcoord0.size(); ++i) {
    const auto& transform = scene.materials[0].reflectance_texture->transform;
    const Vec2 move = transform.apply(decoded->meshes[0].texcoord0[i]) - transform.apply(scene.meshes[0].texcoord0[i]);
    largest = std::max(largest, std::hypot(move.x, move.y) * scene.textures[0].width);
  }
  EXPECT_LE(largest, kUvMoveTexels);
  EXPECT_GT(largest, kUvMoveTexels / 100);
}

TEST(SceneCodec, SendsCoordinatesThatATransformTakesToOnePoint) {
  Scene scene = sheet_scene();
  scene.materials[0].reflectance_texture->transform = {{0, 0}, {0, 0}, {0.5, 0.5}};
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok()) << encoded.error().message;
  EXPECT_TRUE(decode_encoded(*encoded).ok());
}

TEST(SceneCodec, SendsTexcoord0OnlyWhereATextureUsesIt) {
  Scene scene = sheet_scene();
  scene.materials[0].reflectance_texture.reset();
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok());
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok());
  EXPECT_TRUE(decoded->meshes[0].texcoord0.empty());
  EXPECT_EQ(decoded->meshes[0].texcoord1.size(), scene.meshes[0].texcoord1.size());
}

TEST(SceneCodec, KeepsSmoothNormals) {
  const Scene scene = sheet_scene();
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok());
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok());
  ASSERT_EQ(decoded->meshes[0].normals.size(), scene.meshes[0].normals.size());
  for (std::size_t i = 0; i < scene.meshes[0].normals.size(); ++i) {
    EXPECT_LE(angle_between(decoded->meshes[0].normals[i], scene.meshes[0].normals[i]), kOctahedral16Bits);
  }
}

TEST(SceneCodec, DropsNormalsThatTheTrianglesHaveAnyway) {
  Scene scene = sheet_scene();
  for (Vec3& position : scene.meshes[0].positions) position.z = 0;
  for (Vec3& normal : scene.meshes[0].normals) normal = normalized({1e-4, 0, 1});
  const auto flat = encode_scene(scene, {});
  ASSERT_TRUE(flat.ok());
  EXPECT_TRUE(decode_encoded(*flat)->meshes[0].normals.empty());
  scene.meshes[0].normals[5] = normalized({0.01, 0, 1});
  const auto tilted = encode_scene(scene, {});
  ASSERT_TRUE(tilted.ok());
  EXPECT_FALSE(decode_encoded(*tilted)->meshes[0].normals.empty());
}

TEST(SceneCodec, GivesZeroNormalsTheNormalOfATriangle) {
  Scene scene = sheet_scene();
  scene.meshes[0].normals[0] = {};
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok());
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  const Mesh& mesh = scene.meshes[0];
  const auto& [a, b, c] = mesh.triangles[0];
  const Vec3 face = cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
  EXPECT_LE(angle_between(decoded->meshes[0].normals[0], face), kOctahedral16Bits);
}

TEST(SceneCodec, KeepsTheNumbersOfVerticesThatAreNotSent) {
  Scene scene;
  scene.materials.resize(1);
  Mesh mesh;
  mesh.positions.assign(1000, Vec3{NAN, 0, 0});
  mesh.positions[10] = {0, 0, 0};
  mesh.positions[500] = {1, 0, 0};
  mesh.positions[999] = {0, 1, 0};
  mesh.triangles = {{999, 10, 500}};
  scene.meshes = {mesh};
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok()) << encoded.error().message;
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok()) << decoded.error().message;
  ASSERT_EQ(decoded->meshes[0].positions.size(), 1000U);
  EXPECT_EQ(decoded->meshes[0].positions[500], (Vec3{1, 0, 0}));
  EXPECT_THAT(decoded->meshes[0].triangles, ::testing::ElementsAre(std::array<std::uint32_t, 3>{10, 500, 999}));
  // Those that are not sent do not stretch the bounding box.
  EXPECT_EQ(decoded->meshes[0].positions[0], (Vec3{0.5, 0.5, 0}));
}

TEST(SceneCodec, KeepsTheTrianglesOfRandomSoups) {
  // Few vertices and many triangles: edges of many faces, faces twice, faces turned over, islands, fans through a
  // vertex, faces that use a vertex twice. None of them may be lost, doubled or turned, but for the last kind.
  std::mt19937 random(11);
  for (int round = 0; round < 400; ++round) {
    const std::uint32_t num_vertices = 3 + random() % 40;
    const std::uint32_t num_triangles = 1 + random() % 120;
    Scene scene;
    scene.materials.resize(1);
    Mesh mesh;
    for (std::uint32_t i = 0; i < num_vertices; ++i) {
      // Coarse positions, so that many vertices share one.
      mesh.positions.push_back({random() % 5 * 0.3, random() % 5 * 0.3, random() % 3 * 0.3});
    }
    mesh.positions[0] = {0, 0, 0};
    mesh.positions[1] = {1, 0, 0};
    mesh.positions[2] = {0, 1, 0};
    mesh.triangles = {{0, 1, 2}};
    for (std::uint32_t i = 1; i < num_triangles; ++i) {
      const auto corner = [&] { return static_cast<std::uint32_t>(random() % num_vertices); };
      std::array<std::uint32_t, 3> triangle = {corner(), corner(), corner()};
      if (random() % 8 == 0) triangle = mesh.triangles[random() % mesh.triangles.size()];
      if (random() % 16 == 0) std::swap(triangle[0], triangle[1]);
      mesh.triangles.push_back(triangle);
    }
    scene.meshes = {mesh};
    const auto encoded = encode_scene(scene, {});
    ASSERT_TRUE(encoded.ok()) << "round " << round << ": " << encoded.error().message;
    const auto decoded = decode_encoded(*encoded);
    ASSERT_TRUE(decoded.ok()) << "round " << round << ": " << decoded.error().message;
    ASSERT_EQ(decoded->meshes[0].triangles, canonical_triangles(mesh.triangles)) << "round " << round;
  }
}

TEST(SceneCodec, OrdersTrianglesByTheirVertices) {
  const Triangles triangles = {{5, 3, 4}, {2, 1, 0}, {7, 7, 1}, {3, 4, 5}, {0, 1, 2}};
  const Triangles expected = {{0, 1, 2}, {0, 2, 1}, {3, 4, 5}, {3, 4, 5}};
  EXPECT_EQ(canonical_triangles(triangles), expected);
}

TEST(SceneCodec, SendsEqualBlobsOnce) {
  Scene scene = sheet_scene();
  scene.meshes.push_back(scene.meshes[0]);
  scene.meshes[1].name = "again#0";
  scene.textures.push_back(scene.textures[0]);
  const auto encoded = encode_scene(scene, {});
  ASSERT_TRUE(encoded.ok());
  EXPECT_EQ(encoded->blobs.size(), 4U);
  const auto decoded = decode_encoded(*encoded);
  ASSERT_TRUE(decoded.ok());
  EXPECT_EQ(decoded->meshes.at(1).name, "again#0");
  EXPECT_EQ(decoded->textures.size(), 3U);
}

TEST(SceneCodec, RefusesToEncodeWhatIsNoScene) {
  const auto message_of = [](const Scene& scene) {
    const auto encoded = encode_scene(scene, {});
    return encoded.ok() ? "encoded" : encoded.error().message;
  };
  EXPECT_THAT(message_of({}), HasSubstr("no triangle with an area"));
  Scene scene = sheet_scene();
  scene.meshes[0].triangles[3][1] = 12345;
  EXPECT_THAT(message_of(scene), HasSubstr("mesh 'sheet#0' has index 12345 in triangle 3 of 81 vertices"));
  scene = sheet_scene();
  scene.meshes[0].positions[4].y = INFINITY;
  EXPECT_THAT(message_of(scene), HasSubstr("mesh 'sheet#0' has a position that is not finite at vertex 4"));
  scene = sheet_scene();
  scene.meshes[0].material = 1;
  EXPECT_THAT(message_of(scene), HasSubstr("mesh 'sheet#0' has material 1 of 1"));
  scene = sheet_scene();
  scene.meshes[0].normals.pop_back();
  EXPECT_THAT(message_of(scene), HasSubstr("has an attribute of 80 values for 81 vertices"));
  scene = sheet_scene();
  for (Vec3& position : scene.meshes[0].positions) position.y = 0, position.z = 0;
  EXPECT_THAT(message_of(scene), HasSubstr("no triangle with an area"));
  scene = luminaire_scene();
  std::get<ProfileLight>(scene.lights[1].kind).profile.reset();
  EXPECT_THAT(message_of(scene), HasSubstr("light 'two' has no profile"));
  scene = environment_scene();
  scene.environment->channels = 4;
  EXPECT_THAT(message_of(scene), HasSubstr("the environment 'dawn' has 4 channels: must be 3"));
  scene = environment_scene();
  scene.environment->height = 1;
  EXPECT_THAT(message_of(scene), HasSubstr("the environment 'dawn' is 4 x 1 pixels: must be twice as wide as high"));
  scene = environment_scene();
  scene.environment->values.pop_back();
  EXPECT_THAT(message_of(scene), HasSubstr("the environment 'dawn' has 23 values, its size needs 24"));
}

TEST(Grid, HoldsEveryIndexOfItsExtentExactly) {
  for (const double extent : {1e-3, 1.0, 250.0, 1e5}) {
    for (const double move : {1e-9, 1e-6, 1e-3}) {
      const Grid grid = choose_grid(extent, move);
      if (!grid.is_quantised()) {
        EXPECT_GT(extent / (4 * move), std::ldexp(1.0, 22));
        continue;
      }
      EXPECT_LE(grid.bits, 24);
      EXPECT_LE(grid.step / 2, move);
      EXPECT_GT(grid.step, move);
      EXPECT_LT(extent / grid.step + 1, std::ldexp(1.0, grid.bits - 1));
    }
  }
}

TEST(Limits, DefaultsArePassedOn) {
  EXPECT_EQ(default_limits().max_triangles(), Limits{}.max_triangles);
  EXPECT_EQ(default_limits().chunk_bytes(), Limits{}.chunk_bytes);
}

}  // namespace
}  // namespace radbake
