#include <draco/compression/decode.h>
#include <draco/compression/encode.h>
#include <gmock/gmock.h>
#include <google/protobuf/stubs/logging.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>

#include "common/codec/draco_peek.h"
#include "common/codec/mesh_codec.h"
#include "common/codec/scene_codec.h"
#include "tests/fuzz/attacks.h"
#include "tests/unit/codec/codec_scenes.h"

namespace radbake {
namespace {

using ::testing::HasSubstr;

v1::SceneManifest manifest_of(const EncodedScene& encoded) {
  v1::SceneManifest manifest;
  EXPECT_TRUE(manifest.ParseFromString(encoded.blobs.back().bytes));
  return manifest;
}

/// Decodes a scene whose manifest was changed; blobs stay.
Result<Scene> decode_changed(const std::function<void(v1::SceneManifest&)>& change,
                             const v1::Limits& limits = default_limits(), const Scene& scene = sheet_scene()) {
  EncodedScene encoded = *encode_scene(scene, {});
  v1::SceneManifest manifest = manifest_of(encoded);
  change(manifest);
  encoded.blobs.back().bytes = manifest.SerializeAsString();
  return decode_encoded(encoded, limits);
}

std::string message_of(const Result<Scene>& scene) { return scene.ok() ? "decoded" : scene.error().message; }

/// Decodes a scene of one mesh with this blob.
Result<Scene> decode_blob(const std::string& bytes, v1::MeshRecord record) {
  EncodedScene encoded;
  encoded.blobs.push_back({digest_of(bytes), bytes});
  record.set_name("node/wall#0");
  record.mutable_blob()->set_sha256(encoded.blobs[0].digest.sha256);
  record.mutable_blob()->set_size_bytes(bytes.size());
  v1::SceneManifest manifest;
  *manifest.add_meshes() = record;
  manifest.add_materials()->mutable_reflectance()->set_r(0.5);
  encoded.blobs.emplace_back().bytes = manifest.SerializeAsString();
  return decode_encoded(encoded);
}

TEST(UntrustedScene, RefusesABombBeforeItTakesMemory) {
  v1::MeshRecord record;
  record.set_num_vertices(4);
  record.set_num_triangles(2);
  rusage before{};
  getrusage(RUSAGE_SELF, &before);
  EXPECT_EQ(message_of(decode_blob(attacks::draco_bomb(50'000'000), record)),
            "mesh 'node/wall#0' has 50000000 triangles, its record says 2");
  rusage after{};
  getrusage(RUSAGE_SELF, &after);
  // Draco takes 1151 MB for it. Kilobytes; far above noise, far below that.
  constexpr long kFiftyMegabytes = 50 * 1024;
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, kFiftyMegabytes);
}

TEST(UntrustedScene, RefusesABombThatItsRecordVouchesFor) {
  v1::MeshRecord record;
  record.set_num_vertices(4);
  record.set_num_triangles(100'000);
  EXPECT_THAT(message_of(decode_blob(attacks::draco_bomb(100'000), record)),
              HasSubstr("mesh 'node/wall#0' does not decode"));
}

TEST(UntrustedScene, SaysWhatIsWrongWithADracoHead) {
  const auto head = [](std::initializer_list<int> bytes) {
    std::string blob = "DRACO";
    for (const int byte : bytes) blob.push_back(static_cast<char>(byte));
    return peek_draco(blob);
  };
  EXPECT_THAT(peek_draco("OBJ").error().message, HasSubstr("not a Draco file"));
  EXPECT_THAT(head({1, 3, 1, 1, 0, 0}).error().message, HasSubstr("is Draco 1.3, not 2.2"));
  EXPECT_THAT(head({2, 2, 0, 1, 0, 0}).error().message, HasSubstr("not a triangle mesh"));
  EXPECT_THAT(head({2, 2, 1, 1, 0, 0x80}).error().message, HasSubstr("metadata"));
  EXPECT_THAT(head({2, 2, 1, 2, 0, 0}).error().message, HasSubstr("unknown Draco method 2"));
  EXPECT_THAT(head({2, 2, 1, 1, 0, 0, 1}).error().message, HasSubstr("unknown edgebreaker traversal 1"));
  EXPECT_THAT(head({2, 2, 1, 1, 0, 0, 0, 0x80}).error().message, HasSubstr("ends within its head"));
  EXPECT_THAT(head({2, 2, 1, 0, 0, 0, 0xff, 0xff, 0xff, 0xff, 0xff, 1}).error().message, HasSubstr("ends within"));
  const auto sequential = head({2, 2, 1, 0, 0, 0, 0x81, 0x02, 0x05});
  ASSERT_TRUE(sequential.ok());
  EXPECT_EQ(sequential->num_faces, 257U);
  EXPECT_EQ(sequential->num_points, 5U);
  const auto edgebreaker = head({2, 2, 1, 1, 0, 0, 2, 6, 8, 3, 8, 1});
  ASSERT_TRUE(edgebreaker.ok());
  EXPECT_EQ(edgebreaker->num_points, 6U);
  EXPECT_EQ(edgebreaker->num_faces, 8U);
  EXPECT_EQ(edgebreaker->num_connectivities, 3U);
  EXPECT_EQ(edgebreaker->num_split_symbols, 1U);
}

TEST(UntrustedScene, HoldsEveryMeshAgainstItsRecord) {
  using M = v1::SceneManifest;
  const auto changed = [](auto change) {
    return message_of(decode_changed([&](M& manifest) { change(*manifest.mutable_meshes(0)); }));
  };
  EXPECT_THAT(changed([](auto& mesh) { mesh.set_num_triangles(127); }),
              HasSubstr("mesh 'sheet#0' has 128 triangles, its record says 127"));
  EXPECT_THAT(changed([](auto& mesh) { mesh.set_num_triangles(0); }), HasSubstr("mesh 'sheet#0' has no triangle"));
  EXPECT_THAT(changed([](auto& mesh) { mesh.set_num_vertices(80); }),
              HasSubstr("mesh 'sheet#0' has vertex id 80 of 80 vertices"));
  EXPECT_THAT(changed([](auto& mesh) { mesh.set_has_normals(false); }),
              HasSubstr("mesh 'sheet#0' has 5 attributes, its record says 4"));
  EXPECT_THAT(changed([](auto& mesh) { mesh.set_material(1); }), HasSubstr("mesh 'sheet#0' has material 1 of 1"));
  EXPECT_THAT(changed([](auto& mesh) { mesh.mutable_blob()->set_sha256("../../etc/passwd"); }),
              HasSubstr("mesh 'sheet#0'"));
  EXPECT_THAT(changed([](auto& mesh) { mesh.mutable_blob()->set_size_bytes(5); }),
              HasSubstr("mesh 'sheet#0': no blob"));
}

TEST(UntrustedScene, RefusesAttributesOfTheWrongKind) {
  // Both texture coordinates are there, but under one flag less and one normal more.
  Scene scene = sheet_scene();
  scene.meshes[0].normals.clear();
  EncodedScene encoded = *encode_scene(scene, {});
  v1::SceneManifest manifest = manifest_of(encoded);
  manifest.mutable_meshes(0)->set_has_texcoord0(false);
  manifest.mutable_meshes(0)->set_has_normals(true);
  encoded.blobs.back().bytes = manifest.SerializeAsString();
  EXPECT_THAT(message_of(decode_encoded(encoded)), HasSubstr("mesh 'sheet#0' has no attribute normal"));
}

TEST(UntrustedScene, HoldsAttributesAgainstTheRecordBeforeItDecodesThem) {
  // Their heads are there, of their values the last are not: Draco alone would say that it does not decode.
  EncodedScene encoded = *encode_scene(sheet_scene(), {});
  v1::SceneManifest manifest = manifest_of(encoded);
  std::string& blob = encoded.blobs[0].bytes;
  blob.resize(blob.size() * 3 / 4);
  encoded.blobs[0].digest.size_bytes = blob.size();
  manifest.mutable_meshes(0)->mutable_blob()->set_size_bytes(blob.size());
  encoded.blobs.back().bytes = manifest.SerializeAsString();
  EXPECT_THAT(message_of(decode_encoded(encoded)), HasSubstr("mesh 'sheet#0' does not decode"));

  manifest.mutable_meshes(0)->set_has_normals(false);
  encoded.blobs.back().bytes = manifest.SerializeAsString();
  EXPECT_THAT(message_of(decode_encoded(encoded)), HasSubstr("mesh 'sheet#0' has 5 attributes, its record says 4"));
}

TEST(UntrustedScene, RefusesTextureCoordinatesThatArePredictedByPositions) {
  // The same mesh encoded anew, as a stranger may: Draco takes its word for the length of such a prediction.
  EncodedScene encoded = *encode_scene(sheet_scene(), {});
  const auto encode_again = [&](int speed) {
    draco::DecoderBuffer sheet;
    sheet.Init(encoded.blobs[0].bytes.data(), encoded.blobs[0].bytes.size());
    const auto mesh = std::move(draco::Decoder().DecodeMeshFromBuffer(&sheet)).value();
    draco::Encoder encoder;
    encoder.SetSpeedOptions(speed, speed);
    for (const auto type : {draco::GeometryAttribute::POSITION, draco::GeometryAttribute::TEX_COORD}) {
      encoder.SetAttributeQuantization(type, 12);
    }
    draco::EncoderBuffer buffer;
    EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
    EncodedScene changed = encoded;
    changed.blobs[0].bytes.assign(buffer.data(), buffer.size());
    changed.blobs[0].digest.size_bytes = buffer.size();
    v1::SceneManifest manifest = manifest_of(encoded);
    manifest.mutable_meshes(0)->mutable_blob()->set_size_bytes(buffer.size());
    changed.blobs.back().bytes = manifest.SerializeAsString();
    return message_of(decode_encoded(changed));
  };
  EXPECT_EQ(encode_again(5), "decoded");
  EXPECT_THAT(encode_again(0), HasSubstr("mesh 'sheet#0' does not decode"));
}

TEST(UntrustedScene, RefusesATextureCoordinateThatIsNotThere) {
  Scene scene = sheet_scene();
  scene.materials[0].reflectance_texture.reset();
  EncodedScene encoded = *encode_scene(scene, {});
  v1::SceneManifest manifest = manifest_of(encoded);
  manifest.mutable_materials(0)->mutable_reflectance_texture()->set_texture(0);
  encoded.blobs.back().bytes = manifest.SerializeAsString();
  EXPECT_THAT(message_of(decode_encoded(encoded)), HasSubstr("mesh 'sheet#0' has no texcoord 0"));
}

TEST(UntrustedScene, RefusesATransformOfCoordinatesThatIsNotFinite) {
  for (const double value : {std::numeric_limits<double>::quiet_NaN(), 1e300}) {
    const auto scene = decode_changed([&](v1::SceneManifest& manifest) {
      auto& transform = *manifest.mutable_materials(0)->mutable_emissive_texture()->mutable_transform();
      transform.mutable_x_axis()->set_x(1);
      transform.mutable_offset()->set_y(value);
    });
    EXPECT_THAT(message_of(scene), HasSubstr("material 'paint' transforms texture coordinates by (1, 0)"));
  }
}

TEST(UntrustedScene, RefusesColoursOutsideZeroToOne) {
  // The encoder holds what it sends against the decoder.
  Scene scene = sheet_scene();
  scene.meshes[0].colors.assign(scene.meshes[0].positions.size(), {1, 1, 1});
  scene.meshes[0].colors[40] = {0, 0, 1.5};
  const auto encoded = encode_scene(scene, {});
  ASSERT_FALSE(encoded.ok());
  EXPECT_THAT(encoded.error().message, HasSubstr("mesh 'sheet#0' has a colour outside 0 to 1 at vertex 40"));
}

TEST(UntrustedScene, RefusesPositionsThatAreNotFinite) {
  // float32 positions travel raw: put a NaN over the first coordinate of the blob that equals a known one.
  Scene scene = sheet_scene();
  EncodedScene encoded = *encode_scene(scene, {.texels_per_meter = 1e9});
  std::string& bytes = encoded.blobs[0].bytes;
  const float known = static_cast<float>(scene.meshes[0].positions[40].x - manifest_of(encoded).origin().x());
  const auto at = bytes.find(std::string(reinterpret_cast<const char*>(&known), sizeof known));
  ASSERT_NE(at, std::string::npos);
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::memcpy(bytes.data() + at, &nan, sizeof nan);
  EXPECT_THAT(message_of(decode_encoded(encoded)), HasSubstr("mesh 'sheet#0' has a position that is not finite"));
}

TEST(UntrustedScene, NamesTheLimitAndTheValue) {
  const auto limited = [](auto set_limit) {
    v1::Limits limits = default_limits();
    set_limit(limits);
    const auto scene = decode_changed([](auto&) {}, limits);
    EXPECT_FALSE(scene.ok());
    EXPECT_EQ(scene.error().code, ErrorCode::kResourceExhausted);
    return message_of(scene);
  };
  EXPECT_EQ(limited([](auto& l) { l.set_max_meshes(0); }), "the scene has 1 meshes; max_meshes is 0");
  EXPECT_EQ(limited([](auto& l) { l.set_max_textures(1); }), "the scene has 2 textures; max_textures is 1");
  EXPECT_EQ(limited([](auto& l) { l.set_max_lights(2); }), "the scene has 3 lights; max_lights is 2");
  EXPECT_EQ(limited([](auto& l) { l.set_max_vertices(80); }), "the scene has 81 vertices; max_vertices is 80");
  EXPECT_EQ(limited([](auto& l) { l.set_max_triangles(100); }), "the scene has 128 triangles; max_triangles is 100");
  EXPECT_EQ(limited([](auto& l) { l.set_max_texture_pixels(1); }),
            "texture 'wood' is 2 x 1 = 2 pixels; max_texture_pixels is 1");
  EXPECT_THAT(limited([](auto& l) { l.set_max_blob_bytes(10); }), HasSubstr("max_blob_bytes is 10"));
  EXPECT_THAT(limited([](auto& l) { l.set_max_manifest_bytes(10); }), HasSubstr("max_manifest_bytes is 10"));
}

/// A change of a good manifest, and what the error says of it.
struct Case {
  std::function<void(v1::SceneManifest&)> change;
  const char* message;
};

TEST(UntrustedScene, ChecksEveryValueOfTheManifest) {
  using M = v1::SceneManifest;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Case cases[] = {
      {[](M& m) { m.clear_meshes(); }, "the scene has no mesh"},
      {[=](M& m) { m.mutable_origin()->set_y(nan); }, "the origin has position (2, nan,"},
      {[](M& m) { m.mutable_sky()->set_b(-1); }, "the sky has luminance (5, 6, -1)"},
      {[](M& m) { m.mutable_materials(0)->mutable_reflectance()->set_g(1); },
       "material 'paint' has reflectance (0.25, 1, 0.75)"},
      {[](M& m) { m.mutable_materials(0)->mutable_reflectance()->set_g(-0.1); }, "has reflectance (0.25, -0.1, 0.75)"},
      {[=](M& m) { m.mutable_materials(0)->mutable_emissive()->set_r(nan); },
       "material 'paint' has emission (nan, 2, 3)"},
      {[](M& m) { m.mutable_materials(0)->mutable_emissive_texture()->set_texture(2); },
       "material 'paint' uses texture 2 of 2"},
      {[](M& m) { m.mutable_materials(0)->mutable_emissive_texture()->set_texcoord(2); },
       "material 'paint' uses texcoord 2"},
      {[](M& m) { m.mutable_materials(0)->set_alpha(1.5); }, "material 'paint' has alpha 1.5"},
      {[](M& m) { m.mutable_materials(0)->set_alpha_cutoff(-1); }, "material 'paint' has alpha cutoff -1"},
      {[](M& m) { m.mutable_materials(0)->set_alpha_mode(static_cast<v1::AlphaMode>(7)); },
       "material 'paint' has alpha mode 7"},
      {[](M& m) { m.mutable_textures(0)->set_channels(2); }, "texture 'wood' has 2 channels"},
      {[](M& m) { m.mutable_textures(0)->set_width(0); }, "texture 'wood' is 0 x 1 pixels"},
      {[](M& m) { m.mutable_textures(0)->set_height(3); }, "texture 'wood' has a blob of 24 bytes"},
      {[](M& m) { m.mutable_textures(0)->set_width(0xffffffff), m.mutable_textures(0)->set_height(0xffffffff); },
       "max_texture_pixels"},
      {[](M& m) { m.mutable_textures(0)->set_wrap_t(static_cast<v1::Wrap>(9)); },
       "texture 'wood' has wrap modes 0 and 9"},
      {[](M& m) { m.mutable_lights(0)->clear_kind(); }, "light 'bulb' is of no kind"},
      {[](M& m) { m.mutable_lights(0)->mutable_point()->mutable_intensity()->set_r(-2); },
       "light 'bulb' has intensity (-2, 20, 30)"},
      {[=](M& m) { m.mutable_lights(0)->mutable_point()->mutable_position()->set_x(nan); },
       "light 'bulb' has position (nan, 2, 3)"},
      {[](M& m) { m.mutable_lights(1)->mutable_spot()->mutable_direction()->set_z(-2); },
       "light 'spot' has direction (0, 0, -2)"},
      {[](M& m) { m.mutable_lights(1)->mutable_spot()->set_outer_cone_radians(1.6); },
       "light 'spot' has cones of 0.25 and 1.6 rad"},
      {[](M& m) { m.mutable_lights(1)->mutable_spot()->set_inner_cone_radians(0.6); },
       "light 'spot' has cones of 0.6 and 0.5 rad"},
      {[=](M& m) { m.mutable_lights(2)->mutable_directional()->mutable_direction()->set_y(nan); },
       "light 'sun' has direction (0, nan, 0)"},
      {[](M& m) { m.mutable_lights(2)->mutable_directional()->mutable_illuminance()->set_g(-1); },
       "light 'sun' has illuminance (1000, -1, 800)"},
      {[=](M& m) { m.mutable_lights(2)->mutable_directional()->set_angular_diameter_radians(nan); },
       "light 'sun' has an angular diameter of nan rad"},
      {[](M& m) { m.mutable_lights(2)->mutable_directional()->set_angular_diameter_radians(-0.5); },
       "light 'sun' has an angular diameter of -0.5 rad"},
      {[](M& m) { m.mutable_lights(2)->mutable_directional()->set_angular_diameter_radians(3.1416); },
       "light 'sun' has an angular diameter of 3.1416 rad"},
      {[](M& m) { m.mutable_materials(0)->mutable_transmittance()->set_g(-0.1); },
       "material 'paint' has transmittance (0, -0.1, 0)"},
      {[=](M& m) { m.mutable_materials(0)->mutable_transmittance()->set_b(nan); },
       "material 'paint' has transmittance (0, 0, nan)"},
      {[](M& m) { m.mutable_materials(0)->mutable_transmittance()->set_b(0.2501); },
       "material 'paint' reflects (0.25, 0.5, 0.75) and lets (0, 0, 0.2501) through: more than 1 together"},
  };
  for (const Case& c : cases) EXPECT_THAT(message_of(decode_changed(c.change)), HasSubstr(c.message));
}

TEST(UntrustedScene, RefusesTexelsThatAreNoLight) {
  for (const float bad : {-1.0F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    Scene scene = sheet_scene();
    scene.textures[0].values[4] = bad;
    EXPECT_THAT(message_of(decode_encoded(*encode_scene(scene, {}))), HasSubstr("at pixel (1, 0)"));
  }
}

TEST(UntrustedScene, ChecksEveryValueOfASky) {
  using M = v1::SceneManifest;
  const Case cases[] = {
      {[](M& m) { m.mutable_environment()->set_width(0); }, "the environment 'dawn' is 0 x 2 pixels: it has none"},
      {[](M& m) { m.mutable_environment()->set_height(3); },
       "the environment 'dawn' has a blob of 96 bytes, 4 x 3 x 3 floats are 144"},
      {[](M& m) { m.mutable_environment()->set_width(2), m.mutable_environment()->set_height(4); },
       "the environment 'dawn' is 2 x 4 pixels: must be twice as wide as high"},
      {[](M& m) { m.mutable_environment()->set_width(0xffffffff), m.mutable_environment()->set_height(0xffffffff); },
       "max_texture_pixels"},
      {[](M& m) { m.mutable_environment()->mutable_blob()->set_sha256("../x"); }, "the environment 'dawn': "},
      {[](M& m) { *m.mutable_environment()->mutable_blob() = m.textures(0).blob(); },
       "the environment 'dawn' has a blob of 24 bytes"},
      {[](M& m) { m.mutable_sky()->set_g(1); }, "the scene has a constant sky and an environment"},
  };
  for (const Case& c : cases) {
    EXPECT_THAT(message_of(decode_changed(c.change, default_limits(), environment_scene())), HasSubstr(c.message));
  }
  v1::Limits limits = default_limits();
  limits.set_max_texture_pixels(7);
  EXPECT_EQ(message_of(decode_changed([](M&) {}, limits, environment_scene())),
            "the environment 'dawn' is 4 x 2 = 8 pixels; max_texture_pixels is 7");
}

TEST(UntrustedScene, ChecksEveryValueOfALuminaire) {
  using M = v1::SceneManifest;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Case cases[] = {
      {[](M& m) { m.mutable_lights(1)->mutable_profile()->set_profile(2); }, "light 'two' has profile 2 of 2"},
      {[](M& m) { m.clear_light_profiles(); }, "light 'one' has profile 0 of 0"},
      {[](M& m) { m.mutable_light_profiles(1)->set_candela(2, -1); }, "light profile 1: intensity -1 cd"},
      {[](M& m) { m.mutable_light_profiles(0)->add_candela(1); }, "light profile 0: it has 3 intensities for 2"},
      {[](M& m) { m.mutable_light_profiles(0)->clear_vertical_degrees(); }, "light profile 0: it has 0 vertical"},
      {[=](M& m) { m.mutable_lights(0)->mutable_profile()->mutable_position()->set_x(nan); },
       "light 'one' has position (nan, 2, 3)"},
      {[](M& m) { m.mutable_lights(0)->mutable_profile()->mutable_direction()->set_y(-2); },
       "light 'one' has direction (0, -2, 0)"},
      {[](M& m) { *m.mutable_lights(0)->mutable_profile()->mutable_zero_side() = m.lights(0).profile().direction(); },
       "light 'one' has a zero side (0, -1, 0) that is not at right angles"},
      {[](M& m) { m.mutable_lights(0)->mutable_profile()->mutable_tint()->set_g(-1); },
       "light 'one' has tint (1, -1, 0.25)"},
      {[](M& m) { m.mutable_materials(0)->mutable_diffuse_transmittance()->set_b(0.25); },
       "material 'paint' reflects (0.25, 0.5, 0.75) and scatters (0.5, 0.25, 0.25) through"},
      {[](M& m) { m.mutable_materials(0)->mutable_diffuse_transmittance_texture()->set_texture(2); },
       "material 'paint' uses texture 2 of 2"},
  };
  for (const Case& c : cases) {
    EXPECT_THAT(message_of(decode_changed(c.change, default_limits(), luminaire_scene())), HasSubstr(c.message));
  }
  v1::Limits limits = default_limits();
  limits.set_max_lights(3);
  const auto add_profiles = [](M& m) {
    for (int i = 0; i < 2; ++i) *m.add_light_profiles() = m.light_profiles(0);
  };
  EXPECT_EQ(message_of(decode_changed(add_profiles, limits, luminaire_scene())),
            "the scene has 4 light profiles; max_lights is 3");
}

TEST(UntrustedScene, RefusesSkiesThatAreNoLight) {
  for (const float bad : {-1.0F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    Scene scene = environment_scene();
    scene.environment->values[16] = bad;
    EXPECT_THAT(message_of(decode_encoded(*encode_scene(scene, {}))),
                HasSubstr("the environment 'dawn' has the value"));
    EXPECT_THAT(message_of(decode_encoded(*encode_scene(scene, {}))), HasSubstr("at pixel (1, 1)"));
  }
}

TEST(UntrustedScene, LetsSharesOfOneBeRounded) {
  // 0.75 + 0.25 as float32 arithmetic may leave it.
  const auto scene =
      decode_changed([](v1::SceneManifest& m) { m.mutable_materials(0)->mutable_transmittance()->set_b(0.25 + 1e-7); });
  EXPECT_TRUE(scene.ok()) << message_of(scene);
}

TEST(UntrustedScene, RefusesBytesThatAreNoManifest) {
  const BlobReader none = [](const Digest&) -> Result<std::string> { return invalid_argument("none"); };
  EXPECT_THAT(message_of(decode_scene("\xff\xff\xff", none, default_limits())), HasSubstr("not a valid message"));
  EXPECT_THAT(message_of(decode_scene("", none, default_limits())), HasSubstr("no mesh"));
}

/// Changes up to four bytes, or cuts, or doubles a part.
std::string mutated(std::string bytes, std::mt19937& random) {
  const std::size_t at = random() % bytes.size();
  switch (random() % 6) {
    case 0: bytes.resize(at); break;
    case 1: bytes.insert(at, bytes.substr(at, random() % 16)); break;
    case 2: bytes.erase(at, 1 + random() % 4); break;
    default:
      for (unsigned i = 0; i <= random() % 4; ++i) bytes[random() % bytes.size()] = static_cast<char>(random());
  }
  return bytes;
}

TEST(UntrustedScene, SurvivesThousandsOfMutatedMeshes) {
  std::mt19937 random(2024);
  int num_refused = 0, num_decoded = 0;
  // Quantised and float32; a manifold sheet and a soup.
  Scene soup = sheet_scene(4);
  for (auto& triangle : soup.meshes[0].triangles) {
    for (std::uint32_t& vertex : triangle) vertex = static_cast<std::uint32_t>(random() % 25);
  }
  for (const Scene& scene : {sheet_scene(4), soup}) {
    for (const double texels_per_meter : {32.0, 1e9}) {
      const EncodedScene encoded = *encode_scene(scene, {.texels_per_meter = texels_per_meter});
      for (int i = 0; i < 1000; ++i) {
        EncodedScene changed = encoded;
        std::string& bytes = changed.blobs[0].bytes;
        bytes = mutated(bytes, random);
        v1::SceneManifest manifest = manifest_of(encoded);
        manifest.mutable_meshes(0)->mutable_blob()->set_size_bytes(bytes.size());
        changed.blobs[0].digest.size_bytes = bytes.size();
        changed.blobs.back().bytes = manifest.SerializeAsString();
        const auto decoded = decode_encoded(changed);
        if (!decoded.ok()) {
          EXPECT_THAT(decoded.error().message, HasSubstr("mesh 'sheet#0'"));
          ++num_refused;
          continue;
        }
        ++num_decoded;
        for (const Vec3 position : decoded->meshes[0].positions) ASSERT_TRUE(is_finite(position));
        for (const auto& triangle : decoded->meshes[0].triangles) {
          for (const std::uint32_t vertex : triangle) ASSERT_LT(vertex, decoded->meshes[0].positions.size());
        }
      }
    }
  }
  EXPECT_GT(num_refused, 1000);
  EXPECT_GT(num_decoded, 100);
}

TEST(UntrustedScene, SurvivesThousandsOfMutatedManifests) {
  const google::protobuf::LogSilencer silencer;
  std::mt19937 random(4202);
  const EncodedScene encoded = *encode_scene(environment_scene(), {});
  int num_refused = 0;
  for (int i = 0; i < 3000; ++i) {
    EncodedScene changed = encoded;
    changed.blobs.back().bytes = mutated(encoded.blobs.back().bytes, random);
    const auto decoded = decode_encoded(changed);
    if (!decoded.ok()) {
      EXPECT_FALSE(decoded.error().message.empty());
      ++num_refused;
      continue;
    }
    for (const Material& material : decoded->materials) {
      ASSERT_LT(max_component(material.reflectance), 1);
      ASSERT_LE(max_component(material.reflectance + material.transmittance), 1 + 1e-6);
    }
    if (decoded->environment) {
      ASSERT_EQ(decoded->environment->width, 2 * decoded->environment->height);
    }
    for (const Mesh& mesh : decoded->meshes) ASSERT_LT(mesh.material, static_cast<int>(decoded->materials.size()));
  }
  EXPECT_GT(num_refused, 1000);
}

}  // namespace
}  // namespace radbake
