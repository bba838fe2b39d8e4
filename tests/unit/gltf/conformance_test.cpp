// The files of tests/gltf/conformance, each of one feature, against what they show: written here by hand.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <set>

#include "client/image/decode_image.h"
#include "tests/unit/gltf/gltf_builder.h"

namespace radbake::gltf {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::filesystem::path kFiles = RADBAKE_CONFORMANCE;

// Numbers that pass through float.
constexpr double kFloat = 1e-7;

using Corners = std::array<Vec3, 3>;

// A floor of two triangles, and the wall behind it.
const std::vector<Corners> kStep = {{{{0, 0, 1}, {1, 0, 1}, {0, 0, 0}}},
                                    {{{1, 0, 1}, {1, 0, 0}, {0, 0, 0}}},
                                    {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}},
                                    {{{1, 0, 0}, {1, 1, 0}, {0, 1, 0}}}};
// Four triangles around the middle of the floor.
const std::vector<Corners> kFan = {{{{0.5, 0, 0.5}, {0, 0, 1}, {1, 0, 1}}},
                                   {{{0.5, 0, 0.5}, {1, 0, 1}, {1, 0, 0}}},
                                   {{{0.5, 0, 0.5}, {1, 0, 0}, {0, 0, 0}}},
                                   {{{0.5, 0, 0.5}, {0, 0, 0}, {0, 0, 1}}}};
const std::vector<Corners> kStepTwice = {{{{0, 0, 1}, {1, 0, 1}, {0, 0, 0}}}, {{{1, 0, 1}, {1, 0, 0}, {0, 0, 0}}},
                                         {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}, {{{1, 0, 0}, {1, 1, 0}, {0, 1, 0}}},
                                         {{{2, 0, 1}, {3, 0, 1}, {2, 0, 0}}}, {{{3, 0, 1}, {3, 0, 0}, {2, 0, 0}}},
                                         {{{2, 0, 0}, {3, 0, 0}, {2, 1, 0}}}, {{{3, 0, 0}, {3, 1, 0}, {2, 1, 0}}}};
const std::vector<Corners> kStepMoved = {{{{2, 4, 1}, {3, 4, 1}, {2, 4, 0}}},
                                         {{{3, 4, 1}, {3, 4, 0}, {2, 4, 0}}},
                                         {{{2, 4, 0}, {3, 4, 0}, {2, 5, 0}}},
                                         {{{3, 4, 0}, {3, 5, 0}, {2, 5, 0}}}};
// The floor still faces up, the wall still faces +Z.
const std::vector<Corners> kStepMirrored = {{{{-1, 0, 1}, {0, 0, 1}, {0, 0, 0}}},
                                            {{{-1, 0, 1}, {0, 0, 0}, {-1, 0, 0}}},
                                            {{{-1, 0, 0}, {0, 0, 0}, {0, 1, 0}}},
                                            {{{-1, 0, 0}, {0, 1, 0}, {-1, 1, 0}}}};
// Turned by 90 degrees about y and moved: the wall faces +X.
const std::vector<Corners> kStepTurned = {{{{4, 0, 0}, {4, 0, -1}, {3, 0, 0}}},
                                          {{{4, 0, -1}, {3, 0, -1}, {3, 0, 0}}},
                                          {{{3, 0, 0}, {3, 0, -1}, {3, 1, 0}}},
                                          {{{3, 0, -1}, {3, 1, -1}, {3, 1, 0}}}};

bool is_before(Vec3 a, Vec3 b) { return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z); }

// In an order of its own, each triangle from its least corner on: what encoders may change, and nothing else.
std::vector<Corners> sorted(std::vector<Corners> triangles) {
  for (Corners& triangle : triangles) {
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end(), is_before), triangle.end());
  }
  std::sort(triangles.begin(), triangles.end(), [](const Corners& a, const Corners& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), is_before);
  });
  return triangles;
}

std::vector<Corners> triangles_of(const Scene& scene) {
  std::vector<Corners> triangles;
  for (const Mesh& mesh : scene.meshes) {
    for (const auto& [a, b, c] : mesh.triangles) {
      triangles.push_back({mesh.positions[a], mesh.positions[b], mesh.positions[c]});
    }
  }
  return triangles;
}

// A value of the first mesh at the vertex of a position.
template <typename Value>
Value at(const GltfScene& read, const std::vector<Value>& values, Vec3 position) {
  const std::vector<Vec3>& positions = read.scene.meshes.at(0).positions;
  const auto found = std::find(positions.begin(), positions.end(), position);
  if (found != positions.end() && values.size() == positions.size()) return values[found - positions.begin()];
  ADD_FAILURE() << "no value at (" << position.x << ", " << position.y << ", " << position.z << ")";
  return {};
}

void expect_near(Vec2 actual, Vec2 expected) {
  EXPECT_NEAR(actual.x, expected.x, kFloat);
  EXPECT_NEAR(actual.y, expected.y, kFloat);
}

void expect_near(Vec3 actual, Vec3 expected) { EXPECT_NEAR(length(actual - expected), 0, kFloat); }

struct Case {
  const char* file;
  const std::vector<Corners>* triangles;
  std::function<void(const GltfScene&)> check = [](const GltfScene&) {};
};

void PrintTo(const Case& item, std::ostream* out) { *out << item.file; }

Vec2 texcoord0(const GltfScene& read, Vec3 position) { return at(read, read.scene.meshes.at(0).texcoord0, position); }

// Coordinates go up the step in fifths: 0 at the front, 1/5 at the crease, 1 on top.
void check_normalised_texcoords(const GltfScene& read) {
  EXPECT_EQ(texcoord0(read, {0, 0, 1}), (Vec2{0, 0}));
  EXPECT_EQ(texcoord0(read, {1, 0, 0}), (Vec2{1, 0.2}));
  EXPECT_EQ(texcoord0(read, {1, 1, 0}), (Vec2{1, 1}));
}

// Vertex k has (k/8, 1 - k/8).
void check_eighths(const GltfScene& read) {
  EXPECT_EQ(texcoord0(read, {0, 0, 1}), (Vec2{0, 1}));
  EXPECT_EQ(texcoord0(read, {0, 0, 0}), (Vec2{0.25, 0.75}));
  EXPECT_EQ(texcoord0(read, {1, 1, 0}), (Vec2{0.625, 0.375}));
}

void check_primary_colors(const GltfScene& read) {
  const std::vector<Vec3>& colors = read.scene.meshes.at(0).colors;
  EXPECT_EQ(at(read, colors, {0, 0, 1}), (Vec3{1, 0, 0}));
  EXPECT_EQ(at(read, colors, {0, 0, 0}), (Vec3{0, 0, 1}));
  EXPECT_EQ(at(read, colors, {0, 1, 0}), (Vec3{0, 0, 0}));
  expect_near(at(read, colors, {1, 1, 0}), {0.2, 0.2, 0.2});
}

// The texel coordinate that the reflectance of a position is read from.
Vec2 looked_up(const GltfScene& read, Vec3 position) {
  const Mesh& mesh = read.scene.meshes.at(0);
  const TextureReference texture = read.scene.materials.at(0).reflectance_texture.value();
  return texture.transform.apply(at(read, texture.texcoord == 0 ? mesh.texcoord0 : mesh.texcoord1, position));
}

const Case kCases[] = {
    {"list_uint8.gltf", &kStep},
    {"list_uint16.gltf", &kStep},
    {"list_uint32.gltf", &kStep},
    {"list_without_indices.gltf", &kStep},
    {"strip.gltf", &kStep},
    {"strip_without_indices.gltf", &kStep},
    {"strip_stitched.gltf", &kStep, [](const GltfScene& read) { EXPECT_EQ(read.num_triangles_dropped, 4u); }},
    {"fan.gltf", &kFan},
    {"fan_without_indices.gltf", &kFan},
    {"strided.gltf", &kStep, check_eighths},
    {"byte_offsets.gltf", &kStep},
    {"sparse.gltf", &kStep},
    {"sparse_without_view.gltf", &kStep},
    {"sparse_indices.gltf", &kStep},
    {"texcoord_uint8.gltf", &kStep, check_normalised_texcoords},
    {"texcoord_uint16.gltf", &kStep, check_normalised_texcoords},
    {"external_buffer.gltf", &kStep},
    {"two_buffers.gltf", &kStep},
    {"binary_chunk.glb", &kStep},
    {"quantised_int8.gltf", &kStep},
    {"quantised_uint8_normalised.gltf", &kStep,
     [](const GltfScene& read) {
       EXPECT_EQ(at(read, read.scene.meshes[0].normals, {1, 1, 0}), (Vec3{0, 1, 0}));
     }},
    {"quantised_int16.gltf", &kStep,
     [](const GltfScene& read) {
       const std::vector<Vec3>& normals = read.scene.meshes[0].normals;
       EXPECT_EQ(at(read, normals, {0, 0, 1}), (Vec3{0, 1, 0}));
       expect_near(at(read, normals, {1, 0, 0}), {0, std::sqrt(0.5), std::sqrt(0.5)});
       EXPECT_EQ(texcoord0(read, {0, 0, 0}), (Vec2{-4, 2}));
     }},
    {"quantised_uint16_normalised.gltf", &kStep,
     [](const GltfScene& read) {
       EXPECT_EQ(texcoord0(read, {1, 0, 0}), (Vec2{2, 4}));
     }},
    {"draco.gltf", &kStep, check_eighths},
    {"draco_sequential.gltf", &kStep, check_eighths},
    {"vertex_colors_uint8.gltf", &kStep, check_primary_colors},
    {"vertex_colors_uint16.gltf", &kStep, check_primary_colors},
    {"vertex_colors_float.gltf", &kStep,
     [](const GltfScene& read) {
       EXPECT_EQ(at(read, read.scene.meshes[0].colors, {0, 0, 1}), (Vec3{1, 0.5, 0.25}));
       EXPECT_EQ(at(read, read.scene.meshes[0].colors, {1, 1, 0}), (Vec3{0, 1, 0.5}));
     }},
    {"texture_and_emission.gltf", &kStep,
     [](const GltfScene& read) {
       const Material& material = read.scene.materials.at(0);
       EXPECT_EQ(read.scene.textures.at(material.reflectance_texture->texture).width, 2);
       EXPECT_EQ(looked_up(read, {1, 1, 0}), (Vec2{0.5, 1}));
       EXPECT_EQ(material.emissive, (Vec3{1, 0.5, 0}));
       EXPECT_EQ(material.emissive_texture->texcoord, 1);
       EXPECT_EQ(at(read, read.scene.meshes[0].texcoord1, {1, 1, 0}), (Vec2{1, 0.5}));
     }},
    {"texture_transform.gltf", &kStep,
     [](const GltfScene& read) {
       // (0.5, 1) halved and doubled is (0.25, 2); turned to the right and up it is (2, -0.25); then moved.
       expect_near(looked_up(read, {0, 0, 1}), {0.5, 1});
       expect_near(looked_up(read, {1, 1, 0}), {2.5, 0.75});
     }},
    {"texture_transform_texcoord.gltf", &kStep,
     [](const GltfScene& read) {
       EXPECT_EQ(looked_up(read, {1, 1, 0}), (Vec2{1, 2}));
     }},
    {"alpha_mask.gltf", &kStep,
     [](const GltfScene& read) {
       EXPECT_EQ(read.scene.materials.at(0).alpha_mode, AlphaMode::kMask);
       EXPECT_EQ(read.scene.materials.at(0).alpha_cutoff, 0.25);
       EXPECT_TRUE(read.scene.materials.at(0).is_double_sided);
     }},
    {"alpha_blend.gltf", &kStep,
     [](const GltfScene& read) { EXPECT_EQ(read.scene.materials.at(0).alpha_mode, AlphaMode::kBlend); }},
    {"unlit.gltf", &kStep,
     [](const GltfScene& read) { EXPECT_THAT(warning_text(read, "unlit"), HasSubstr("'grey' (100 %")); }},
    {"instances.gltf", &kStepTwice,
     [](const GltfScene& read) {
       EXPECT_NE(read.scene.meshes.at(0).object, read.scene.meshes.at(1).object);
       EXPECT_EQ(read.sources.at(1).node, 1);
     }},
    {"nested_nodes.gltf", &kStepMoved},
    {"mirrored.gltf", &kStepMirrored},
    {"matrix.gltf", &kStepTurned},
    {"texel_density.gltf", &kStepTwice,
     [](const GltfScene& read) {
       EXPECT_EQ(read.scene.meshes.at(0).texel_density, 4);
       EXPECT_EQ(read.scene.meshes.at(1).texel_density, 0.5);
     }},
    {"several_primitives.gltf", &kStep,
     [](const GltfScene& read) {
       EXPECT_EQ(read.scene.meshes.size(), 2u);
       EXPECT_EQ(read.scene.meshes.at(0).object, read.scene.meshes.at(1).object);
       EXPECT_THAT(warning_text(read, "primitives_skipped"), HasSubstr("2 primitives of points or lines"));
     }},
    {"default_scene.gltf", &kStep},
};

Result<GltfScene> read(const std::filesystem::path& file) {
  return read_gltf(file,
                   [](std::span<const std::byte> bytes, const std::string& name, bool is_srgb) {
                     return image::decode_image(bytes, name, is_srgb);
                   },
                   {});
}

class Conformance : public ::testing::TestWithParam<Case> {};

TEST_P(Conformance, HoldsTheTrianglesThatItShows) {
  const auto result = read(kFiles / GetParam().file);
  ASSERT_TRUE(result.ok()) << result.error().message;
  EXPECT_EQ(sorted(triangles_of(result->scene)), sorted(*GetParam().triangles));
  GetParam().check(*result);
}

INSTANTIATE_TEST_SUITE_P(Files, Conformance, ::testing::ValuesIn(kCases), [](const auto& info) {
  std::string name = std::filesystem::path(info.param.file).stem().string();
  std::erase(name, '_');
  return name;
});

TEST(ConformanceSet, LeavesNoFileUnread) {
  std::set<std::string> files, named;
  for (const auto& entry : std::filesystem::directory_iterator(kFiles)) {
    const std::string extension = entry.path().extension();
    if (extension == ".gltf" || extension == ".glb") files.insert(entry.path().filename());
  }
  for (const Case& item : kCases) named.insert(item.file);
  EXPECT_EQ(files, named);
}

TEST(ConformanceSet, SpellsOneMeshInManyWays) {
  // Topology, indices, sparse parts, buffers: the same vertices and triangles, in the same order.
  const auto expected = read(kFiles / "list_uint16.gltf");
  ASSERT_TRUE(expected.ok());
  for (const char* name : {"list_uint8.gltf", "list_uint32.gltf", "list_without_indices.gltf", "strip.gltf",
                           "strip_without_indices.gltf", "strip_stitched.gltf", "byte_offsets.gltf", "sparse.gltf",
                           "sparse_without_view.gltf", "sparse_indices.gltf", "external_buffer.gltf"}) {
    const auto result = read(kFiles / name);
    ASSERT_TRUE(result.ok()) << result.error().message;
    EXPECT_EQ(result->scene.meshes.at(0).positions, expected->scene.meshes.at(0).positions) << name;
    EXPECT_EQ(result->scene.meshes.at(0).triangles, expected->scene.meshes.at(0).triangles) << name;
  }
}

}  // namespace
}  // namespace radbake::gltf
