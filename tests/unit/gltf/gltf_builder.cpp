#include "tests/unit/gltf/gltf_builder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace radbake::gltf {
namespace {

using nlohmann::json;

void append_u32(std::string& bytes, std::size_t value) {
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(value >> shift & 255));
}

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      text.push_back(i + k <= bytes.size() ? kDigits[bits >> (18 - 6 * k) & 63] : '=');
  }
  return text;
}

}  // namespace

GltfBuilder::GltfBuilder() {
  document = {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", json::array({{{"nodes", json::array()}}})}};
}

int GltfBuilder::add(const char* list, json object) {
  document[list].push_back(std::move(object));
  return static_cast<int>(document[list].size()) - 1;
}

int GltfBuilder::add_view(const std::string& bytes, int stride) {
  bin.resize((bin.size() + 3) / 4 * 4);
  json view = {{"buffer", 0}, {"byteOffset", bin.size()}, {"byteLength", bytes.size()}};
  if (stride > 0) view["byteStride"] = stride;
  bin += bytes;
  document["buffers"] = json::array({{{"byteLength", bin.size()}}});
  return add("bufferViews", view);
}

int GltfBuilder::add_accessor(int view, int component_type, const std::string& type, std::size_t count) {
  return add("accessors", {{"bufferView", view}, {"componentType", component_type}, {"type", type}, {"count", count}});
}

int GltfBuilder::add_floats(const std::vector<float>& values, const std::string& type) {
  return add_accessor(add_view(bytes_of(values)), 5126, type, values.size() / std::size_t(type.back() - '0'));
}

int GltfBuilder::add_indices(const std::vector<std::uint16_t>& indices) {
  return add_accessor(add_view(bytes_of(indices)), 5123, "SCALAR", indices.size());
}

int GltfBuilder::add_mesh(json primitive) {
  return add("meshes", {{"primitives", json::array({std::move(primitive)})}});
}

int GltfBuilder::add_root(json node) {
  const int index = add("nodes", std::move(node));
  document["scenes"][0]["nodes"].push_back(index);
  return index;
}

std::string GltfBuilder::glb() const {
  std::string text = document.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::string padded = bin;
  padded.resize((bin.size() + 3) / 4 * 4);
  std::string bytes = "glTF";
  append_u32(bytes, 2);
  append_u32(bytes, 12 + 8 + text.size() + (bin.empty() ? 0 : 8 + padded.size()));
  append_u32(bytes, text.size());
  bytes += "JSON" + text;
  if (bin.empty()) return bytes;
  append_u32(bytes, padded.size());
  return bytes + std::string("BIN\0", 4) + padded;
}

std::string GltfBuilder::gltf() const {
  json embedded = document;
  embedded["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64(bin);
  return embedded.dump();
}

GltfBuilder square() {
  GltfBuilder file;
  const int positions = file.add_floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, "VEC3");
  const int indices = file.add_indices({0, 1, 2, 0, 2, 3});
  file.add("materials", {{"name", "grey"},
                         {"pbrMetallicRoughness", {{"baseColorFactor", {0.5, 0.5, 0.5, 1}}, {"metallicFactor", 0}}}});
  const int mesh = file.add_mesh({{"attributes", {{"POSITION", positions}}}, {"indices", indices}, {"material", 0}});
  file.document["meshes"][mesh]["name"] = "square";
  file.add_root({{"name", "wall"}, {"mesh", mesh}});
  return file;
}

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "radbake-gltf-XXXXXX").string();
  path_ = mkdtemp(pattern.data());
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path TemporaryFolder::write(const std::string& name, const std::string& bytes) const {
  std::ofstream(path_ / name, std::ios::binary) << bytes;
  return path_ / name;
}

Result<TexturePlane> decode_text_image(std::span<const std::byte> bytes, const std::string&, bool) {
  std::istringstream text(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  TexturePlane plane;
  text >> plane.width >> plane.height >> plane.channels;
  if (!text) return invalid_argument("no image that the test decoder knows");
  for (float value = 0; text >> value;) plane.values.push_back(value);
  return plane;
}

Result<GltfScene> read_bytes(const std::string& bytes, const ReadOptions& options) {
  const TemporaryFolder folder;
  return read_gltf(folder.write("scene.glb", bytes), decode_text_image, options);
}

std::string warning_text(const GltfScene& scene, const std::string& id) {
  const auto it = std::find_if(scene.warnings.begin(), scene.warnings.end(),
                               [&](const Warning& warning) { return warning.id == id; });
  return it == scene.warnings.end() ? "" : it->text;
}

void expect_refused(const Result<GltfScene>& result, std::initializer_list<const char*> parts) {
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(result.error().message, ::testing::StartsWith("scene.gl"));
  for (const char* part : parts) EXPECT_THAT(result.error().message, ::testing::HasSubstr(part));
}

}  // namespace radbake::gltf
