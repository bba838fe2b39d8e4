#include <gtest/gtest.h>

#include <cmath>

#include "client/gltf/read_ies.h"
#include "tests/unit/gltf/gltf_builder.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;

constexpr double kRounding = 1e-12;

// Two angles each way, ten times what stands there.
const std::string kPlain =
    "IESNA:LM-63-2002\r\n[TEST] none\r\n[LAMP] TILT=\r\nTILT=NONE\r\n"
    "1 1000 10 2 2 1 2 0 0 0\r\n1.0 1.0 50\r\n0 90\r\n0, 90\r\n1.5 2\r\n3\r\n4\r\n";

TEST(Ies, IsReadByItsNumbers) {
  const Result<LightProfile> profile = read_ies(kPlain);
  ASSERT_TRUE(profile.ok()) << profile.error().message;
  EXPECT_EQ(profile->vertical_degrees, (std::vector<double>{0, 90}));
  EXPECT_EQ(profile->horizontal_degrees, (std::vector<double>{0, 90}));
  EXPECT_EQ(profile->candela, (std::vector<float>{15, 20, 30, 40}));
}

TEST(Ies, MultipliesByBallastFactorsAndSkipsTilts) {
  const auto profile =
      read_ies("IESNA91\nTILT=INCLUDE\n1\n3\n0 45 90\n1 0.9 0.8\n1 -1 2 2 1 1 1 0 0 0 0.5 0.5 9\n0 90 0 8 4\n");
  ASSERT_TRUE(profile.ok()) << profile.error().message;
  EXPECT_EQ(profile->candela, (std::vector<float>{4, 2}));
}

// The second number: a factor up to 1995, for future use in 2002, the kind of the file in 2019.
TEST(Ies, MultipliesByTheLampFactorOfOldFilesOnly) {
  const auto candela = [](const std::string& head) {
    const auto profile = read_ies(head + "TILT=NONE\n1 -1 1 1 1 1 1 0 0 0 0.5 4 9\n0 0 8\n");
    return profile.ok() ? profile->candela.at(0) : -1;
  };
  EXPECT_EQ(candela(""), 16);
  EXPECT_EQ(candela("a lamp of 1986\n"), 16);
  EXPECT_EQ(candela("IESNA91\n"), 16);
  EXPECT_EQ(candela("IESNA:LM-63-1995\r\n"), 16);
  EXPECT_EQ(candela("IESNA:LM-63-2002\r\n"), 4);
  EXPECT_EQ(candela("IES:LM-63-2019\n"), 4);
}

// Of 1995: from 90 to 270 degrees, the other half mirrors it.
TEST(Ies, UnfoldsAnglesFrom90To270) {
  const auto profile = read_ies("IESNA91\nTILT=NONE\n1 1 1 1 3 1 1 0 0 0 1 1 1\n0\n90 180 270\n1 2 3\n");
  ASSERT_TRUE(profile.ok()) << profile.error().message;
  EXPECT_EQ(profile->horizontal_degrees, (std::vector<double>{0, 90, 180, 270, 360}));
  EXPECT_EQ(profile->candela, (std::vector<float>{2, 1, 2, 3, 2}));
}

// 180 degrees lies between 135 and 225, and so does its mirror image 0 between 45 and 315.
TEST(Ies, UnfoldsAnglesWithoutTheirMiddle) {
  const auto profile = read_ies("IESNA91\nTILT=NONE\n1 1 1 1 4 1 1 0 0 0 1 1 1\n0\n90 135 225 270\n1 2 4 3\n");
  ASSERT_TRUE(profile.ok()) << profile.error().message;
  EXPECT_EQ(profile->horizontal_degrees, (std::vector<double>{0, 45, 90, 135, 180, 225, 270, 315, 360}));
  EXPECT_EQ(profile->candela, (std::vector<float>{3, 2, 1, 2, 3, 4, 3, 4, 3}));
  const auto two = read_ies("IESNA91\nTILT=NONE\n1 1 1 1 2 1 1 0 0 0 1 1 1\n0\n90 270\n1 3\n");
  ASSERT_TRUE(two.ok()) << two.error().message;
  EXPECT_EQ(two->horizontal_degrees, (std::vector<double>{0, 90, 180, 270, 360}));
  EXPECT_EQ(two->candela, (std::vector<float>{2, 1, 2, 3, 2}));
}

TEST(Ies, IsRefusedWithItsFault) {
  const auto fault = [](const std::string& text) {
    const auto profile = read_ies(text);
    return profile.ok() ? std::string() : profile.error().message;
  };
  const std::string head = "IESNA:LM-63-2002\nTILT=NONE\n";
  EXPECT_NE(fault("hello").find("no TILT line"), std::string::npos);
  EXPECT_NE(fault(head + "1 1000").find("ends before the candela multiplier"), std::string::npos);
  EXPECT_NE(fault(head + "1 1000 x").find("the candela multiplier is 'x'"), std::string::npos);
  EXPECT_NE(fault(head + "1 1 1 2 1 2 1 0 0 0 1 1 1 0 90 0 1 2").find("type B"), std::string::npos);
  EXPECT_NE(fault(head + "1 1 1 2 1 3 1 0 0 0 1 1 1 0 90 0 1 2").find("type A"), std::string::npos);
  EXPECT_NE(fault(head + "1 1 1 2000000000 1 1 1 0 0 0 1 1 1").find("vertical angles is 2000000000"),
            std::string::npos);
  EXPECT_NE(
      fault(head + "1 1 1 1000 1000 1 1 0 0 0 1 1 1").find("1000 vertical x 1000 horizontal angles: at most 65341"),
      std::string::npos);
  EXPECT_NE(fault(head + "1 1 1e30 1 1 1 1 0 0 0 1 1 1 0 0 1e30").find("intensity 1e+30 times 1e+30"),
            std::string::npos);
  EXPECT_NE(fault(head + "1 1 1e300 1 1 1 1 0 0 0 1e300 1 1 0 0 0").find("beyond single precision"), std::string::npos);
  EXPECT_NE(fault(head + "1 1 1 1 4 1 1 0 0 0 1 1 1 0 90 225 135 270 1 2 3 4").find("135 comes after 225"),
            std::string::npos);
  EXPECT_NE(fault(head + "1 1 1 2 1 1 1 0 0 0 1 1 1 0 90 0 1").find("ends before intensity 2"), std::string::npos);
  EXPECT_NE(fault(head + "1 1 1 2 1 1 1 0 0 0 1 1 1 0 90 0 1 -2").find("intensity -2"), std::string::npos);
  EXPECT_NE(fault(head + "1 1 1 2 1 1 1 0 0 0 1 1 1 90 0 0 1 2").find("must ascend"), std::string::npos);
  EXPECT_NE(fault(std::string(kMaxIesBytes + 1, ' ')).find("above the limit"), std::string::npos);
}

GltfBuilder with_luminaire(const std::string& ies, json node, json placed) {
  GltfBuilder file = square();
  const int view = file.add_view(ies);
  file.document["extensions"]["EXT_lights_ies"]["lights"] =
      json::array({{{"bufferView", view}, {"mimeType", "application/x-ies-lm-63"}, {"name", "downlight"}}});
  placed["light"] = 0;
  node["extensions"]["EXT_lights_ies"] = std::move(placed);
  file.add_root(std::move(node));
  return file;
}

TEST(GltfLuminaires, ShineAlongMinusZOfTheirNode) {
  // Turned by 90 degrees about X: -Z becomes +Y, X stays.
  const double half = std::sqrt(0.5);
  const auto scene = read_bytes(with_luminaire(kPlain, {{"translation", {1, 2, 3}}, {"rotation", {half, 0, 0, half}}},
                                               {{"multiplier", 2}, {"color", {1, 0.5, 0.25}}})
                                    .glb());
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  ASSERT_EQ(scene->scene.lights.size(), 1u);
  EXPECT_EQ(scene->scene.lights[0].name, "downlight");
  const auto& light = std::get<ProfileLight>(scene->scene.lights[0].kind);
  EXPECT_EQ(light.position, (Vec3{1, 2, 3}));
  EXPECT_NEAR(light.direction.y, 1, kRounding);
  EXPECT_NEAR(light.zero_side.x, 1, kRounding);
  EXPECT_EQ(light.tint, (Vec3{2, 1, 0.5}));
  EXPECT_EQ(light.profile->candela, (std::vector<float>{15, 20, 30, 40}));
  EXPECT_FALSE(light.is_mirrored);
}

TEST(GltfLuminaires, ShareTheProfileOfTheirEntry) {
  GltfBuilder file = with_luminaire(kPlain, json::object(), json::object());
  file.add_root({{"extensions", {{"EXT_lights_ies", {{"light", 0}}}}}});
  const auto scene = read_bytes(file.glb());
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  ASSERT_EQ(scene->scene.lights.size(), 2u);
  EXPECT_EQ(std::get<ProfileLight>(scene->scene.lights[0].kind).profile,
            std::get<ProfileLight>(scene->scene.lights[1].kind).profile);
}

TEST(GltfLuminaires, AreMirroredByTheirNode) {
  for (const auto& [scale, is_mirrored] : {std::pair<std::vector<int>, bool>{{1, -1, 1}, true},
                                           {{-2, 1, 1}, true},
                                           {{-1, -1, 1}, false},
                                           {{-1, -1, -1}, true}}) {
    const auto scene = read_bytes(with_luminaire(kPlain, {{"scale", scale}}, json::object()).glb());
    ASSERT_TRUE(scene.ok()) << scene.error().message;
    const auto& light = std::get<ProfileLight>(scene->scene.lights.at(0).kind);
    EXPECT_EQ(light.is_mirrored, is_mirrored);
    // 90 degrees is the image of +Y either way.
    const Vec3 across = cross(light.zero_side, light.direction) * (light.is_mirrored ? -1 : 1);
    EXPECT_EQ(across.y, scale[1]);
  }
}

TEST(GltfLuminaires, ClampTheirColour) {
  const auto scene =
      read_bytes(with_luminaire(kPlain, json::object(), {{"multiplier", 2}, {"color", {3, 1.5, 0.25}}}).glb());
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(std::get<ProfileLight>(scene->scene.lights.at(0).kind).tint, (Vec3{2, 2, 0.5}));
}

TEST(GltfLuminaires, AreLeftOutWithoutIntensity) {
  const std::string dark = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 1 0 0 0 1 1 1 0 90 0 0 0";
  for (const GltfBuilder& file : {with_luminaire(kPlain, json::object(), {{"multiplier", 0}}),
                                  with_luminaire(kPlain, json::object(), {{"color", {0, 0, 0}}}),
                                  with_luminaire(dark, json::object(), json::object())}) {
    const auto scene = read_bytes(file.glb());
    ASSERT_TRUE(scene.ok()) << scene.error().message;
    EXPECT_TRUE(scene->scene.lights.empty());
  }
}

TEST(GltfLuminaires, AreReadFromDataUris) {
  GltfBuilder file = with_luminaire(kPlain, json::object(), json::object());
  // IES:LM-63-2019, TILT=NONE, 1 -1 1 1 1 1 1 0 0 0 1 1.1 1, 0, 0, 7
  file.document["extensions"]["EXT_lights_ies"]["lights"][0] = {
      {"uri",
       "data:application/x-ies-lm-63;base64,"
       "SUVTOkxNLTYzLTIwMTkKVElMVD1OT05FCjEgLTEgMSAxIDEgMSAxIDAgMCAwIDEgMS4xIDEKMCAwIDcK"}};
  const auto scene = read_bytes(file.glb());
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(std::get<ProfileLight>(scene->scene.lights.at(0).kind).profile->candela, (std::vector<float>{7}));
}

TEST(GltfLuminaires, AreRefusedWithTheProfileAndItsFault) {
  const auto fault = [](const GltfBuilder& file) {
    const auto scene = read_bytes(file.glb());
    return scene.ok() ? std::string() : scene.error().message;
  };
  const std::string no_file = fault(with_luminaire("no file", json::object(), json::object()));
  EXPECT_NE(no_file.find("light profile 0 'downlight': it has no TILT line"), std::string::npos) << no_file;
  const std::string negative = fault(with_luminaire(kPlain, json::object(), {{"multiplier", -1}}));
  EXPECT_NE(negative.find("multiplier"), std::string::npos) << negative;
  GltfBuilder outside = with_luminaire(kPlain, json::object(), json::object());
  outside.document["extensions"]["EXT_lights_ies"]["lights"][0] = {{"uri", "../secret.ies"}};
  EXPECT_NE(fault(outside).find("not a path inside the scene's folder"), std::string::npos) << fault(outside);
  for (const char* uri : {"data:text/plain,IESNA91", "data:text/plain;base64,"}) {
    GltfBuilder empty = with_luminaire(kPlain, json::object(), json::object());
    empty.document["extensions"]["EXT_lights_ies"]["lights"][0] = {{"uri", uri}};
    EXPECT_NE(fault(empty).find("light profile 0: its data URI"), std::string::npos) << fault(empty);
  }
  const GltfBuilder large = with_luminaire(std::string(kMaxIesBytes + 1, ' '), json::object(), json::object());
  EXPECT_NE(fault(large).find("1048577 bytes, above the limit of 1048576"), std::string::npos) << fault(large);
  GltfBuilder missing = with_luminaire(kPlain, json::object(), json::object());
  missing.document["nodes"][1]["extensions"]["EXT_lights_ies"]["light"] = 3;
  EXPECT_NE(fault(missing).find("light"), std::string::npos);
}

// Each entry is read apart: together they are bounded.
TEST(GltfLuminaires, AreRefusedWhereTheirFilesAreTooLargeTogether) {
  GltfBuilder file =
      with_luminaire(kPlain + std::string(kMaxIesBytes - kPlain.size(), ' '), json::object(), json::object());
  auto& profiles = file.document["extensions"]["EXT_lights_ies"]["lights"];
  for (int i = 1; i <= 64; ++i) {
    profiles.push_back(profiles[0]);
    file.add_root({{"extensions", {{"EXT_lights_ies", {{"light", i}}}}}});
  }
  expect_refused(read_bytes(file.glb()), {"light profile 64", "above the limit of 67108864"});
}

TEST(GltfMaterials, DiffuseTransmissionTakesItsShareOfWhatIsReflected) {
  GltfBuilder file = square();
  file.document["materials"] =
      json::array({{{"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.4, 0.2, 1}}, {"metallicFactor", 0}}},
                    {"extensions",
                     {{"KHR_materials_diffuse_transmission",
                       {{"diffuseTransmissionFactor", 0.25}, {"diffuseTransmissionColorFactor", {0.4, 0.8, 1}}}}}}}});
  file.document["meshes"][0]["primitives"][0]["material"] = 0;
  const auto scene = read_bytes(file.glb());
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  const Material& leaf = scene->scene.materials.at(0);
  EXPECT_TRUE(leaf.is_double_sided);
  const Vec3 reflected = leaf.reflectance - Vec3{0.6, 0.3, 0.15};
  EXPECT_LT(length(reflected), 1e-6);
  EXPECT_NEAR(leaf.diffuse_transmittance.x, 0.1, 1e-6);
  EXPECT_NEAR(leaf.diffuse_transmittance.y, 0.2, 1e-6);
  // White is limited as reflectance is: together they stay below one.
  EXPECT_LT(leaf.diffuse_transmittance.z, 0.25);
  EXPECT_GT(leaf.diffuse_transmittance.z, 0.22);
}

}  // namespace
}  // namespace radbake::gltf
