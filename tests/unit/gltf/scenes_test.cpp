// The test scenes, read with the real image decoder, and bytes that somebody damaged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <random>
#include <sstream>

#include "client/image/decode_image.h"
#include "tests/unit/gltf/gltf_builder.h"

// ImageInput::open of OpenImageIO 2.4 itself loses the text of some errors of damaged images.
extern "C" const char* __lsan_default_suppressions();  // NOLINT: the leak sanitizer looks for this name
extern "C" const char* __lsan_default_suppressions() { return "leak:OpenImageIO"; }

namespace radbake::gltf {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::StartsWith;

const std::filesystem::path kScenes = RADBAKE_TEST_SCENES, kConformance = RADBAKE_CONFORMANCE;

Result<TexturePlane> decode(std::span<const std::byte> bytes, const std::string& name, bool is_srgb) {
  return image::decode_image(bytes, name, is_srgb);
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    sum += length(cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]])) / 2;
  }
  return sum;
}

TEST(GltfScenes, CornellBoxHas46TrianglesIn4Meshes) {
  const auto result = read_gltf(kScenes / "cornell.glb", decode, {});
  ASSERT_TRUE(result.ok()) << result.error().message;
  const Scene& scene = result->scene;
  std::vector<std::string> names;
  std::vector<std::size_t> triangles;
  for (const Mesh& mesh : scene.meshes) {
    names.push_back(mesh.name + " " + scene.materials[mesh.material].name);
    triangles.push_back(mesh.triangles.size());
    EXPECT_EQ(mesh.texcoord1.size(), mesh.positions.size());
  }
  EXPECT_THAT(names, ElementsAre("cornell/cornell#0 green", "cornell/cornell#1 lamp", "cornell/cornell#2 red",
                                 "cornell/cornell#3 white"));
  EXPECT_THAT(triangles, ElementsAre(2, 2, 2, 40));
  // The lamp is 0.5 m square; emission is colour times strength.
  EXPECT_DOUBLE_EQ(area(scene.meshes[1]), 0.25);
  constexpr double kFloatColour = 1e-6;  // the file's 0.8 is a float
  EXPECT_NEAR(scene.materials[1].emissive.x, 15, kFloatColour);
  EXPECT_NEAR(scene.materials[1].emissive.y, 12, kFloatColour);
  EXPECT_THAT(result->warnings, IsEmpty());
  EXPECT_EQ(result->num_triangles_dropped, 0u);
}

TEST(GltfScenes, GameRoomHasItsTexture) {
  const auto result = read_gltf(kScenes / "tile-game-room6.glb", decode, {});
  ASSERT_TRUE(result.ok()) << result.error().message;
  const Scene& scene = result->scene;
  ASSERT_EQ(scene.meshes.size(), 2u);
  EXPECT_EQ(scene.meshes[0].triangles.size(), 80u);
  EXPECT_TRUE(scene.materials[scene.meshes[0].material].is_double_sided);
  ASSERT_EQ(scene.textures.size(), 1u);
  EXPECT_EQ(scene.textures[0].name, "tile-test-wall");
  EXPECT_EQ(scene.textures[0].wrap_s, Wrap::kRepeat);
  EXPECT_TRUE(scene.lights.empty());
}

// Reads damaged bytes: well or not, but with an answer. Memory errors are for the sanitizers to see.
void expect_an_answer(const TemporaryFolder& folder, const std::string& bytes, int& num_refused) {
  const auto result = read_gltf(folder.write("scene.glb", bytes), decode, {});
  if (result.ok()) {
    EXPECT_FALSE(result->scene.meshes.empty());
    return;
  }
  ++num_refused;
  EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(result.error().message, StartsWith("scene.glb: "));
}

class DamagedScene : public ::testing::TestWithParam<const char*> {
 protected:
  static std::string good_bytes() {
    std::ostringstream text;
    text << std::ifstream(kScenes / GetParam(), std::ios::binary).rdbuf();
    return text.str();
  }
};

TEST_P(DamagedScene, IsRefusedWhereverItIsCut) {
  const TemporaryFolder folder;
  const std::string good = good_bytes();
  int num_cuts = 0, num_refused = 0;
  for (std::size_t size = 0; size < good.size(); size += 97, ++num_cuts) {
    expect_an_answer(folder, good.substr(0, size), num_refused);
  }
  EXPECT_EQ(num_refused, num_cuts);
}

TEST_P(DamagedScene, GetsAnAnswerWhateverBytesAreFlipped) {
  const TemporaryFolder folder;
  const std::string good = good_bytes();
  std::mt19937 random(1);  // a fixed seed: the same bytes on every run
  int num_refused = 0;
  for (int variant = 0; variant < 400; ++variant) {
    std::string bytes = good;
    // Few flips keep the JSON legible and reach the code behind the parser.
    for (int flips = 1 + variant % 4; flips > 0; --flips) bytes[random() % bytes.size()] ^= char(1u << random() % 8);
    expect_an_answer(folder, bytes, num_refused);
  }
  EXPECT_GT(num_refused, 0);
}

TEST_P(DamagedScene, GetsAnAnswerWhateverNumbersItsJsonHolds) {
  const TemporaryFolder folder;
  const std::string good = good_bytes();
  const std::size_t end = 20 + static_cast<unsigned char>(good[12]) + 256u * static_cast<unsigned char>(good[13]);
  std::vector<std::size_t> digits;
  for (std::size_t i = 20; i < end; ++i) {
    if (good[i] >= '0' && good[i] <= '9') digits.push_back(i);
  }
  std::mt19937 random(2);
  int num_refused = 0;
  for (int variant = 0; variant < 400; ++variant) {
    std::string bytes = good;
    bytes[digits[random() % digits.size()]] = "0123456789-e."[random() % 13];
    expect_an_answer(folder, bytes, num_refused);
  }
  EXPECT_GT(num_refused, 0);
}

INSTANTIATE_TEST_SUITE_P(Files, DamagedScene, ::testing::Values("cornell.glb", "tile-game-room6.glb"),
                         [](const auto& file) { return file.index == 0 ? "Cornell" : "GameRoom"; });

// What a file of the conformance set may be damaged to. Binary or text, the JSON has digits to change, and what is not
// JSON is base64 or a chunk.
std::string damaged(std::string bytes, std::mt19937& random) {
  std::vector<std::size_t> digits;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (bytes[i] >= '0' && bytes[i] <= '9') digits.push_back(i);
  }
  for (unsigned changes = 1 + random() % 3; changes > 0; --changes) {
    switch (random() % 4) {
      case 0: bytes[random() % bytes.size()] ^= char(1u << random() % 8); break;
      case 1: bytes.insert(digits[random() % digits.size()], 1, "0123456789-e."[random() % 13]); break;
      default: bytes[digits[random() % digits.size()]] = "0123456789-e."[random() % 13];
    }
  }
  return bytes;
}

TEST(DamagedConformanceSet, GetsAnAnswerForEachFile) {
  const TemporaryFolder folder;
  for (const auto& entry : std::filesystem::directory_iterator(kConformance)) {
    if (entry.path().extension() == ".bin") std::filesystem::copy(entry.path(), folder.path());
  }
  std::mt19937 random(3);
  int num_variants = 0, num_refused = 0;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(kConformance)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());  // the same bytes on every run
  for (const std::filesystem::path& file : files) {
    if (file.extension() != ".gltf" && file.extension() != ".glb") continue;
    std::ostringstream good;
    good << std::ifstream(file, std::ios::binary).rdbuf();
    for (int variant = 0; variant < 200; ++variant, ++num_variants) {
      expect_an_answer(folder, damaged(good.str(), random), num_refused);
    }
  }
  EXPECT_GT(num_refused, num_variants / 10);
  EXPECT_LT(num_refused, num_variants);
}

}  // namespace
}  // namespace radbake::gltf
