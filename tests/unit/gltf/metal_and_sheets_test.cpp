// What metalness, roughness and transmission make of the base colour, and what is flagged as not simulated.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/gltf/metal.h"
#include "tests/unit/gltf/gltf_builder.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

// Textures are float.
constexpr double kFloat = 1e-6;

GltfScene read(const GltfBuilder& file, double max_reflectance = 0.98) {
  Result<GltfScene> result = read_bytes(file.glb(), {max_reflectance});
  EXPECT_TRUE(result.ok()) << result.error().message;
  return result.ok() ? std::move(result).value() : GltfScene{};
}

json& material(GltfBuilder& file) { return file.document["materials"][0]; }

/// The square with these factors of pbrMetallicRoughness.
GltfBuilder painted(const json& factors) {
  GltfBuilder file = square();
  material(file)["pbrMetallicRoughness"] = factors;
  return file;
}

/// Adds a texture of the text image; returns its index.
int add_texture(GltfBuilder& file, const std::string& image, int wrap = 33071) {
  const int view = file.add_view(image);
  const int source = file.add("images", {{"bufferView", view}, {"mimeType", "image/png"}});
  const int sampler = file.add("samplers", {{"wrapS", wrap}, {"wrapT", wrap}});
  return file.add("textures", {{"source", source}, {"sampler", sampler}});
}

/// The square with a texture on the base colour and one of metalness and roughness.
GltfBuilder plated(const std::string& color, const std::string& metal) {
  GltfBuilder file = painted({{"baseColorFactor", {0.5, 0.5, 0.5, 1}}});
  const int uv = file.add_floats({0, 0, 1, 0, 1, 1, 0, 1}, "VEC2");
  file.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv;
  file.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = uv;
  json& pbr = material(file)["pbrMetallicRoughness"];
  if (!color.empty()) pbr["baseColorTexture"] = {{"index", add_texture(file, color)}};
  if (!metal.empty()) pbr["metallicRoughnessTexture"] = {{"index", add_texture(file, metal)}};
  return file;
}

/// Reflectance of a texel: factor times texture.
Vec3 reflectance(const GltfScene& read, std::size_t texel = 0) {
  const Material& material = read.scene.materials.at(0);
  if (!material.reflectance_texture) return material.reflectance;
  const TexturePlane& plane = read.scene.textures.at(material.reflectance_texture->texture);
  const float* values = &plane.values.at(texel * plane.channels);
  return scaled_by(material.reflectance, {values[0], values[1], values[2]});
}

void expect_near(Vec3 actual, Vec3 expected) {
  EXPECT_NEAR(actual.x, expected.x, kFloat);
  EXPECT_NEAR(actual.y, expected.y, kFloat);
  EXPECT_NEAR(actual.z, expected.z, kFloat);
}

TEST(GltfMetal, ReflectsWhatEnginesBake) {
  // Unity's meta pass: diffuse + specular * perceptualRoughness^2 * 0.5.
  const auto metal = [](double m, double r) {
    return reflectance(
        read(painted({{"baseColorFactor", {0.8, 0.4, 0.2, 1}}, {"metallicFactor", m}, {"roughnessFactor", r}})));
  };
  expect_near(metal(0, 0.3), {0.8, 0.4, 0.2});
  expect_near(metal(1, 1), {0.4, 0.2, 0.1});
  expect_near(metal(1, 0.5), {0.1, 0.05, 0.025});
  expect_near(metal(1, 0), {0, 0, 0});
  // Half metal of roughness 0.8: 0.5 + 0.5 * 0.64 / 2 = 0.66.
  expect_near(metal(0.5, 0.8), {0.528, 0.264, 0.132});
}

TEST(GltfMetal, IsWhatAFileSaysThatSaysNothing) {
  // glTF: metalness 1, roughness 1, white.
  const GltfScene scene = read(painted(json::object()));
  expect_near(reflectance(scene), {0.5, 0.5, 0.5});
  EXPECT_TRUE(scene.scene.materials.at(0).is_specular);
  EXPECT_EQ(
      warning_text(scene, "metallic_as_diffuse"),
      "metal is baked as a diffuse surface of base colour x roughness^2 / 2: material 'grey' (100 % of the area)");
  EXPECT_EQ(warning_text(scene, "reflectance_limited"), "");
}

TEST(GltfMetal, FollowsItsTextureTexelByTexel) {
  // Green is roughness, blue metalness: paint, rough metal, half metal of roughness 0.5.
  const GltfScene scene = read(plated("3 1 3  0.8 0.6 0.4  0.8 0.6 0.4  1 1 1", "3 1 3  9 0.2 0  9 1 1  9 0.5 0.5"));
  expect_near(reflectance(scene, 0), {0.4, 0.3, 0.2});
  expect_near(reflectance(scene, 1), {0.2, 0.15, 0.1});
  // 0.5 (0.5 + 0.5 * 0.25 / 2) = 0.28125.
  expect_near(reflectance(scene, 2), {0.28125, 0.28125, 0.28125});
  EXPECT_THAT(warning_text(scene, "metallic_as_diffuse"), HasSubstr("100 %"));
}

TEST(GltfMetal, MultipliesItsTextureByTheFactors) {
  GltfBuilder file = plated("1 1 3  1 1 1", "1 1 3  0 0.5 0.5");
  material(file)["pbrMetallicRoughness"]["metallicFactor"] = 0.5;
  material(file)["pbrMetallicRoughness"]["roughnessFactor"] = 0.8;
  // m = 0.25, r = 0.4: 0.5 (0.75 + 0.25 * 0.16 / 2) = 0.385.
  expect_near(reflectance(read(file)), {0.385, 0.385, 0.385});
}

TEST(GltfMetal, IsLookedUpAtTheCentresOfTheBaseColoursTexels) {
  // Two texels of metalness 0 and 1 below four of colour: centres at 1/8, 3/8, 5/8, 7/8 lie a quarter before, and so
  // on, between their centres at 1/4 and 3/4. The border is clamped.
  const GltfScene scene = read(plated("4 1 3  1 1 1  1 1 1  1 1 1  1 1 1", "2 1 3  0 0 0  0 0 1"));
  const double metalness[] = {0, 0.25, 0.75, 1};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(reflectance(scene, i).x, 0.5 * (1 - metalness[i]), kFloat) << i;
}

TEST(GltfMetal, WrapsItsTextureAsItsSamplerSays) {
  // Metalness 1 and 0; the point lies on the left border.
  TexturePlane plane;
  plane.width = 2;
  plane.height = 1;
  plane.values = {0, 0, 1, 0, 0, 0};
  const MetalRoughness factors{1, 1};
  EXPECT_NEAR(diffuse_share_at(factors, plane, {0, 0.5}), 0.5, kFloat);  // repeated: half of each
  plane.wrap_s = Wrap::kClamp;
  EXPECT_NEAR(diffuse_share_at(factors, plane, {0, 0.5}), 0, kFloat);
  plane.wrap_s = Wrap::kMirror;
  EXPECT_NEAR(diffuse_share_at(factors, plane, {0, 0.5}), 0, kFloat);
}

TEST(GltfMetal, IsTheMeanOfItsTextureWhereItIsLookedUpOtherwise) {
  // Shares of 1 and of 1/2: 3/4 of the base colour.
  const std::string metal = "2 1 3  0 1 0  0 1 1";
  expect_near(reflectance(read(plated("", metal))), {0.375, 0.375, 0.375});
  const auto changed = [&](const auto& change) {
    GltfBuilder file = plated("2 1 3  1 1 1  0.5 0.5 0.5", metal);
    change(file, material(file)["pbrMetallicRoughness"]["metallicRoughnessTexture"]);
    const GltfScene scene = read(file);
    expect_near(reflectance(scene, 0), {0.375, 0.375, 0.375});
    expect_near(reflectance(scene, 1), {0.1875, 0.1875, 0.1875});
  };
  changed([](GltfBuilder&, json& info) { info["texCoord"] = 1; });
  changed([](GltfBuilder&, json& info) { info["extensions"]["KHR_texture_transform"] = {{"scale", {2, 1}}}; });
  changed([](GltfBuilder& file, json& info) { info["index"] = add_texture(file, "2 1 3  0 1 0  0 1 1", 10497); });
}

TEST(GltfMetal, IsNotLookedAtWhereTheFactorIsZeroOrTheMaterialUnlit) {
  GltfBuilder file = plated("", "no image");
  material(file)["pbrMetallicRoughness"]["metallicFactor"] = 0;
  expect_near(reflectance(read(file)), {0.5, 0.5, 0.5});
  GltfBuilder unlit = painted({{"baseColorFactor", {0.5, 0.5, 0.5, 1}}, {"roughnessFactor", 0}});
  material(unlit)["extensions"]["KHR_materials_unlit"] = json::object();
  expect_near(reflectance(read(unlit)), {0.5, 0.5, 0.5});
  EXPECT_FALSE(read(unlit).scene.materials.at(0).is_specular);
}

TEST(GltfMetal, NamesTheTextureThatDoesNotDecode) {
  expect_refused(read_bytes(plated("", "no image").glb()), {"material 0 'grey'", "image 0"});
}

TEST(GltfMetal, LimitsTheReflectanceThatIsLeft) {
  // White metal reflects half of what white paint would: nothing to limit, until the limit is lower.
  EXPECT_EQ(warning_text(read(plated("1 1 3  1 1 1", "1 1 3  0 1 1")), "reflectance_limited"), "");
  const GltfScene scene = read(plated("2 1 3  1 1 1  1 1 1", "2 1 3  0 1 1  0 1 0"), 0.3);
  expect_near(reflectance(scene, 0), {0.25, 0.25, 0.25});
  expect_near(reflectance(scene, 1), {0.3, 0.3, 0.3});
  EXPECT_THAT(warning_text(scene, "reflectance_limited"), HasSubstr("50 %"));
}

/// The square as a sheet.
GltfBuilder sheet(const json& color, double transmission, double metallic = 0) {
  GltfBuilder file = painted({{"baseColorFactor", color}, {"metallicFactor", metallic}});
  material(file)["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = transmission;
  return file;
}

TEST(GltfSheets, DivideTheBaseColour) {
  const Material glass = read(sheet({0.8, 0.4, 0.2, 1}, 0.75)).scene.materials.at(0);
  expect_near(glass.reflectance, {0.2, 0.1, 0.05});
  expect_near(glass.transmittance, {0.6, 0.3, 0.15});
  const Material opaque = read(sheet({0.8, 0.4, 0.2, 1}, 0)).scene.materials.at(0);
  expect_near(opaque.reflectance, {0.8, 0.4, 0.2});
  EXPECT_EQ(opaque.transmittance, Vec3{});
}

TEST(GltfSheets, LetAllThroughThatIsClear) {
  const GltfScene scene = read(sheet({1, 1, 1, 1}, 1));
  EXPECT_EQ(scene.scene.materials.at(0).transmittance, (Vec3{1, 1, 1}));
  EXPECT_EQ(scene.scene.materials.at(0).reflectance, Vec3{});
  EXPECT_THAT(scene.warnings, ::testing::IsEmpty());
}

TEST(GltfSheets, OfMetalLetNothingThrough) {
  const Material metal = read(sheet({0.8, 0.8, 0.8, 1}, 1, 1)).scene.materials.at(0);
  EXPECT_EQ(metal.transmittance, Vec3{});
  expect_near(metal.reflectance, {0.4, 0.4, 0.4});
  // Half a metal: half of it lets light through, the other reflects half of its colour.
  const Material half = read(sheet({0.8, 0.8, 0.8, 1}, 1, 0.5)).scene.materials.at(0);
  expect_near(half.transmittance, {0.4, 0.4, 0.4});
  expect_near(half.reflectance, {0.2, 0.2, 0.2});
}

TEST(GltfSheets, AreMultipliedByTheBaseColoursTexture) {
  GltfBuilder file = plated("2 1 3  1 0.5 0.25  0 1 1", "");
  material(file)["pbrMetallicRoughness"]["metallicFactor"] = 0;
  material(file)["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = 0.5;
  const GltfScene scene = read(file);
  expect_near(reflectance(scene, 0), {0.25, 0.125, 0.0625});
  expect_near(scene.scene.materials.at(0).transmittance, {0.25, 0.25, 0.25});
}

TEST(GltfSheets, KeepTheirSharesWithinOneWhereTheReflectanceIsLimited) {
  // Hardly a sheet: 0.99 is reflected, limited to 0.7; the texture makes up for what the factor leaves.
  GltfBuilder file = plated("2 1 3  1 1 1  0.5 0.5 0.5", "");
  material(file)["pbrMetallicRoughness"] = {{"metallicFactor", 0}, {"baseColorTexture", {{"index", 0}}}};
  material(file)["extensions"]["KHR_materials_transmission"]["transmissionFactor"] = 0.01;
  const GltfScene scene = read(file, 0.7);
  const Material& material = scene.scene.materials.at(0);
  expect_near(reflectance(scene, 0), {0.7, 0.7, 0.7});
  expect_near(reflectance(scene, 1), {0.495, 0.495, 0.495});
  EXPECT_LE(max_component(material.reflectance + material.transmittance), 1);
  // Of the second texel, which no limit touches, 0.01 of 0.5 goes through.
  const TexturePlane& plane = scene.scene.textures.at(0);
  EXPECT_NEAR(material.transmittance.x * plane.values.at(3), 0.005, kFloat);
  // Factors above 1 are no shares.
  const Material bright = read(sheet({3, 3, 3, 1}, 0.5)).scene.materials.at(0);
  expect_near(bright.reflectance, {0.5, 0.5, 0.5});
  expect_near(bright.transmittance, {0.5, 0.5, 0.5});
}

TEST(GltfSheets, SayThatATextureOfTransmissionIsNotFollowed) {
  GltfBuilder file = sheet({1, 1, 1, 1}, 0.5);
  EXPECT_EQ(warning_text(read(file), "transmission_texture_ignored"), "");
  material(file)["extensions"]["KHR_materials_transmission"]["transmissionTexture"] = {
      {"index", add_texture(file, "never decoded")}};
  EXPECT_EQ(
      warning_text(read(file), "transmission_texture_ignored"),
      "textures of transmission are not followed: the factor holds everywhere: material 'grey' (100 % of the area)");
}

/// Flags as a text of the letters specular, refractive, normal map, volume.
std::string flags_of(const json& pbr, const json& extensions, bool has_normal_map = false) {
  GltfBuilder file = painted(pbr);
  material(file)["extensions"] = extensions;
  if (has_normal_map) material(file)["normalTexture"] = {{"index", add_texture(file, "never decoded")}};
  const Material read_material = read(file).scene.materials.at(0);
  std::string flags;
  if (read_material.is_specular) flags += 's';
  if (read_material.is_refractive) flags += 'r';
  if (read_material.has_normal_map) flags += 'n';
  if (read_material.has_volume) flags += 'v';
  return flags;
}

TEST(GltfFlags, SayWhatIsNotSimulated) {
  const json paint = {{"metallicFactor", 0}, {"roughnessFactor", 0.5}}, none = json::object();
  const json sheet = {{"transmissionFactor", 0.5}};
  EXPECT_EQ(flags_of(paint, none), "");
  EXPECT_EQ(flags_of(paint, none, true), "n");
  EXPECT_EQ(flags_of({{"metallicFactor", 0}, {"roughnessFactor", 0.49}}, none), "s");
  EXPECT_EQ(flags_of({{"metallicFactor", 0.005}}, none), "s");
  EXPECT_EQ(flags_of({{"metallicFactor", 0.003}}, none), "");  // below 1/255: no texture could say it
  EXPECT_EQ(flags_of(paint, {{"KHR_materials_clearcoat", {{"clearcoatFactor", 0.1}}}}), "s");
  EXPECT_EQ(flags_of(paint, {{"KHR_materials_clearcoat", none}}), "");
  // A sheet is thin unless it has a thickness; glass bends light as 1.5 does, which is the default.
  EXPECT_EQ(flags_of(paint, {{"KHR_materials_transmission", sheet}}), "");
  EXPECT_EQ(flags_of(paint, {{"KHR_materials_transmission", sheet}, {"KHR_materials_volume", none}}), "");
  EXPECT_EQ(flags_of(paint, {{"KHR_materials_transmission", sheet}, {"KHR_materials_ior", {{"ior", 1.5}}}}), "");
  EXPECT_EQ(flags_of(paint, {{"KHR_materials_transmission", sheet}, {"KHR_materials_ior", {{"ior", 1.33}}}}), "r");
  EXPECT_EQ(
      flags_of(paint, {{"KHR_materials_transmission", sheet}, {"KHR_materials_volume", {{"thicknessFactor", 0.1}}}}),
      "rv");
  EXPECT_EQ(flags_of(paint, {{"KHR_materials_ior", {{"ior", 1.33}}}}), "");
}

TEST(GltfFlags, RefuseNumbersThatAreNone) {
  const auto refuse = [](const char* extension, const json& content, const char* part) {
    GltfBuilder file = square();
    material(file)["extensions"][extension] = content;
    expect_refused(read_bytes(file.glb()), {"material 0 'grey'", part});
  };
  refuse("KHR_materials_transmission", {{"transmissionFactor", 1.5}}, "transmissionFactor is 1.5");
  refuse("KHR_materials_transmission", {{"transmissionTexture", {{"index", 7}}}}, "7");
  refuse("KHR_materials_volume", {{"thicknessFactor", -1}}, "thicknessFactor is -1");
  refuse("KHR_materials_clearcoat", {{"clearcoatFactor", "much"}}, "clearcoatFactor");
  refuse("KHR_materials_ior", {{"ior", -1}}, "ior is -1");
  GltfBuilder file = painted({{"roughnessFactor", 2}});
  expect_refused(read_bytes(file.glb()), {"material 0 'grey'", "roughnessFactor is 2"});
}

TEST(GltfInstances, CountPlacementsOfMeshesThatArePlacedMoreThanOnce) {
  GltfBuilder file = square();
  EXPECT_EQ(read(file).scene.num_instances, 0u);
  file.add_root({{"mesh", 0}, {"translation", {2, 0, 0}}});
  file.add_root({{"mesh", 0}, {"translation", {4, 0, 0}}});
  // Two primitives are placed as one.
  file.document["meshes"][0]["primitives"].push_back(file.document["meshes"][0]["primitives"][0]);
  const int once = file.add_mesh({{"attributes", {{"POSITION", 0}}}, {"indices", 1}, {"material", 0}});
  file.add_root({{"mesh", once}});
  const GltfScene scene = read(file);
  EXPECT_EQ(scene.scene.meshes.size(), 7u);
  EXPECT_EQ(scene.scene.num_instances, 3u);
}

}  // namespace
}  // namespace radbake::gltf
