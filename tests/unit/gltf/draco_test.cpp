#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>

#include "client/gltf/decode_draco.h"
#include "tests/unit/gltf/gltf_builder.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

// Side of the grid of squares that the tests compress.
constexpr int kSide = 4;
constexpr std::size_t kTriangles = std::size_t{2} * kSide * kSide;

struct Compressed {
  std::string bytes;
  int position_id = 0, uv_id = 0;
  std::size_t num_points = 0;
};

// A grid in the plane z = 0 from (0, 0) to (1, 1), with texture coordinates equal to x and y; lossless.
Compressed compressed_grid(int method) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(kTriangles);
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int uv = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
  int face = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const int corners[2][3][2] = {{{0, 0}, {1, 0}, {1, 1}}, {{0, 0}, {1, 1}, {0, 1}}};
      for (const auto& triangle : corners) {
        float p[3][3], t[3][2];
        for (int k = 0; k < 3; ++k) {
          t[k][0] = p[k][0] = static_cast<float>(x + triangle[k][0]) / kSide;
          t[k][1] = p[k][1] = static_cast<float>(y + triangle[k][1]) / kSide;
          p[k][2] = 0;
        }
        builder.SetAttributeValuesForFace(position, draco::FaceIndex(face), p[0], p[1], p[2]);
        builder.SetAttributeValuesForFace(uv, draco::FaceIndex(face), t[0], t[1], t[2]);
        ++face;
      }
    }
  }
  const auto mesh = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetEncodingMethod(method);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
  return {std::string(buffer.data(), buffer.size()), static_cast<int>(mesh->attribute(position)->unique_id()),
          static_cast<int>(mesh->attribute(uv)->unique_id()), mesh->num_points()};
}

GltfBuilder draco_file(const Compressed& grid) {
  GltfBuilder file;
  const int view = file.add_view(grid.bytes);
  file.add("accessors", {{"componentType", 5126}, {"type", "VEC3"}, {"count", grid.num_points}});
  file.add("accessors", {{"componentType", 5126}, {"type", "VEC2"}, {"count", grid.num_points}});
  file.add("accessors", {{"componentType", 5123}, {"type", "SCALAR"}, {"count", 3 * kTriangles}});
  const int mesh = file.add_mesh(
      {{"attributes", {{"POSITION", 0}, {"TEXCOORD_1", 1}}},
       {"indices", 2},
       {"extensions",
        {{"KHR_draco_mesh_compression",
          {{"bufferView", view}, {"attributes", {{"POSITION", grid.position_id}, {"TEXCOORD_1", grid.uv_id}}}}}}}});
  file.add_root({{"mesh", mesh}});
  file.document["extensionsUsed"] = file.document["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  return file;
}

TEST(GltfDraco, ReadsACompressedPrimitive) {
  for (const int method : {draco::MESH_EDGEBREAKER_ENCODING, draco::MESH_SEQUENTIAL_ENCODING}) {
    const auto result = read_bytes(draco_file(compressed_grid(method)).glb());
    ASSERT_TRUE(result.ok()) << result.error().message;
    const Mesh& mesh = result->scene.meshes.at(0);
    EXPECT_EQ(mesh.triangles.size(), kTriangles);
    double area = 0;
    for (const auto& t : mesh.triangles) {
      area += cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]]).z / 2;
    }
    EXPECT_EQ(area, 1);  // sixteenths add without rounding, and all face +Z
    ASSERT_EQ(mesh.texcoord1.size(), mesh.positions.size());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
      EXPECT_EQ(mesh.texcoord1[i], (Vec2{mesh.positions[i].x, mesh.positions[i].y}));
    }
  }
}

TEST(GltfDraco, NamesTheViewOfDataThatIsCorrupt) {
  Compressed grid = compressed_grid(draco::MESH_EDGEBREAKER_ENCODING);
  grid.bytes.resize(grid.bytes.size() / 2);
  expect_refused(read_bytes(draco_file(grid).glb()), {"mesh 0", "primitive 0", "buffer view 0", "corrupt Draco"});
  grid.bytes[0] = 'X';
  expect_refused(read_bytes(draco_file(grid).glb()), {"buffer view 0", "does not start with DRACO"});
}

TEST(GltfDraco, RefusesMoreFacesThanTheAccessorCountsBeforeItDecodes) {
  // A whole stream of 42 bytes that claims 50 million faces and 2 vertices: the decoder would take a gigabyte.
  std::string bytes("DRACO\x02\x02\x01\x01\x00\x00", 11);
  bytes += std::string("\x00\x02", 2) + std::string("\x80\xe1\xeb\x17", 4);
  bytes.resize(42);
  Compressed grid = compressed_grid(draco::MESH_EDGEBREAKER_ENCODING);
  grid.bytes = bytes;
  expect_refused(read_bytes(draco_file(grid).glb()),
                 {"buffer view 0", "claims 50000000 triangles", "accessor makes 32"});
}

TEST(GltfDraco, NamesAnAttributeThatIsNotInTheData) {
  Compressed grid = compressed_grid(draco::MESH_EDGEBREAKER_ENCODING);
  grid.uv_id = 40;
  expect_refused(read_bytes(draco_file(grid).glb()), {"attribute 40 (TEXCOORD_1)"});
}

TEST(GltfDraco, NamesAnAttributeOfAnotherSize) {
  Compressed grid = compressed_grid(draco::MESH_EDGEBREAKER_ENCODING);
  std::swap(grid.uv_id, grid.position_id);
  expect_refused(read_bytes(draco_file(grid).glb()), {"attribute 1 (POSITION) holds 2 numbers a vertex, not 3"});
}

// A square of 256 steps a side whose positions are integers, with normalised colours: red at x = 0, white elsewhere.
GltfBuilder file_of_integers(bool is_position_normalized) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(2);
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_INT16);
  const int color = builder.AddAttribute(draco::GeometryAttribute::COLOR, 4, draco::DT_UINT8);
  const std::int16_t corners[2][3][3] = {{{0, 0, 0}, {256, 0, 0}, {256, 256, 0}},
                                         {{0, 0, 0}, {256, 256, 0}, {0, 256, 0}}};
  for (int face = 0; face < 2; ++face) {
    std::uint8_t colors[3][4];
    for (int k = 0; k < 3; ++k) {
      const std::uint8_t other = corners[face][k][0] == 0 ? 0 : 255;
      std::copy_n(std::array<std::uint8_t, 4>{255, other, other, 255}.begin(), 4, colors[k]);
    }
    const auto& p = corners[face];
    builder.SetAttributeValuesForFace(position, draco::FaceIndex(face), p[0], p[1], p[2]);
    builder.SetAttributeValuesForFace(color, draco::FaceIndex(face), colors[0], colors[1], colors[2]);
  }
  const auto mesh = builder.Finalize();
  draco::Encoder encoder;
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
  GltfBuilder file;
  const int view = file.add_view({buffer.data(), buffer.size()});
  file.add("accessors",
           {{"componentType", 5122}, {"type", "VEC3"}, {"count", 4}, {"normalized", is_position_normalized}});
  file.add("accessors", {{"componentType", 5121}, {"type", "VEC4"}, {"count", 4}, {"normalized", true}});
  file.add("accessors", {{"componentType", 5123}, {"type", "SCALAR"}, {"count", 6}});
  const json ids = {{"POSITION", mesh->attribute(position)->unique_id()},
                    {"COLOR_0", mesh->attribute(color)->unique_id()}};
  file.add_root(
      {{"mesh", file.add_mesh(
                    {{"attributes", {{"POSITION", 0}, {"COLOR_0", 1}}},
                     {"indices", 2},
                     {"extensions", {{"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", ids}}}}}})}});
  return file;
}

TEST(GltfDraco, ReadsIntegersAsTheirAccessorsSay) {
  for (const bool is_normalized : {false, true}) {
    const auto result = read_bytes(file_of_integers(is_normalized).glb());
    ASSERT_TRUE(result.ok()) << result.error().message;
    const Mesh& mesh = result->scene.meshes.at(0);
    ASSERT_EQ(mesh.positions.size(), 4u);
    ASSERT_EQ(mesh.colors.size(), 4u);
    const double side = is_normalized ? 256.0 / 32767 : 256;
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_TRUE(mesh.positions[i].x == 0 || mesh.positions[i].x == side) << mesh.positions[i].x;
      EXPECT_EQ(mesh.colors[i], mesh.positions[i].x == 0 ? (Vec3{1, 0, 0}) : (Vec3{1, 1, 1}));
    }
  }
}

TEST(GltfDraco, NamesIntegersThatAnAttributeCannotHold) {
  GltfBuilder file = file_of_integers(false);
  file.document["accessors"][1]["normalized"] = false;
  expect_refused(read_bytes(file.glb()), {"(COLOR_0) holds 8-bit unsigned integers", "normalised"});
}

// Decoded triangles are a list, whatever the file's mode; its indices may count those of a strip or of the list.
TEST(GltfDraco, ReadsACompressedStrip) {
  for (const std::size_t count : {kTriangles + 2, 3 * kTriangles}) {
    GltfBuilder file = draco_file(compressed_grid(draco::MESH_EDGEBREAKER_ENCODING));
    file.document["meshes"][0]["primitives"][0]["mode"] = 5;
    file.document["accessors"][2]["count"] = count;
    const auto result = read_bytes(file.glb());
    ASSERT_TRUE(result.ok()) << result.error().message;
    EXPECT_EQ(result->scene.meshes.at(0).triangles.size(), kTriangles);
  }
}

TEST(GltfDraco, SurvivesAnyFlippedByte) {
  for (const int method : {draco::MESH_EDGEBREAKER_ENCODING, draco::MESH_SEQUENTIAL_ENCODING}) {
    const Compressed grid = compressed_grid(method);
    for (std::size_t i = 0; i < grid.bytes.size(); ++i) {
      Compressed flipped = grid;
      flipped.bytes[i] = static_cast<char>(flipped.bytes[i] ^ (1 << (i % 8)));
      const auto result = read_bytes(draco_file(flipped).glb());
      if (!result.ok()) {
        EXPECT_THAT(result.error().message, HasSubstr("scene.glb"));
      }
    }
  }
}

}  // namespace
}  // namespace radbake::gltf
