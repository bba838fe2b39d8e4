#include "client/cli/mesh_results.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

namespace radbake::cli {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <typename T>
void append(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

/// A scene of a triangle that was not sent and a square, and what a server says of the square: split along its
/// diagonal, unwrapped, with light by vertex.
struct Answer {
  Scene scene;
  std::vector<int> scene_meshes = {1};
  v1::BakeResult result;
  std::string data;

  Answer() {
    scene.meshes.resize(2);
    scene.meshes[0].name = "sliver";
    scene.meshes[1].name = "wall";
    scene.meshes[1].positions.resize(4);
    scene.meshes[1].triangles = {{0, 1, 2}, {0, 2, 3}};
    result.add_layers()->set_name("lightmap_0");
    result.add_layers()->set_name("lightmap_1");
    v1::MeshResult& mesh = *result.add_meshes();
    mesh.set_lightmap(1);
    mesh.set_uv_source(v1::UV_UNWRAPPED);
    mesh.set_is_split(true);
    mesh.set_has_irradiance(true);
    mesh.set_num_vertices(6);
    mesh.set_num_triangles(2);
    mesh.set_data_offset(3);
    data = "...";
    append<std::uint32_t>(data, {0, 1, 2, 3, 0, 2});
    append<std::uint32_t>(data, {0, 1, 2, 4, 5, 3});
    append<float>(data, {0, 0, 0.1f, 0, 0.1f, 0.1f, 0.5f, 0.5f, 0.4f, 0.4f, 0.5f, 0.4f});
    append<float>(data, {0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 30, 4, 4, 4, 5, 5, 5});
  }

  v1::MeshResult& wall() { return *result.mutable_meshes(0); }
  Result<MeshResults> read() const { return read_mesh_results(result, data, scene, scene_meshes); }
  template <typename T>
  void put(std::size_t offset, T value) {
    std::memcpy(data.data() + 3 + offset, &value, sizeof value);
  }
};

TEST(MeshResults, ReadsSplitsLayoutAndLight) {
  const auto read = Answer().read();
  ASSERT_TRUE(read.ok()) << read.error().message;
  ASSERT_EQ(read->meshes.size(), 2u);
  const gltf::BakedMesh& wall = read->meshes[1];
  EXPECT_EQ(wall.lightmap, 1);
  EXPECT_THAT(wall.source_vertices, ElementsAre(0, 1, 2, 3, 0, 2));
  EXPECT_THAT(wall.triangles, ElementsAre(ElementsAre(0, 1, 2), ElementsAre(4, 5, 3)));
  EXPECT_THAT(wall.uvs[3], ElementsAre(0.5f, 0.5f));
  EXPECT_THAT(wall.irradiance[3], ElementsAre(3, 3, 30));
  EXPECT_EQ(read->max_irradiance, 30);
  EXPECT_EQ(read->uv_sources[1], v1::UV_UNWRAPPED);
  // What was not sent has nothing.
  EXPECT_EQ(read->meshes[0], gltf::BakedMesh());
  EXPECT_EQ(read->uv_sources[0], v1::UV_NONE);
}

TEST(MeshResults, ReadsThePlaceOfAnOwnLayoutWithoutAnyData) {
  Answer answer;
  answer.scene.meshes[1].texcoord1.resize(4);
  v1::MeshResult placed;
  placed.set_uv_source(v1::UV_PLACED);
  placed.mutable_uv_scale()->set_x(0.5);
  placed.mutable_uv_scale()->set_y(0.25);
  placed.mutable_uv_offset()->set_y(0.75);
  answer.wall() = placed;
  answer.data.clear();
  const auto read = answer.read();
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->meshes[1].uv_scale, (Vec2{0.5, 0.25}));
  EXPECT_EQ(read->meshes[1].uv_offset, (Vec2{0, 0.75}));
  EXPECT_EQ(read->meshes[1].lightmap, 0);
  EXPECT_TRUE(read->meshes[1].uvs.empty());
  // Kept as it is: whatever the scale says.
  answer.wall() = {};
  answer.wall().set_uv_source(v1::UV_KEPT);
  EXPECT_EQ(answer.read()->meshes[1].uv_scale, (Vec2{1, 1}));
}

TEST(MeshResults, CountLightmapsAndNotTheLayersBetweenThem) {
  Answer answer;
  answer.result.clear_layers();
  for (const char* name : {"lightmap_0", "lightmap_0_direct", "lightmap_0_ao", "lightmap_1", "lightmap_1_direct"}) {
    answer.result.add_layers()->set_name(name);
  }
  ASSERT_TRUE(answer.read().ok());
  EXPECT_EQ(answer.read()->meshes[1].lightmap, 1);
  EXPECT_TRUE(is_lightmap("lightmap_12"));
  for (const char* other : {"lightmap_", "lightmap", "lightmap_1_ao", "lightmap_x", "map_1"}) {
    EXPECT_FALSE(is_lightmap(other)) << other;
  }
}

struct BadAnswer {
  std::function<void(Answer&)> change;
  std::string named;
};

class BadAnswers : public testing::TestWithParam<BadAnswer> {};

TEST_P(BadAnswers, AreRefusedWithMeshAndValue) {
  Answer answer;
  GetParam().change(answer);
  const auto read = answer.read();
  ASSERT_FALSE(read.ok());
  EXPECT_EQ(read.error().code, ErrorCode::kInternal);
  EXPECT_THAT(read.error().message, HasSubstr(GetParam().named));
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(
    Server, BadAnswers,
    testing::Values(BadAnswer{[](Answer& a) { a.result.add_meshes(); }, "results of 2 meshes for 1"},
                    BadAnswer{[](Answer& a) { a.data.pop_back(); }, "'wall' cannot be used: 6 values from byte 99"},
                    BadAnswer{[](Answer& a) { a.wall().set_data_offset(UINT64_MAX - 3); }, "do not fit"},
                    BadAnswer{[](Answer& a) { a.wall().set_data_offset(1000); }, "byte 1000"},
                    BadAnswer{[](Answer& a) { a.wall().set_num_vertices(UINT32_MAX); }, "4294967295 values"},
                    BadAnswer{[](Answer& a) { a.wall().set_num_triangles(UINT32_MAX); }, "4294967295 values"},
                    BadAnswer{[](Answer& a) { a.wall().set_num_vertices(3); }, "3 vertices, fewer than the 4"},
                    BadAnswer{[](Answer& a) { a.put<std::uint32_t>(4 * 5, 4); }, "vertex 5 copies vertex 4 of 4"},
                    BadAnswer{[](Answer& a) { a.put<std::uint32_t>(4 * 1, 2); }, "vertex 1 copies vertex 2"},
                    BadAnswer{[](Answer& a) { a.put<std::uint32_t>(24 + 4 * 5, 6); }, "triangle 1 names vertex 6 of 6"},
                    BadAnswer{[](Answer& a) { a.put(48 + 4 * 3, kNan); }, "TEXCOORD_1 of vertex 1 is nan"},
                    BadAnswer{[](Answer& a) { a.put(96 + 4 * 3, -1.0f); }, "irradiance of vertex 1 is -1"},
                    BadAnswer{[](Answer& a) { a.put(96, std::numeric_limits<float>::infinity()); },
                              "irradiance of vertex 0 is inf"},
                    BadAnswer{[](Answer& a) { a.wall().set_lightmap(2); }, "lightmap_2"},
                    BadAnswer{[](Answer& a) { a.wall().set_uv_source(v1::UV_KEPT); }, "TEXCOORD_1 and has none"},
                    BadAnswer{[](Answer& a) { a.wall().set_uv_source(static_cast<v1::UvSource>(9)); }, "of kind 9"},
                    BadAnswer{[](Answer& a) { a.wall().set_is_split(false); }, "6 vertices, in the scene 4"},
                    BadAnswer{[](Answer& a) {
                                a.scene.meshes[1].texcoord1.resize(4);
                                a.wall().set_uv_source(v1::UV_PLACED);
                                a.wall().mutable_uv_scale()->set_x(kNan);
                              },
                              "not finite"}));

}  // namespace
}  // namespace radbake::cli
