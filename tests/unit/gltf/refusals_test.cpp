// One change makes a good file bad: what is said then, and that it names the guilty thing.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/unit/gltf/gltf_builder.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;

Result<GltfScene> read(const GltfBuilder& file) { return read_bytes(file.glb()); }

TEST(GltfRefusal, TheUnchangedFileIsGood) {
  const auto scene = read(square());
  ASSERT_TRUE(scene.ok()) << scene.error().message;
  EXPECT_EQ(scene->scene.meshes.size(), 1u);
}

TEST(GltfRefusal, NamesAFileThatIsMissing) {
  expect_refused(read_gltf("/nonexistent/scene.glb", decode_text_image, {}), {"scene.glb", "no such file"});
}

TEST(GltfRefusal, NamesAFolderThatIsNoFile) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "scene.glb");
  expect_refused(read_gltf(folder.path() / "scene.glb", decode_text_image, {}), {"not a regular file"});
}

TEST(GltfRefusal, SaysWhenAFileIsNotAGltf) {
  expect_refused(read_bytes(""), {"not a glTF", "empty"});
  expect_refused(read_bytes("solid cube\nfacet normal 0 0 1\n"), {"not a glTF"});
  expect_refused(read_bytes("{\"name\": 1}"), {"not a glTF", "asset"});
}

TEST(GltfRefusal, SaysWhereJsonIsBroken) {
  expect_refused(read_bytes("{\"asset\": {\"version\": \"2.0\",}}"), {"JSON", "column"});
}

TEST(GltfRefusal, NamesTheVersionItDoesNotRead) {
  GltfBuilder file = square();
  file.document["asset"]["version"] = "1.0";
  expect_refused(read(file), {"'1.0'"});
}

TEST(GltfRefusal, SaysHowMuchOfATruncatedGlbIsThere) {
  const std::string bytes = square().glb();
  const std::string half = std::to_string(bytes.size() / 2), whole = std::to_string(bytes.size());
  expect_refused(read_bytes(bytes.substr(0, bytes.size() / 2)), {"truncated", half.c_str(), whole.c_str()});
}

TEST(GltfRefusal, NamesAChunkBeyondTheEnd) {
  std::string bytes = square().glb();
  bytes[15] = 0x7f;  // highest byte of the first chunk's length
  expect_refused(read_bytes(bytes), {"truncated", "chunk 0"});
}

TEST(GltfRefusal, NamesABufferWithoutData) {
  GltfBuilder file = square();
  file.bin.clear();
  expect_refused(read(file), {"buffer 0", "missing"});
}

TEST(GltfRefusal, NamesAMissingBufferFile) {
  GltfBuilder file = square();
  file.document["buffers"][0]["uri"] = "walls.bin";
  expect_refused(read(file), {"buffer 0", "'walls.bin'", "missing"});
}

TEST(GltfRefusal, NamesABufferFileThatIsTooShort) {
  const TemporaryFolder folder;
  GltfBuilder file = square();
  folder.write("walls.bin", file.bin.substr(4));
  file.document["buffers"][0]["uri"] = "walls.bin";
  expect_refused(read_gltf(folder.write("scene.gltf", file.document.dump()), decode_text_image, {}),
                 {"buffer 0", "byteLength is 60", "56 bytes"});
}

TEST(GltfRefusal, ReadsNoFileOutsideTheFolder) {
  const TemporaryFolder outside, folder;
  GltfBuilder file = square();
  const std::filesystem::path secret = outside.write("secret.bin", file.bin);
  std::filesystem::create_symlink(secret, folder.path() / "link.bin");
  for (const std::string& uri :
       {secret.string(), "../" + outside.path().filename().string() + "/secret.bin", std::string("%2e%2e/secret.bin"),
        "file://" + secret.string(), std::string("link.bin")}) {
    file.document["buffers"][0]["uri"] = uri;
    expect_refused(read_gltf(folder.write("scene.gltf", file.document.dump()), decode_text_image, {}), {"buffer 0"});
  }
}

TEST(GltfRefusal, RunsNoCommandHiddenInAPath) {
  const TemporaryFolder folder;
  GltfBuilder file = square();
  const std::filesystem::path trace = folder.path() / "trace";
  file.document["buffers"][0]["uri"] = "$(touch " + trace.string() + ").bin";
  expect_refused(read_gltf(folder.write("scene.gltf", file.document.dump()), decode_text_image, {}), {"buffer 0"});
  EXPECT_FALSE(std::filesystem::exists(trace));
}

TEST(GltfRefusal, NamesAnIndexOfABufferViewOutOfRange) {
  GltfBuilder file = square();
  file.document["accessors"][0]["bufferView"] = 7;
  expect_refused(read(file), {"accessor 0", "bufferView is 7", "2 buffer views"});
}

TEST(GltfRefusal, NamesAnIndexOfABufferOutOfRange) {
  GltfBuilder file = square();
  file.document["bufferViews"][1]["buffer"] = 1;
  expect_refused(read(file), {"buffer view 1", "buffer is 1", "1 buffers"});
}

TEST(GltfRefusal, NamesAnIndexOfAnAccessorOutOfRange) {
  GltfBuilder file = square();
  file.document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 9;
  expect_refused(read(file), {"mesh 0 'square'", "primitive 0", "POSITION is 9"});
}

TEST(GltfRefusal, NamesIndicesOfMeshMaterialAndTextureOutOfRange) {
  GltfBuilder file = square();
  file.document["nodes"][0]["mesh"] = 4;
  expect_refused(read(file), {"node 0 'wall'", "mesh is 4"});
  file = square();
  file.document["meshes"][0]["primitives"][0]["material"] = 3;
  expect_refused(read(file), {"mesh 0 'square'", "material is 3"});
  file = square();
  file.document["materials"][0]["emissiveTexture"] = {{"index", 2}};
  expect_refused(read(file), {"material 0 'grey'", "emissiveTexture", "index is 2"});
}

TEST(GltfRefusal, NamesAViewBeyondItsBuffer) {
  GltfBuilder file = square();
  file.document["bufferViews"][1]["byteLength"] = 1000;
  expect_refused(read(file), {"buffer view 1", "byte 1048", "which has 60"});
}

TEST(GltfRefusal, NamesAnAccessorBeyondItsView) {
  GltfBuilder file = square();
  file.document["accessors"][0]["count"] = 5;
  expect_refused(read(file), {"accessor 0", "5 elements", "byte 60", "buffer view 0", "48"});
}

TEST(GltfRefusal, NamesAnAbsurdCount) {
  GltfBuilder file = square();
  file.document["accessors"][0]["count"] = std::numeric_limits<std::uint64_t>::max();
  expect_refused(read(file), {"accessor 0", "count is 18446744073709551615", "limit"});
  file.document["accessors"][0]["count"] = 100'000'000;
  expect_refused(read(file), {"accessor 0", "100000000 elements", "48"});
}

TEST(GltfRefusal, NamesANegativeOffset) {
  GltfBuilder file = square();
  file.document["accessors"][0]["byteOffset"] = -12;
  expect_refused(read(file), {"accessor 0", "byteOffset is -12"});
}

TEST(GltfRefusal, NamesAStrideThatOverlapsElements) {
  GltfBuilder file = square();
  file.document["bufferViews"][0]["byteStride"] = 8;
  expect_refused(read(file), {"accessor 0", "byteStride of 8"});
}

TEST(GltfRefusal, NamesAVertexIndexOutOfRange) {
  GltfBuilder file = square();
  file.bin[48 + 2 * 4] = 17;  // fifth index
  expect_refused(read(file), {"mesh 0 'square'", "accessor 1", "index 17 of triangle 1", "4 vertices"});
}

TEST(GltfRefusal, NamesATriangleThatIsNotWhole) {
  GltfBuilder file = square();
  file.document["accessors"][1]["count"] = 5;
  expect_refused(read(file), {"accessor 1", "counts 5", "three"});
}

TEST(GltfRefusal, NamesAPositionThatIsNotFinite) {
  for (const float value : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    GltfBuilder file = square();
    std::memcpy(&file.bin[2 * 12 + 4], &value, sizeof value);
    expect_refused(read(file), {"accessor 0 (POSITION)", "vertex 2", "NaN or infinite"});
  }
}

TEST(GltfRefusal, NamesANodeThatTakesVerticesToInfinity) {
  GltfBuilder file = square();
  file.document["nodes"][0]["scale"] = {1e308, 1e308, 1e308};
  file.document["nodes"][0]["translation"] = {1.7e308, 0, 0};
  expect_refused(read(file), {"node 0 'wall'", "wall/square#0"});
}

TEST(GltfRefusal, NamesACycleInTheNodeTree) {
  GltfBuilder file = square();
  file.add("nodes", {{"children", {2}}});
  file.add("nodes", {{"name", "knot"}, {"children", {1}}});
  expect_refused(read(file), {"node 1", "cycle"});
  file = square();
  file.document["nodes"][0]["children"] = {0};
  expect_refused(read(file), {"node 0 'wall'", "cycle"});
}

TEST(GltfRefusal, NamesANodeWithTwoParents) {
  GltfBuilder file = square();
  file.add_root({{"children", {0}}});
  file.document["scenes"][0]["nodes"] = {1, 2};
  file.add("nodes", {{"children", {0}}});
  expect_refused(read(file), {"node 0 'wall'", "child of node 1 and of node 2"});
}

TEST(GltfRefusal, SaysWhenNoAreaIsLeftAfterTheTransforms) {
  GltfBuilder file = square();
  file.document["nodes"][0]["scale"] = {1, 0, 1};
  expect_refused(read(file), {"no surface", "2 have zero area"});
}

TEST(GltfRefusal, SaysWhenOnlyPrimitivesWithoutTrianglesAreThere) {
  GltfBuilder file = square();
  file.document["meshes"][0]["primitives"][0]["mode"] = 1;
  expect_refused(read(file), {"no surface", "1 primitives are skipped"});
}

TEST(GltfRefusal, NamesARequiredExtensionThatItDoesNotKnow) {
  for (const char* extension : {"KHR_texture_transform", "KHR_mesh_quantization", "ACME_walls"}) {
    GltfBuilder file = square();
    file.document["extensionsRequired"] = {extension};
    expect_refused(read(file), {"required extension", extension, "not supported"});
  }
}

TEST(GltfRefusal, NamesASparseAccessor) {
  GltfBuilder file = square();
  file.document["accessors"][0]["sparse"] = {
      {"count", 1}, {"indices", {{"bufferView", 1}, {"componentType", 5123}}}, {"values", {{"bufferView", 0}}}};
  expect_refused(read(file), {"accessor 0 (POSITION)", "sparse"});
}

TEST(GltfRefusal, NamesQuantisedPositions) {
  GltfBuilder file = square();
  file.document["accessors"][0]["componentType"] = 5122;
  expect_refused(read(file), {"accessor 0 (POSITION)", "5122"});
}

TEST(GltfRefusal, NamesARotationThatIsNone) {
  GltfBuilder file = square();
  file.document["nodes"][0]["rotation"] = {0, 0, 0, 0};
  expect_refused(read(file), {"node 0 'wall'", "rotation"});
}

TEST(GltfRefusal, NamesAValueOfTheWrongKind) {
  GltfBuilder file = square();
  file.document["nodes"][0]["translation"] = {0, "up", 0};
  expect_refused(read(file), {"node 0 'wall'", "translation[1]", "'up'"});
  file = square();
  file.document["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {0.5, -0.5, 0.5, 1};
  expect_refused(read(file), {"material 0 'grey'", "baseColorFactor[1] is -0.5"});
  file = square();
  file.document["nodes"] = 3;
  expect_refused(read(file), {"nodes is 3, not an array"});
}

TEST(GltfRefusal, NamesAnImageThatDoesNotDecode) {
  GltfBuilder file = square();
  const int uv = file.add_floats({0, 0, 1, 0, 1, 1, 0, 1}, "VEC2");
  file.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv;
  file.add("images", {{"name", "bricks"}, {"bufferView", file.add_view("garbage!")}, {"mimeType", "image/png"}});
  file.add("textures", {{"source", 0}});
  file.document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
  expect_refused(read(file), {"material 0 'grey'", "image 0 'bricks'", "test decoder"});
}

TEST(GltfRefusal, NamesAnImageFileThatIsMissing) {
  GltfBuilder file = square();
  const int uv = file.add_floats({0, 0, 1, 0, 1, 1, 0, 1}, "VEC2");
  file.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv;
  file.add("images", {{"uri", "bricks.png"}});
  file.add("textures", {{"source", 0}});
  file.document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}};
  expect_refused(read(file), {"material 0 'grey'", "image 0 'bricks.png'", "missing"});
}

TEST(GltfRefusal, NamesATextureWithoutItsCoordinates) {
  GltfBuilder file = square();
  file.add("images", {{"bufferView", file.add_view("1 1 3 0.5 0.5 0.5")}, {"mimeType", "image/png"}});
  file.add("textures", {{"source", 0}});
  file.document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}, {"texCoord", 1}};
  expect_refused(read(file), {"mesh 0 'square'", "'grey'", "TEXCOORD_1"});
}

TEST(GltfRefusal, BoundsTheDepthOfItsJson) {
  GltfBuilder file = square();
  std::string text = file.document.dump();
  text.insert(1, "\"extras\":" + std::string(100000, '[') + std::string(100000, ']') + ",");
  expect_refused(read_bytes(text), {"JSON", "nested deeper than 64"});
}

TEST(GltfRefusal, BoundsWhatASmallFileMayUnfoldTo) {
  // 30,000 triangles placed 2,000 times: 60 million from a file of 0.4 MB.
  GltfBuilder file = square();
  file.document["accessors"][1] = {{"bufferView", file.add_view(std::string(90000 * 2, '\0'))},
                                   {"componentType", 5123},
                                   {"type", "SCALAR"},
                                   {"count", 90000}};
  for (int i = 1; i < 2000; ++i) file.add_root({{"mesh", 0}});
  expect_refused(read(file), {"triangles", "limit of 50000000"});
}

TEST(GltfRefusal, DoesNotOverflowOnAChainOfManyNodes) {
  GltfBuilder file = square();
  constexpr int kDepth = 200'000;
  for (int i = 1; i <= kDepth; ++i) {
    json node = {{"translation", {1, 0, 0}}};
    if (i < kDepth) node["children"] = {i + 1};
    file.add("nodes", node);
  }
  file.document["nodes"][0]["children"] = {1};
  EXPECT_TRUE(read(file).ok());
}

}  // namespace
}  // namespace radbake::gltf
