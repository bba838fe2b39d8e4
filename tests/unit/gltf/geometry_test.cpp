#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/gltf/gltf_builder.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Sums of products of numbers near 1: some roundings of double.
constexpr double kRounding = 1e-15;

Scene read(const GltfBuilder& file) {
  Result<GltfScene> result = read_bytes(file.glb());
  EXPECT_TRUE(result.ok()) << result.error().message;
  return result.ok() ? std::move(result)->scene : Scene{};
}

void expect_near(Vec3 actual, Vec3 expected) {
  EXPECT_NEAR(actual.x, expected.x, kRounding);
  EXPECT_NEAR(actual.y, expected.y, kRounding);
  EXPECT_NEAR(actual.z, expected.z, kRounding);
}

Vec3 area_vector(const Mesh& mesh, std::size_t i) {
  const auto& t = mesh.triangles[i];
  return cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]]) * 0.5;
}

TEST(GltfGeometry, KeepsTheOrderOfTheFile) {
  const Scene scene = read(square());
  ASSERT_EQ(scene.meshes.size(), 1u);
  const Mesh& mesh = scene.meshes[0];
  EXPECT_EQ(mesh.name, "wall/square#0");
  EXPECT_THAT(mesh.positions, ElementsAre(Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{1, 1, 0}, Vec3{0, 1, 0}));
  EXPECT_THAT(mesh.triangles, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3)));
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_TRUE(mesh.texcoord1.empty());
}

TEST(GltfGeometry, ReadsTheSameFromDataUriFileAndBinaryChunk) {
  const TemporaryFolder folder;
  const GltfBuilder file = square();
  const Scene from_glb = read(file);
  const auto embedded = read_bytes(file.gltf());
  ASSERT_TRUE(embedded.ok()) << embedded.error().message;
  // A name with what URIs escape, and a file longer than what is used of it.
  GltfBuilder external = file;
  folder.write("my walls+1.bin", file.bin + "more");
  external.document["buffers"][0]["uri"] = "my%20walls+1.bin";
  const auto beside = read_gltf(folder.write("scene.gltf", external.document.dump()), decode_text_image, ReadOptions{});
  ASSERT_TRUE(beside.ok()) << beside.error().message;
  EXPECT_EQ(embedded->scene.meshes[0].positions, from_glb.meshes[0].positions);
  EXPECT_EQ(beside->scene.meshes[0].positions, from_glb.meshes[0].positions);
  EXPECT_EQ(beside->scene.meshes[0].triangles, from_glb.meshes[0].triangles);
}

TEST(GltfGeometry, MultipliesTransformsDownTheNodeTree) {
  GltfBuilder file = square();
  // Child: shifted by x; parent: turned by 90 degrees about z, doubled.
  file.document["nodes"][0]["translation"] = {1, 0, 0};
  file.add("nodes", {{"name", "parent"},
                     {"children", {0}},
                     {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}},
                     {"scale", {2, 2, 2}}});
  file.document["scenes"][0]["nodes"] = {1};
  const Scene scene = read(file);
  ASSERT_EQ(scene.meshes.size(), 1u);
  expect_near(scene.meshes[0].positions[0], {0, 2, 0});
  expect_near(scene.meshes[0].positions[1], {0, 4, 0});
  expect_near(scene.meshes[0].positions[3], {-2, 2, 0});
}

TEST(GltfGeometry, TakesAMatrixColumnByColumn) {
  GltfBuilder file = square();
  file.document["nodes"][0]["matrix"] = {0, 0, 3, 0, 1, 0, 0, 0, 0, 1, 0, 0, 5, 6, 7, 1};
  const Scene scene = read(file);
  expect_near(scene.meshes[0].positions[1], {5, 6, 10});
  expect_near(scene.meshes[0].positions[3], {6, 6, 7});
}

TEST(GltfGeometry, AMirroredNodeKeepsTheFrontInFront) {
  GltfBuilder file = square();
  const int normals = file.add_floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  file.document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals;
  file.document["nodes"][0]["scale"] = {-1, 1, 1};
  const Mesh mesh = read(file).meshes.at(0);
  // Without the flip of the winding, the geometric normal would be -Z.
  expect_near(area_vector(mesh, 0), {0, 0, 0.5});
  expect_near(area_vector(mesh, 1), {0, 0, 0.5});
  expect_near(mesh.normals[0], {0, 0, 1});
}

TEST(GltfGeometry, NonUniformScaleKeepsNormalsPerpendicular) {
  GltfBuilder file;
  // A slope of 45 degrees whose normal is (-1, 0, 1) / sqrt 2.
  const float n = std::sqrt(0.5f);
  const int positions = file.add_floats({0, 0, 0, 1, 0, 1, 0, 1, 0}, "VEC3");
  const int normals = file.add_floats({-n, 0, n, -n, 0, n, -n, 0, n}, "VEC3");
  const int mesh = file.add_mesh({{"attributes", {{"POSITION", positions}, {"NORMAL", normals}}}});
  file.add_root({{"mesh", mesh}, {"scale", {4, 1, 1}}});
  const Mesh placed = read(file).meshes.at(0);
  // Scaling x by 4 makes the slope 1/4: its normal is (-1, 0, 4) / sqrt 17.
  const Vec3 expected = Vec3{-1, 0, 4} / std::sqrt(17.0);
  constexpr double kFloatNormal = 1e-7;  // the file's normals are float
  EXPECT_NEAR(length(placed.normals[0] - expected), 0, kFloatNormal);
  expect_near(normalized(area_vector(placed, 0)), expected);
}

TEST(GltfGeometry, ReadsStridedViewsAndOffsets) {
  GltfBuilder file;
  // Interleaved: position, then texture coordinate; 20 bytes a vertex.
  const std::vector<float> interleaved = {0, 0, 0, 0.1f, 0.2f, 2, 0, 0, 0.3f, 0.4f, 0, 2, 0, 0.5f, 0.6f};
  const int view = file.add_view(bytes_of(interleaved), 20);
  const int positions = file.add_accessor(view, 5126, "VEC3", 3);
  const int uv = file.add_accessor(view, 5126, "VEC2", 3);
  file.document["accessors"][uv]["byteOffset"] = 12;
  file.add_root({{"mesh", file.add_mesh({{"attributes", {{"POSITION", positions}, {"TEXCOORD_1", uv}}}})}});
  const Mesh mesh = read(file).meshes.at(0);
  EXPECT_THAT(mesh.positions, ElementsAre(Vec3{0, 0, 0}, Vec3{2, 0, 0}, Vec3{0, 2, 0}));
  EXPECT_THAT(mesh.texcoord1, ElementsAre(Vec2{0.1f, 0.2f}, Vec2{0.3f, 0.4f}, Vec2{0.5f, 0.6f}));
  EXPECT_THAT(mesh.triangles, ElementsAre(ElementsAre(0, 1, 2)));
}

TEST(GltfGeometry, ReadsIndicesOfEveryWidth) {
  const std::vector<std::uint32_t> wide = {0, 2, 3};
  const std::string bytes[] = {{"\x00\x02\x03", 3}, bytes_of(std::vector<std::uint16_t>{0, 2, 3}), bytes_of(wide)};
  const int types[] = {5121, 5123, 5125};
  for (int i = 0; i < 3; ++i) {
    GltfBuilder file = square();
    file.document["meshes"][0]["primitives"][0]["indices"] =
        file.add_accessor(file.add_view(bytes[i]), types[i], "SCALAR", 3);
    // The second vertex is used by none.
    const Mesh mesh = read(file).meshes.at(0);
    EXPECT_THAT(mesh.triangles, ElementsAre(ElementsAre(0, 1, 2))) << types[i];
    EXPECT_THAT(mesh.positions, ElementsAre(Vec3{0, 0, 0}, Vec3{1, 1, 0}, Vec3{0, 1, 0})) << types[i];
  }
}

TEST(GltfGeometry, ReadsNormalisedTextureCoordinates) {
  GltfBuilder file = square();
  const std::string corners = bytes_of(std::vector<std::uint16_t>{0, 65535, 65535, 0, 13107, 0, 0, 0});
  const int uv = file.add_accessor(file.add_view(corners), 5123, "VEC2", 4);
  file.document["accessors"][uv]["normalized"] = true;
  file.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv;
  EXPECT_THAT(read(file).meshes.at(0).texcoord0, ElementsAre(Vec2{0, 1}, Vec2{1, 0}, Vec2{0.2, 0}, Vec2{0, 0}));
}

TEST(GltfGeometry, PlacesAMeshOnceForEachNode) {
  GltfBuilder file = square();
  file.add_root({{"mesh", 0}, {"translation", {0, 0, 3}}});
  const Scene scene = read(file);
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[1].name, "node1/square#0");
  EXPECT_EQ(scene.meshes[1].positions[0].z, 3);
  EXPECT_EQ(scene.materials.size(), 1u);
}

TEST(GltfGeometry, ReadsTheDefaultSceneOnly) {
  GltfBuilder file = square();
  const int other = file.add("nodes", {{"mesh", 0}, {"translation", {0, 0, 9}}});
  file.add("scenes", {{"nodes", {other}}});
  EXPECT_EQ(read(file).meshes.at(0).positions[0].z, 0);
  file.document["scene"] = 1;
  EXPECT_EQ(read(file).meshes.at(0).positions[0].z, 9);
}

TEST(GltfGeometry, DropsAndCountsTrianglesOfZeroArea) {
  GltfBuilder file = square();
  file.document["meshes"][0]["primitives"][0]["indices"] = file.add_indices({0, 1, 2, 1, 1, 2, 0, 2, 3});
  const auto result = read_bytes(file.glb());
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->num_triangles_dropped, 1u);
  EXPECT_THAT(result->scene.meshes[0].triangles, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(0, 2, 3)));
  EXPECT_THAT(warning_text(*result, "triangles_dropped"), HasSubstr("1 triangles"));
}

TEST(GltfGeometry, ReplacesNormalsThatAreNone) {
  GltfBuilder file = square();
  const int normals = file.add_floats({0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, NAN}, "VEC3");
  file.document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = normals;
  const auto result = read_bytes(file.glb());
  ASSERT_TRUE(result.ok());
  for (const Vec3& normal : result->scene.meshes[0].normals) EXPECT_EQ(normal, (Vec3{0, 0, 1}));
  EXPECT_THAT(warning_text(*result, "normals_replaced"), HasSubstr("100 %"));
}

TEST(GltfGeometry, SaysWhereEachVertexOfTheFileWent) {
  // Two triangles without an index: the corners of their common edge are there twice, and one triangle has no area.
  GltfBuilder file;
  const int positions =
      file.add_floats({5, 5, 5, 6, 6, 6, 7, 7, 7, 0, 0, 0, 1, 0, 0, 1, 1, 0, 1, 1, 0, 0, 1, 0, 0, 0, 0}, "VEC3");
  file.add_root({{"mesh", file.add_mesh({{"attributes", {{"POSITION", positions}}}})}});
  const auto result = read_bytes(file.glb());
  ASSERT_TRUE(result.ok()) << result.error().message;
  const Mesh& mesh = result->scene.meshes.at(0);
  EXPECT_THAT(mesh.positions, ElementsAre(Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{1, 1, 0}, Vec3{0, 1, 0}));
  EXPECT_THAT(mesh.triangles, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(2, 3, 0)));
  EXPECT_THAT(result->scene_vertex.at(0), ElementsAre(kNoVertex, kNoVertex, kNoVertex, 0, 1, 2, 2, 3, 0));
  EXPECT_EQ(result->num_triangles_dropped, 1u);
}

TEST(GltfGeometry, KeepsVerticesApartThatDifferInAnyAttribute) {
  const std::vector<float> corners = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0};
  for (const auto& [name, type, size] : {std::tuple("NORMAL", "VEC3", 3), std::tuple("TEXCOORD_0", "VEC2", 2),
                                         std::tuple("TEXCOORD_1", "VEC2", 2), std::tuple("COLOR_0", "VEC3", 3)}) {
    std::vector<float> values;
    for (int vertex = 0; vertex < 6; ++vertex) {
      for (int c = 0; c < size; ++c) values.push_back(c == size - 1 ? 1.0f : vertex == 3 ? 0.5f : 0.0f);
    }
    GltfBuilder file;
    const int positions = file.add_floats(corners, "VEC3"), other = file.add_floats(values, type);
    file.add_root({{"mesh", file.add_mesh({{"attributes", {{"POSITION", positions}, {name, other}}}})}});
    const auto result = read_bytes(file.glb());
    ASSERT_TRUE(result.ok()) << result.error().message;
    EXPECT_THAT(result->scene_vertex.at(0), ElementsAre(0, 1, 2, 3, 2, 4)) << name;
  }
}

TEST(GltfGeometry, GivesEveryPlacedNodeAnObjectAndNamesTheSources) {
  GltfBuilder file = square();
  file.document["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"indices", 1}});
  file.add_root({{"name", "empty"}});
  file.add_root({{"mesh", 0}, {"translation", {0, 0, 3}}});
  const auto result = read_bytes(file.glb());
  ASSERT_TRUE(result.ok()) << result.error().message;
  ASSERT_EQ(result->scene.meshes.size(), 4u);
  ASSERT_EQ(result->sources.size(), 4u);
  std::vector<std::array<int, 4>> found;
  for (std::size_t i = 0; i < 4; ++i) {
    const MeshSource& source = result->sources[i];
    found.push_back({source.node, source.mesh, source.primitive, result->scene.meshes[i].object});
  }
  EXPECT_THAT(found, ElementsAre(ElementsAre(0, 0, 0, 0), ElementsAre(2, 0, 0, 1), ElementsAre(0, 0, 1, 0),
                                 ElementsAre(2, 0, 1, 1)));
}

TEST(GltfGeometry, TakesTheTexelDensityOfTheNodeElseOfTheMesh) {
  GltfBuilder file = square();
  file.add_root({{"mesh", 0}, {"extras", {{"radbake_texel_density", 2}, {"colour", "of no matter"}}}});
  file.add_root({{"mesh", 0}, {"extras", "a text"}});
  const auto densities = [&] {
    std::vector<double> found;
    for (const Mesh& mesh : read(file).meshes) found.push_back(mesh.texel_density);
    return found;
  };
  EXPECT_THAT(densities(), ElementsAre(1, 2, 1));
  file.document["meshes"][0]["extras"] = {{"radbake_texel_density", 0.25}};
  EXPECT_THAT(densities(), ElementsAre(0.25, 2, 0.25));
}

TEST(GltfGeometry, SkipsLinesAndSkinnedMeshesWithAWarning) {
  GltfBuilder file = square();
  file.document["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"mode", 3}});
  file.add("skins", {{"joints", {0}}});
  file.add_root({{"mesh", 0}, {"skin", 0}});
  const auto result = read_bytes(file.glb());
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(result->scene.meshes.size(), 1u);
  std::vector<std::string> skipped;
  for (const Warning& warning : result->warnings) {
    if (warning.id == "primitives_skipped") skipped.push_back(warning.text);
  }
  EXPECT_THAT(skipped, ElementsAre(HasSubstr("2 primitives of points or lines"), HasSubstr("1 skinned")));
}

}  // namespace
}  // namespace radbake::gltf
