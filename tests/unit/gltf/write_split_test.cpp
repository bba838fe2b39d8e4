// Vertices that the bake split, and all that belongs to them.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "client/gltf/write_vertices.h"
#include "tests/unit/gltf/write_support.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

void take_all_apart(const Scene& scene, std::vector<BakedMesh>& baked) {
  for (std::size_t i = 0; i < baked.size(); ++i) baked[i] = taken_apart(scene.meshes[i]);
}

void expect_the_triangles_as_baked(const Written& written) {
  ASSERT_EQ(written.after.scene.meshes.size(), written.before.scene.meshes.size());
  for (std::size_t i = 0; i < written.baked.size(); ++i) {
    EXPECT_EQ(corners_of(written.after.scene.meshes[i]), corners_of(written.before.scene.meshes[i], written.baked[i]));
    EXPECT_EQ(written.after.scene.meshes[i].normals, std::vector<Vec3>(0));
  }
}

TEST(WriteSplits, GivesTheTrianglesAsTheyWereBaked) {
  const Written written = write_baked(square().glb(), take_all_apart);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  expect_the_triangles_as_baked(written);
  // The file's four vertices, then copies of vertices 0 and 2 for the second triangle, 0 2 3.
  EXPECT_THAT(written.indices(written.primitive(0)["indices"]), ElementsAre(0, 1, 2, 4, 5, 3));
  const ordered_json& attributes = written.primitive(0)["attributes"];
  EXPECT_THAT(written.floats(attributes["POSITION"]),
              ElementsAre(0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 0, 1, 1, 0));
  const ordered_json& positions = written.document["accessors"][attributes["POSITION"].get<std::size_t>()];
  EXPECT_EQ(positions["count"], 6);
  EXPECT_EQ(positions["min"].dump(), "[0.0,0.0,0.0]");
  EXPECT_EQ(positions["max"].dump(), "[1.0,1.0,0.0]");
  EXPECT_THAT(written.floats(attributes["_IRRADIANCE"]),
              ElementsAre(0, 0, 0, 1, 2, 3, 2, 4, 6, 3, 6, 9, 4, 8, 12, 5, 10, 15));
  for (const ordered_json& view : written.document["bufferViews"]) EXPECT_EQ(view.value("byteOffset", 0) % 4, 0);
}

TEST(WriteSplits, TurnsAStripIntoAList) {
  const Written written = write_baked(strip().glb(), take_all_apart);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  EXPECT_EQ(written.primitive(0)["mode"], 4);
  EXPECT_EQ(written.indices(written.primitive(0)["indices"]).size(), 9u);
  expect_the_triangles_as_baked(written);
}

TEST(WriteSplits, GivesAMirroredInstanceItsOwnSplit) {
  GltfBuilder file = square();
  file.add_root({{"mesh", 0}, {"scale", {-1, 1, 1}}, {"translation", {-3, 0, 0}}});
  const Written written = write_baked(file.glb(), take_all_apart);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  expect_the_triangles_as_baked(written);
}

TEST(WriteSplits, TellsTheTwoSidesOfASheetApart) {
  GltfBuilder file = square();
  const int both = file.add_indices({0, 1, 2, 0, 2, 1});
  file.document["meshes"][0]["primitives"][0]["indices"] = both;
  const Written written = write_baked(file.glb(), take_all_apart);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  expect_the_triangles_as_baked(written);
}

TEST(WriteSplits, KeepsTrianglesThatWereNotBaked) {
  GltfBuilder file = square();
  // A point, a line over three vertices, and one over two.
  const int indices = file.add_indices({1, 1, 1, 0, 1, 2, 4, 0, 1, 0, 2, 3, 0, 2, 2});
  const int positions = file.add_floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0, 0}, "VEC3");
  file.document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = positions;
  file.document["meshes"][0]["primitives"][0]["indices"] = indices;
  const Written written = write_baked(file.glb(), take_all_apart);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  EXPECT_THAT(written.indices(written.primitive(0)["indices"]),
              ElementsAre(1, 1, 1, 0, 1, 2, 4, 0, 1, 5, 6, 3, 0, 2, 2));
  expect_the_triangles_as_baked(written);
  EXPECT_EQ(written.after.num_triangles_dropped, written.before.num_triangles_dropped);
}

TEST(WriteSplits, CopiesEveryAttributeInItsOwnTypeAndMorphTargetsToo) {
  GltfBuilder file = square();
  json& primitive = file.document["meshes"][0]["primitives"][0];
  // Three bytes a vertex, at a stride of four; and sparse displacements without a base.
  const int bytes = file.add_accessor(
      file.add_view(bytes_of<std::uint8_t>({1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0, 10, 11, 12, 0}), 4), 5121, "VEC3", 4);
  const int joints = file.add_accessor(
      file.add_view(bytes_of<std::uint16_t>({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15})), 5123, "VEC4", 4);
  const int places = file.add_view(std::string("\0\2", 2));
  const int moves = file.add_view(bytes_of<float>({0, 0, 5, 0, 0, 7}));
  const int target = file.add("accessors", {{"componentType", 5126},
                                            {"type", "VEC3"},
                                            {"count", 4},
                                            {"name", "smile"},
                                            {"sparse",
                                             {{"count", 2},
                                              {"indices", {{"bufferView", places}, {"componentType", 5121}}},
                                              {"values", {{"bufferView", moves}}}}}});
  primitive["attributes"]["_BYTES"] = bytes;
  primitive["attributes"]["JOINTS_0"] = joints;
  primitive["targets"] = json::array({{{"POSITION", target}}});
  const Written written = write_baked(file.glb(), take_all_apart);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  const ordered_json& attributes = written.primitive(0)["attributes"];
  // Vertices 0 to 3, then copies of 0 and 2.
  EXPECT_EQ(written.view(attributes["_BYTES"]),
            bytes_of<std::uint8_t>({1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0, 10, 11, 12, 0, 1, 2, 3, 0, 7, 8, 9, 0}));
  const ordered_json& accessor = written.document["accessors"][attributes["_BYTES"].get<std::size_t>()];
  EXPECT_EQ(accessor["componentType"], 5121);
  EXPECT_EQ(written.document["bufferViews"][accessor["bufferView"].get<std::size_t>()]["byteStride"], 4);
  EXPECT_EQ(written.view(attributes["JOINTS_0"]),
            bytes_of<std::uint16_t>({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 8, 9, 10, 11}));
  const ordered_json& morph = written.primitive(0)["targets"][0]["POSITION"];
  EXPECT_THAT(written.floats(morph), ElementsAre(0, 0, 5, 0, 0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 5, 0, 0, 7));
  EXPECT_EQ(written.document["accessors"][morph.get<std::size_t>()]["name"], "smile");
  EXPECT_FALSE(written.document["accessors"][morph.get<std::size_t>()].contains("sparse"));
}

TEST(WriteSplits, KeepsVerticesApartThatDifferInWhatIsNotRead) {
  // Without indices: corners 0 and 3, and 2 and 4, are one vertex to the bake, and differ in a custom attribute.
  GltfBuilder file = square();
  json& primitive = file.document["meshes"][0]["primitives"][0];
  const int positions = file.add_floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0}, "VEC3");
  const int heat = file.add_accessor(file.add_view(bytes_of<float>({10, 11, 12, 13, 14, 15})), 5126, "SCALAR", 6);
  primitive["attributes"] = {{"POSITION", positions}, {"_HEAT", heat}};
  primitive.erase("indices");
  // The bake does not split, and gives welded vertices one place.
  const auto unsplit = [](const Scene& scene, std::vector<BakedMesh>& baked) {
    ASSERT_EQ(scene.meshes[0].positions.size(), 4u);
    baked[0].lightmap = 0;
    baked[0].uvs = {{0, 0}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}};
  };
  const Written whole = write_baked(file.glb(), unsplit);
  ASSERT_TRUE(whole.result.ok()) << whole.result.error().message;
  EXPECT_FALSE(whole.primitive(0).contains("indices"));
  EXPECT_EQ(whole.primitive(0)["attributes"]["_HEAT"], heat);
  EXPECT_THAT(whole.floats(whole.primitive(0)["attributes"]["TEXCOORD_1"]),
              ElementsAre(0, 0, 0.5, 0, 0.5, 0.5, 0, 0, 0.5, 0.5, 0, 0.5));
  // The bake splits: the second triangle's corners get copies of the vertices that it has in the file.
  const Written split = write_baked(file.glb(), take_all_apart);
  ASSERT_TRUE(split.result.ok()) << split.result.error().message;
  expect_the_triangles_as_baked(split);
  const std::vector<float> heats = split.floats(split.primitive(0)["attributes"]["_HEAT"]);
  std::vector<float> by_corner;
  for (const std::uint32_t vertex : split.indices(split.primitive(0)["indices"])) by_corner.push_back(heats.at(vertex));
  EXPECT_THAT(by_corner, ElementsAre(10, 11, 12, 13, 14, 15));
}

TEST(WriteSplits, NeedsIndicesOf32BitsAbove65535Vertices) {
  GltfBuilder file;
  constexpr std::uint32_t kTriangles = 30'000;
  std::vector<float> positions;
  for (std::uint32_t i = 0; i < kTriangles + 2; ++i) {
    positions.insert(positions.end(), {static_cast<float>(i / 2), static_cast<float>(i % 2), 0});
  }
  const int accessor = file.add_floats(positions, "VEC3");
  file.add_root({{"mesh", file.add_mesh({{"attributes", {{"POSITION", accessor}}}, {"mode", 5}})}});
  const Written written = write_baked(file.glb(), take_all_apart);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  EXPECT_EQ(written.document["accessors"][written.primitive(0)["indices"].get<std::size_t>()]["componentType"], 5125);
  EXPECT_EQ(written.after.scene.meshes[0].triangles.size(), kTriangles);
  expect_the_triangles_as_baked(written);
}

TEST(WriteSplits, SharesWhatInstancesHaveInCommon) {
  GltfBuilder file = square();
  file.add_root({{"mesh", 0}, {"translation", {5, 0, 0}}});
  const auto bake = [](const Scene& scene, std::vector<BakedMesh>& baked) {
    take_all_apart(scene, baked);
    for (auto& uv : baked[1].uvs) uv[0] += 0.5f;
  };
  const Written written = write_baked(file.glb(), bake);
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  const ordered_json &one = written.primitive(0), &other = written.primitive(1);
  EXPECT_EQ(one["attributes"]["POSITION"], other["attributes"]["POSITION"]);
  EXPECT_EQ(one["indices"], other["indices"]);
  EXPECT_NE(one["attributes"]["TEXCOORD_1"], other["attributes"]["TEXCOORD_1"]);
  expect_the_triangles_as_baked(written);
}

// A square of two triangles that do not share vertices in the file, compressed without loss: position, a custom
// attribute of two 16-bit numbers, and a float.
GltfBuilder compressed_square() {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(2);
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int pair = builder.AddAttribute(draco::GeometryAttribute::GENERIC, 2, draco::DT_UINT16);
  const float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const int triangles[2][3] = {{0, 1, 2}, {0, 2, 3}};
  for (int face = 0; face < 2; ++face) {
    const auto corner = [&](int k) { return triangles[face][k]; };
    builder.SetAttributeValuesForFace(position, draco::FaceIndex(face), corners[corner(0)], corners[corner(1)],
                                      corners[corner(2)]);
    std::uint16_t pairs[3][2];
    for (int k = 0; k < 3; ++k) {
      pairs[k][0] = static_cast<std::uint16_t>(40'000 + corner(k));
      pairs[k][1] = static_cast<std::uint16_t>(corner(k));
    }
    builder.SetAttributeValuesForFace(pair, draco::FaceIndex(face), pairs[0], pairs[1], pairs[2]);
  }
  const auto mesh = builder.Finalize();
  draco::Encoder encoder;
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());

  GltfBuilder file;
  const int view = file.add_view(std::string(buffer.data(), buffer.size()));
  file.add("accessors",
           {{"componentType", 5126}, {"type", "VEC3"}, {"count", 4}, {"min", {0, 0, 0}}, {"max", {1, 1, 0}}});
  file.add("accessors", {{"componentType", 5123}, {"type", "VEC2"}, {"count", 4}});
  file.add("accessors", {{"componentType", 5123}, {"type", "SCALAR"}, {"count", 6}});
  const json draco = {
      {"bufferView", view},
      {"attributes",
       {{"POSITION", mesh->attribute(position)->unique_id()}, {"_PAIR", mesh->attribute(pair)->unique_id()}}}};
  file.add_root({{"mesh", file.add_mesh({{"attributes", {{"POSITION", 0}, {"_PAIR", 1}}},
                                         {"indices", 2},
                                         {"extensions", {{"KHR_draco_mesh_compression", draco}}}})}});
  file.document["extensionsUsed"] = file.document["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  return file;
}

TEST(WriteSplits, WritesACompressedPrimitivePlainWithAllItsAttributes) {
  const auto split = take_all_apart;
  const auto whole = [](const Scene& scene, std::vector<BakedMesh>& baked) {
    baked[0].irradiance.resize(scene.meshes[0].positions.size());
  };
  for (const Bake& bake : {Bake(split), Bake(whole)}) {
    const Written written = write_baked(compressed_square().glb(), bake);
    ASSERT_TRUE(written.result.ok()) << written.result.error().message;
    EXPECT_FALSE(written.primitive(0).contains("extensions"));
    EXPECT_FALSE(written.document.contains("extensionsRequired"));
    const ordered_json& attributes = written.primitive(0)["attributes"];
    const std::vector<float> positions = written.floats(attributes["POSITION"]);
    const std::string pairs = written.view(attributes["_PAIR"]);
    ASSERT_EQ(pairs.size() / 4, positions.size() / 3);
    const std::vector<std::uint32_t> indices = written.indices(written.primitive(0)["indices"]);
    EXPECT_EQ(indices.size(), 6u);
    for (const std::uint32_t vertex : indices) {
      std::uint16_t pair[2];
      std::memcpy(pair, &pairs.at(std::size_t{4} * vertex), 4);
      const float x = positions.at(std::size_t{3} * vertex), y = positions.at(std::size_t{3} * vertex + 1);
      EXPECT_EQ(pair[1], y == 0 ? x : 3 - x);
      EXPECT_EQ(pair[0], 40'000 + pair[1]);
    }
    if (!written.baked[0].uvs.empty()) expect_the_triangles_as_baked(written);
  }
}

TEST(WriteSplits, LeavesACompressedPrimitiveCompressedWhereNothingChanges) {
  const Written written = write_baked(compressed_square().glb(), [](const Scene&, std::vector<BakedMesh>&) {});
  ASSERT_TRUE(written.result.ok()) << written.result.error().message;
  EXPECT_TRUE(written.primitive(0)["extensions"].contains("KHR_draco_mesh_compression"));
  EXPECT_THAT(written.document["extensionsRequired"], ElementsAre("KHR_draco_mesh_compression"));
}

TEST(WrittenVertices, RefusesTrianglesThatAreNotTheScenes) {
  Mesh mesh;
  mesh.name = "wall";
  mesh.positions.resize(4);
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  const std::vector<std::uint32_t> same = {0, 1, 2, 3};
  BakedMesh baked = taken_apart(mesh);
  ASSERT_TRUE(written_vertices(mesh.triangles, same, mesh, baked).ok());
  const auto other_file = written_vertices({{0, 1, 2}, {1, 2, 3}}, same, mesh, baked);
  ASSERT_FALSE(other_file.ok());
  EXPECT_THAT(other_file.error().message, HasSubstr("'wall' does not fit the file: triangle 1 is not in it"));
  std::swap(baked.triangles[1][0], baked.triangles[1][1]);
  EXPECT_THAT(written_vertices(mesh.triangles, same, mesh, baked).error().message,
              HasSubstr("triangle 0 was not baked"));
}

}  // namespace
}  // namespace radbake::gltf
