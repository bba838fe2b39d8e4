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
  expect_refused(read(file), {"mesh 0 'square'", "accessor 1 (indices)", "index 17 at corner 4", "4 vertices"});
}

TEST(GltfRefusal, NamesATriangleThatIsNotWhole) {
  GltfBuilder file = square();
  file.document["accessors"][1]["count"] = 5;
  expect_refused(read(file), {"accessor 1 (indices)", "5 corners", "three"});
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
  for (const char* extension : {"EXT_meshopt_compression", "KHR_texture_basisu", "ACME_walls"}) {
    GltfBuilder file = square();
    file.document["extensionsRequired"] = {extension};
    expect_refused(read(file), {"required extension", extension, "not supported"});
  }
}

TEST(GltfRefusal, NamesAStripOrFanThatIsNotATriangle) {
  GltfBuilder file = square();
  file.document["accessors"][1]["count"] = 2;
  file.document["meshes"][0]["primitives"][0]["mode"] = 5;
  expect_refused(read(file), {"accessor 1 (indices)", "triangle strip has 2 corners, fewer than three"});
  file.document["meshes"][0]["primitives"][0]["mode"] = 6;
  expect_refused(read(file), {"accessor 1 (indices)", "triangle fan has 2 corners, fewer than three"});
}

// The square whose last vertex is replaced by one of a sparse list: index in view 2, value in view 3.
GltfBuilder sparse_square(const std::vector<std::uint16_t>& indices = {3}) {
  GltfBuilder file = square();
  const int index_view = file.add_view(bytes_of(indices));
  const int value_view = file.add_view(bytes_of(std::vector<float>(3 * indices.size(), 0.5f)));
  file.document["accessors"][0]["sparse"] = {{"count", indices.size()},
                                             {"indices", {{"bufferView", index_view}, {"componentType", 5123}}},
                                             {"values", {{"bufferView", value_view}}}};
  return file;
}

TEST(GltfRefusal, NamesASparseListThatIsNoneOrTooLong) {
  ASSERT_TRUE(read(sparse_square()).ok());
  GltfBuilder file = sparse_square();
  json& sparse = file.document["accessors"][0]["sparse"];
  sparse["count"] = 5;
  expect_refused(read(file), {"accessor 0, sparse: count is 5", "the accessor's 4"});
  sparse["count"] = 0;
  expect_refused(read(file), {"accessor 0, sparse: count is 0"});
  sparse["count"] = 2;
  expect_refused(read(file), {"accessor 0, sparse, indices: its 2 elements end at byte 4 of buffer view 2"});
  sparse["indices"]["bufferView"] = 0;
  expect_refused(read(file), {"accessor 0, sparse, values: its 2 elements end at byte 24 of buffer view 3"});
  sparse["values"]["bufferView"] = 9;
  expect_refused(read(file), {"accessor 0, sparse, values: bufferView is 9"});
  sparse.erase("values");
  expect_refused(read(file), {"accessor 0, sparse: values is missing"});
  sparse["indices"]["componentType"] = 5122;
  expect_refused(read(file), {"accessor 0, sparse, indices: componentType is 5122"});
  file.document["accessors"][0]["sparse"] = true;
  expect_refused(read(file), {"accessor 0: sparse is true, not an object"});
}

TEST(GltfRefusal, NamesASparseIndexThatIsNoElementOrDoesNotAscend) {
  expect_refused(read(sparse_square({4})), {"accessor 0 (POSITION): its sparse index 0 is 4", "4 elements"});
  expect_refused(read(sparse_square({2, 2})), {"accessor 0 (POSITION): its sparse index 1 is 2 after 2", "ascend"});
  expect_refused(read(sparse_square({3, 1})), {"accessor 0 (POSITION): its sparse index 1 is 1 after 3", "ascend"});
}

TEST(GltfRefusal, BoundsWhatAnAccessorWithoutAViewMayCount) {
  GltfBuilder file = square();
  file.document["accessors"][0].erase("bufferView");
  file.document["accessors"][0]["count"] = 40'000'000;
  expect_refused(read(file), {"accessor 0 (POSITION) counts 40000000 elements without a bufferView", "1000000"});
}

TEST(GltfRefusal, NamesAnAttributeOfATypeThatItCannotHave) {
  const auto with = [](const char* attribute, int type, const char* vector, bool is_normalized) {
    GltfBuilder file = square();
    const int accessor = file.add_accessor(file.add_view(std::string(128, '\0')), type, vector, 4);
    file.document["accessors"][accessor]["normalized"] = is_normalized;
    file.document["meshes"][0]["primitives"][0]["attributes"][attribute] = accessor;
    return file;
  };
  expect_refused(read(with("POSITION", 5125, "VEC3", false)),
                 {"accessor 2 (POSITION) holds 32-bit unsigned integers, not floats or integers of 8 or 16 bits"});
  expect_refused(read(with("NORMAL", 5120, "VEC3", false)),
                 {"accessor 2 (NORMAL) holds 8-bit signed integers", "normalised signed"});
  expect_refused(read(with("NORMAL", 5121, "VEC3", true)), {"accessor 2 (NORMAL) holds normalised 8-bit unsigned"});
  expect_refused(read(with("TEXCOORD_0", 5126, "VEC3", false)), {"accessor 2 (TEXCOORD_0) holds 3 numbers", "not 2"});
  expect_refused(read(with("COLOR_0", 5123, "VEC4", false)), {"accessor 2 (COLOR_0) holds 16-bit unsigned integers"});
  expect_refused(read(with("COLOR_0", 5126, "VEC2", false)), {"accessor 2 (COLOR_0) holds 2 numbers", "not 3 or 4"});
  expect_refused(read(with("COLOR_0", 5126, "MAT2", false)), {"accessor 2 (COLOR_0) holds no vectors"});
}

TEST(GltfRefusal, NamesAColourThatIsNotFinite) {
  GltfBuilder file = square();
  std::vector<float> colors(16, 1.0f);
  colors[9] = std::numeric_limits<float>::quiet_NaN();
  file.document["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = file.add_floats(colors, "VEC4");
  expect_refused(read(file), {"accessor 2 (COLOR_0): the value of vertex 2 is NaN"});
}

TEST(GltfRefusal, NamesATextureTransformThatIsNone) {
  const auto with = [](const char* key, const json& value) {
    GltfBuilder file = square();
    const int uv = file.add_floats({0, 0, 1, 0, 1, 1, 0, 1}, "VEC2");
    file.document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = uv;
    file.add("images", {{"bufferView", file.add_view("1 1 3 0.5 0.5 0.5")}, {"mimeType", "image/png"}});
    file.add("textures", {{"source", 0}});
    file.document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {
        {"index", 0}, {"extensions", {{"KHR_texture_transform", {{key, value}}}}}};
    return file;
  };
  const std::string place = "material 0 'grey', pbrMetallicRoughness, baseColorTexture, KHR_texture_transform: ";
  EXPECT_TRUE(read(with("offset", {2, 3})).ok());
  expect_refused(read(with("offset", 3)), {(place + "offset is 3, not 2 numbers").c_str()});
  expect_refused(read(with("scale", {1, 2, 3})), {(place + "scale is an array of 3, not 2 numbers").c_str()});
  expect_refused(read(with("scale", {1, 1e300})), {(place + "scale[1] is 1e+300").c_str()});
  // JSON has no NaN: it comes as null.
  expect_refused(read(with("offset", {0, nullptr})), {(place + "offset[1] is null").c_str()});
  expect_refused(read(with("rotation", "half")), {(place + "rotation is 'half'").c_str()});
  expect_refused(read(with("texCoord", -1)), {(place + "texCoord").c_str()});
  expect_refused(read(with("texCoord", 3)), {"mesh 0 'square'", "texture on TEXCOORD_3, which the primitive lacks"});
}

TEST(GltfRefusal, NamesAMaterialWhoseTexturesNeedTwoSets) {
  GltfBuilder file = square();
  file.add("images", {{"bufferView", file.add_view("1 1 3 0.5 0.5 0.5")}, {"mimeType", "image/png"}});
  file.add("textures", {{"source", 0}});
  json& material = file.document["materials"][0];
  material["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", 0}, {"texCoord", 2}};
  material["emissiveTexture"] = {{"index", 0}, {"texCoord", 0}};
  material["emissiveFactor"] = {1, 1, 1};
  expect_refused(read(file), {"material 0 'grey'", "baseColorTexture uses TEXCOORD_2", "emissiveTexture TEXCOORD_0"});
}

TEST(GltfRefusal, NamesATexelDensityOutOfRange) {
  for (const json& value : {json(0), json(-1), json(65), json("fine")}) {
    GltfBuilder file = square();
    file.document["nodes"][0]["extras"]["radbake_texel_density"] = value;
    expect_refused(read(file), {"node 0 'wall', extras: radbake_texel_density is "});
    file = square();
    file.document["meshes"][0]["extras"]["radbake_texel_density"] = value;
    expect_refused(read(file), {"mesh 0 'square', extras: radbake_texel_density is "});
  }
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
