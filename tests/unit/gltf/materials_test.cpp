#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gltf/gltf_builder.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;

// Textures are float.
constexpr double kFloat = 1e-6;

GltfScene read(const GltfBuilder& file, double max_reflectance = 0.98) {
  Result<GltfScene> result = read_bytes(file.glb(), {max_reflectance});
  EXPECT_TRUE(result.ok()) << result.error().message;
  return result.ok() ? std::move(result).value() : GltfScene{};
}

// The square with texture coordinates and a texture of the text image on its base colour.
GltfBuilder textured(const std::string& image) {
  GltfBuilder file = square();
  const int uv = file.add_floats({0, 0, 1, 0, 1, 1, 0, 1}, "VEC2");
  file.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv;
  file.add("images", {{"name", "bricks"}, {"bufferView", file.add_view(image)}, {"mimeType", "image/png"}});
  file.add("samplers", {{"wrapS", 33071}, {"wrapT", 33648}});
  file.add("textures", {{"source", 0}, {"sampler", 0}});
  file.document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
  return file;
}

json& material(GltfBuilder& file) { return file.document["materials"][0]; }

TEST(GltfMaterials, ReadsFactorsAndSides) {
  GltfBuilder file = square();
  material(file)["pbrMetallicRoughness"]["baseColorFactor"] = {0.25, 0.5, 0.75, 1};
  material(file)["doubleSided"] = true;
  const GltfScene scene = read(file);
  const Material& grey = scene.scene.materials.at(0);
  EXPECT_EQ(grey.name, "grey");
  EXPECT_EQ(grey.reflectance, (Vec3{0.25, 0.5, 0.75}));
  EXPECT_EQ(grey.emissive, (Vec3{0, 0, 0}));
  EXPECT_TRUE(grey.is_double_sided);
  EXPECT_THAT(scene.warnings, IsEmpty());
}

TEST(GltfMaterials, MultipliesEmissionByItsStrength) {
  GltfBuilder file = square();
  material(file)["emissiveFactor"] = {1, 0.5, 0.25};
  EXPECT_EQ(read(file).scene.materials.at(0).emissive, (Vec3{1, 0.5, 0.25}));
  material(file)["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 400;
  EXPECT_EQ(read(file).scene.materials.at(0).emissive, (Vec3{400, 200, 100}));
}

TEST(GltfMaterials, LimitsReflectanceAndNamesTheMaterialWithItsShare) {
  GltfBuilder file = square();
  // A second square of four times the area in white.
  file.add("materials", {{"name", "white"}, {"pbrMetallicRoughness", {{"metallicFactor", 0}}}});
  const int mesh = file.add_mesh({{"attributes", {{"POSITION", 0}}}, {"indices", 1}, {"material", 1}});
  file.add_root({{"mesh", mesh}, {"scale", {2, 2, 1}}});
  const GltfScene scene = read(file, 0.9);
  EXPECT_EQ(scene.scene.materials.at(0).reflectance, (Vec3{0.5, 0.5, 0.5}));
  EXPECT_EQ(scene.scene.materials.at(1).reflectance, (Vec3{0.9, 0.9, 0.9}));
  EXPECT_EQ(warning_text(scene, "reflectance_limited"),
            "reflectance limited to 0.9: material 'white' (80 % of the area)");
  EXPECT_EQ(scene.warnings.size(), 1u);
}

TEST(GltfMaterials, NamesAFewOfManyMaterials) {
  GltfBuilder file = square();
  for (int i = 1; i < 6; ++i) {
    file.add("materials", {{"name", "m" + std::to_string(i)}, {"pbrMetallicRoughness", {{"metallicFactor", 0}}}});
    const int mesh = file.add_mesh({{"attributes", {{"POSITION", 0}}}, {"indices", 1}, {"material", i}});
    file.add_root({{"mesh", mesh}});
  }
  EXPECT_THAT(warning_text(read(file), "reflectance_limited"), HasSubstr("'m1', 'm2', 'm3' and 2 more (83.3 %"));
}

TEST(GltfMaterials, APrimitiveWithoutMaterialHasTheDefaultOne) {
  GltfBuilder file = square();
  file.document["meshes"][0]["primitives"][0].erase("material");
  const GltfScene scene = read(file);
  // White metal of roughness 1: half of its colour is diffuse.
  EXPECT_EQ(scene.scene.materials.at(0).reflectance, (Vec3{0.5, 0.5, 0.5}));
  EXPECT_THAT(warning_text(scene, "metallic_as_diffuse"), HasSubstr("default material"));
  EXPECT_THAT(warning_text(scene, "metallic_as_diffuse"), HasSubstr("100 %"));
}

TEST(GltfMaterials, KeepsATextureThatNeedsNoLimit) {
  GltfBuilder file = textured("2 1 3  0.25 0.5 0.75  0.9 0.8 0.7");
  material(file)["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 1};
  const GltfScene scene = read(file);
  const TexturePlane& plane = scene.scene.textures.at(0);
  EXPECT_EQ(plane.name, "bricks");
  EXPECT_EQ(plane.wrap_s, Wrap::kClamp);
  EXPECT_EQ(plane.wrap_t, Wrap::kMirror);
  // White times a texture of at most 0.9 stays below 0.98: the products are the file's.
  const Vec3 factor = scene.scene.materials.at(0).reflectance;
  EXPECT_LT(max_component(factor), 1);
  EXPECT_NEAR(plane.values.at(0) * factor.x, 0.25, kFloat);
  EXPECT_NEAR(plane.values.at(3) * factor.x, 0.9, kFloat);
  EXPECT_NEAR(plane.values.at(5) * factor.z, 0.7, kFloat);
  EXPECT_EQ(warning_text(scene, "reflectance_limited"), "");
}

TEST(GltfMaterials, LimitsTheTexelsThatAreTooBright) {
  GltfBuilder file = textured("2 2 3  1 1 1  0.5 0.5 0.5  0.5 0.5 0.5  0.25 0.25 0.25");
  material(file)["pbrMetallicRoughness"]["baseColorFactor"] = {1, 0.5, 1, 1};
  const GltfScene scene = read(file, 0.8);
  const Vec3 factor = scene.scene.materials.at(0).reflectance;
  const TexturePlane& plane = scene.scene.textures.at(0);
  EXPECT_NEAR(plane.values.at(0) * factor.x, 0.8, kFloat);
  EXPECT_NEAR(plane.values.at(1) * factor.y, 0.5, kFloat);
  EXPECT_NEAR(plane.values.at(3) * factor.x, 0.5, kFloat);
  for (std::size_t i = 0; i < plane.values.size(); ++i) EXPECT_LE(plane.values[i] * factor[int(i % 3)], 0.8);
  // One texel of four.
  EXPECT_THAT(warning_text(scene, "reflectance_limited"), HasSubstr("25 %"));
}

TEST(GltfMaterials, SharesAPlaneAmongMaterialsOfEqualUse) {
  GltfBuilder file = textured("1 1 3 0.5 0.5 0.5");
  file.document["materials"].push_back(file.document["materials"][0]);
  json second = file.document["meshes"][0]["primitives"][0];
  second["material"] = 1;
  file.document["meshes"][0]["primitives"].push_back(second);
  const GltfScene scene = read(file);
  EXPECT_EQ(scene.scene.materials.size(), 2u);
  EXPECT_EQ(scene.scene.textures.size(), 1u);
}

TEST(GltfMaterials, AsksForColoursInSrgbAndForMetalnessAsItIs) {
  GltfBuilder file = textured("1 1 3 0.5 0.5 0.5");
  material(file)["pbrMetallicRoughness"]["metallicFactor"] = 1;
  material(file)["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", 0}};
  std::vector<bool> asked;
  const ImageDecoder spy = [&](auto bytes, const std::string& name, bool is_srgb) {
    asked.push_back(is_srgb);
    return decode_text_image(bytes, name, is_srgb);
  };
  const TemporaryFolder folder;
  ASSERT_TRUE(read_gltf(folder.write("scene.glb", file.glb()), spy, {}).ok());
  EXPECT_THAT(asked, UnorderedElementsAre(true, false));
}

TEST(GltfMaterials, DecodesNoTextureThatNoMeshUses) {
  GltfBuilder file = square();
  file.add("images", {{"bufferView", file.add_view("garbage!")}, {"mimeType", "image/png"}});
  file.add("images", {{"uri", "missing.png"}});
  file.add("textures", {{"source", 0}});
  file.add("textures", {{"source", 1}});
  file.add("materials", {{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", 0}}}}}});
  material(file)["normalTexture"] = {{"index", 1}};
  const GltfScene scene = read(file);
  EXPECT_EQ(scene.scene.materials.size(), 1u);
  EXPECT_THAT(scene.scene.textures, IsEmpty());
  EXPECT_THAT(warning_text(scene, "normal_map_not_simulated"), HasSubstr("'grey' (100 %"));
}

TEST(GltfMaterials, ReadsAnImageBesideTheScene) {
  GltfBuilder file = textured("unused");
  file.document["images"][0] = {{"uri", "walls/red+blue%20tiles.png"}};
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "walls");
  folder.write("walls/red+blue tiles.png", "1 1 3 0.5 0.25 0.125");
  const auto result = read_gltf(folder.write("scene.glb", file.glb()), decode_text_image, {});
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_THAT(result->scene.textures.at(0).values, ElementsAre(0.5f, 0.25f, 0.125f));
}

TEST(GltfMaterials, DoesNotWarnOfAMaterialWithoutArea) {
  GltfBuilder file = square();
  file.add("materials", {{"name", "white"}});
  const int line = file.add_indices({0, 1, 1});
  file.document["meshes"][0]["primitives"].push_back(
      {{"attributes", {{"POSITION", 0}}}, {"indices", line}, {"material", 1}});
  const GltfScene scene = read(file);
  EXPECT_EQ(scene.num_triangles_dropped, 1u);
  EXPECT_EQ(warning_text(scene, "reflectance_limited"), "");
}

TEST(GltfMaterials, WarnsOfMetalOnlyWhereThereIsSome) {
  GltfBuilder file = textured("1 1 3 0.5 0.5 0");
  material(file)["pbrMetallicRoughness"]["metallicFactor"] = 1;
  EXPECT_THAT(warning_text(read(file), "metallic_as_diffuse"), HasSubstr("'grey'"));
  material(file)["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", 0}};
  EXPECT_EQ(warning_text(read(file), "metallic_as_diffuse"), "");
}

TEST(GltfMaterials, KeepsOpacityWhereItCounts) {
  GltfBuilder file = textured("2 1 4  0.5 0.5 0.5 1  0.5 0.5 0.5 0.6");
  EXPECT_EQ(read(file).scene.textures.at(0).channels, 3);  // glTF: OPAQUE ignores alpha
  material(file)["alphaMode"] = "BLEND";
  const GltfScene blended = read(file);
  EXPECT_EQ(blended.scene.materials.at(0).alpha_mode, AlphaMode::kBlend);
  EXPECT_EQ(blended.scene.textures.at(0).channels, 4);
  EXPECT_FLOAT_EQ(blended.scene.textures.at(0).values.at(7), 0.6f);
  EXPECT_THAT(blended.warnings, IsEmpty());  // it is simulated
  material(file)["alphaMode"] = "MASK";
  material(file)["alphaCutoff"] = 0.7;
  const GltfScene masked = read(file);
  EXPECT_EQ(masked.scene.materials.at(0).alpha_mode, AlphaMode::kMask);
  EXPECT_EQ(masked.scene.materials.at(0).alpha_cutoff, 0.7);
  EXPECT_THAT(masked.warnings, IsEmpty());
}

TEST(GltfMaterials, WarnsOfUnlit) {
  GltfBuilder file = square();
  material(file)["extensions"]["KHR_materials_unlit"] = json::object();
  EXPECT_THAT(warning_text(read(file), "unlit"), HasSubstr("'grey' (100 %"));
}

TEST(GltfMaterials, WarnsOfExtensionsThatItIgnores) {
  GltfBuilder file = square();
  file.document["extensionsUsed"] = {"KHR_materials_ior", "ACME_sand", "ACME_moss"};
  EXPECT_EQ(warning_text(read(file), "extensions_ignored"), "extensions that are not read: 'ACME_sand', 'ACME_moss'");
}

// The square with colours of four floats a vertex.
GltfBuilder colored(const std::vector<float>& colors) {
  GltfBuilder file = square();
  file.document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = file.add_floats(colors, "VEC4");
  return file;
}

TEST(GltfMaterials, ReadsVertexColoursOfEveryType) {
  // Red, about half green, a fifth of blue, white.
  const std::vector<std::uint8_t> narrow = {255, 0, 0, 255, 0, 128, 0, 255, 0, 0, 51, 255, 255, 255, 255, 255};
  std::vector<std::uint16_t> wide;
  std::vector<float> floats;
  for (const std::uint8_t value : narrow) {
    wide.push_back(static_cast<std::uint16_t>(value * 257));
    floats.push_back(static_cast<float>(value) / 255);
  }
  for (const int type : {5121, 5123, 5126}) {
    GltfBuilder file = square();
    const int view = file.add_view(type == 5121 ? bytes_of(narrow) : type == 5123 ? bytes_of(wide) : bytes_of(floats));
    const int accessor = file.add_accessor(view, type, "VEC4", 4);
    file.document["accessors"][accessor]["normalized"] = type != 5126;
    file.document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = accessor;
    const GltfScene scene = read(file);
    const std::vector<Vec3>& colors = scene.scene.meshes.at(0).colors;
    ASSERT_EQ(colors.size(), 4u);
    EXPECT_EQ(colors[0], (Vec3{1, 0, 0}));
    EXPECT_NEAR(colors[1].y, 128 / 255.0, kFloat);
    EXPECT_NEAR(colors[2].z, 0.2, kFloat);
    EXPECT_EQ(colors[3], (Vec3{1, 1, 1}));
    EXPECT_THAT(scene.warnings, IsEmpty());
  }
}

TEST(GltfMaterials, LeavesOutVertexColoursThatAreAllWhite) {
  EXPECT_TRUE(read(colored(std::vector<float>(16, 1.0f))).scene.meshes.at(0).colors.empty());
}

TEST(GltfMaterials, LimitsTheProductOfFactorAndVertexColour) {
  // White paint: the limit touches the first vertex only, which one of two equal triangles uses.
  GltfBuilder file = colored({1, 0.75f, 0.5f, 1, 0.5f, 0.5f, 0.5f, 1, 0.5f, 0.5f, 0.5f, 1, 0.25f, 0.25f, 0.25f, 1});
  material(file)["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 1};
  file.document["meshes"][0]["primitives"][0]["indices"] = file.add_indices({0, 1, 2, 3, 2, 1});
  const GltfScene scene = read(file, 0.8);
  const Mesh& mesh = scene.scene.meshes.at(0);
  const auto product = [&](std::size_t i) { return scaled_by(scene.scene.materials[0].reflectance, mesh.colors[i]); };
  EXPECT_DOUBLE_EQ(product(0).x, 0.8);
  EXPECT_DOUBLE_EQ(product(0).y, 0.75);
  EXPECT_DOUBLE_EQ(product(0).z, 0.5);
  EXPECT_DOUBLE_EQ(product(1).x, 0.5);
  EXPECT_DOUBLE_EQ(product(3).x, 0.25);
  EXPECT_THAT(warning_text(scene, "reflectance_limited"), HasSubstr("'grey' (50 %"));
}

TEST(GltfMaterials, LimitsVertexColoursOfALeafAsThoseOfOtherMaterials) {
  GltfBuilder file = colored({0.25f, 0.5f, 1, 1, 0.5f, 0.5f, 0.5f, 1, 0.5f, 0.5f, 0.5f, 1, 0.5f, 0.5f, 0.5f, 1});
  material(file)["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 1};
  material(file)["extensions"]["KHR_materials_diffuse_transmission"] = {{"diffuseTransmissionFactor", 0.5}};
  const GltfScene scene = read(file, 0.8);
  const Vec3 product = scaled_by(scene.scene.materials[0].reflectance, scene.scene.meshes.at(0).colors[0]);
  EXPECT_DOUBLE_EQ(product.x, 0.125);
  EXPECT_DOUBLE_EQ(product.y, 0.25);
  EXPECT_DOUBLE_EQ(product.z, 0.4);
  EXPECT_DOUBLE_EQ(scene.scene.materials[0].diffuse_transmittance.x, 0.4);
}

TEST(GltfMaterials, LimitsVertexColoursToOneAndSaysWhatItLeavesOut) {
  GltfBuilder file = colored({3, 0.5f, -1, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0.5f});
  const GltfScene scene = read(file);
  EXPECT_EQ(scene.scene.meshes.at(0).colors.at(0), (Vec3{1, 0.5, 0}));
  EXPECT_THAT(warning_text(scene, "vertex_colors_limited"), HasSubstr("100 %"));
  EXPECT_EQ(warning_text(scene, "vertex_alpha_not_simulated"), "");
  material(file)["alphaMode"] = "BLEND";
  EXPECT_THAT(warning_text(read(file), "vertex_alpha_not_simulated"), HasSubstr("100 %"));
}

void expect_map(const Scene& scene, Vec2 from, Vec2 to) {
  ASSERT_TRUE(scene.materials.at(0).reflectance_texture.has_value());
  const Vec2 image = scene.materials[0].reflectance_texture->transform.apply(from);
  EXPECT_NEAR(image.x, to.x, kFloat);
  EXPECT_NEAR(image.y, to.y, kFloat);
}

TEST(GltfMaterials, ReadsTheTransformOfTextureCoordinates) {
  constexpr double kQuarterTurn = 1.5707963267948966;
  GltfBuilder file = textured("1 1 3 0.5 0.5 0.5");
  const auto transformed = [&](const json& transform) {
    material(file)["pbrMetallicRoughness"]["baseColorTexture"]["extensions"]["KHR_texture_transform"] = transform;
    return read(file).scene;
  };
  EXPECT_EQ(read(file).scene.materials.at(0).reflectance_texture->transform, UvTransform{});
  expect_map(transformed({{"offset", {0.25, 0.5}}}), {0.1, 0.2}, {0.35, 0.7});
  expect_map(transformed({{"scale", {2, -3}}}), {0.1, 0.2}, {0.2, -0.6});
  // On the image, whose y points down, a quarter turn counter-clockwise takes right to up.
  expect_map(transformed({{"rotation", kQuarterTurn}}), {1, 0}, {0, -1});
  expect_map(transformed({{"rotation", kQuarterTurn}}), {0, 1}, {1, 0});
  // First the scale, then the turn, last the offset.
  const json all = {{"offset", {0.5, 0.5}}, {"rotation", kQuarterTurn}, {"scale", {2, 4}}};
  expect_map(transformed(all), {0.25, 0}, {0.5, 0});
  expect_map(transformed(all), {0, 0.25}, {1.5, 0.5});
}

TEST(GltfMaterials, ReadsTheCoordinatesThatTheTexturesName) {
  GltfBuilder file = textured("1 1 3 0.5 0.5 0.5");
  const int second = file.add_floats({0, 0, 0.5f, 0, 0.5f, 0.5f, 0, 0.5f}, "VEC2");
  const int fourth = file.add_floats({0, 0, 0.25f, 0, 0.25f, 0.25f, 0, 0.25f}, "VEC2");
  file.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = second;
  file.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_3"] = fourth;
  const auto looked_up = [&] {
    const Scene scene = read(file).scene;
    const Mesh& mesh = scene.meshes.at(0);
    return (scene.materials[0].reflectance_texture->texcoord == 0 ? mesh.texcoord0 : mesh.texcoord1).at(1).x;
  };
  EXPECT_EQ(looked_up(), 1);
  json& info = material(file)["pbrMetallicRoughness"]["baseColorTexture"];
  info["texCoord"] = 1;
  EXPECT_EQ(looked_up(), 0.5);
  // The extension overrides, and a set that is neither 0 nor 1 takes the place of the first.
  info["extensions"]["KHR_texture_transform"] = {{"texCoord", 3}};
  EXPECT_EQ(looked_up(), 0.25);
  EXPECT_EQ(read(file).scene.meshes.at(0).texcoord1.at(1).x, 0.5);
}

TEST(GltfMaterials, RefusesALimitThatDoesNotConverge) {
  expect_refused(read_bytes(square().glb(), {1.0}), {"largest reflectance is 1.0"});
}

}  // namespace
}  // namespace radbake::gltf
