#pragma once

#include <cstring>
#include <filesystem>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/gltf/read_gltf.h"

namespace radbake::gltf {

/// Builds small glTF files. A test takes a good one and changes one thing.
class GltfBuilder {
 public:
  nlohmann::json document;
  std::string bin;

  GltfBuilder();
  /// Adds bytes as a buffer view; returns its index.
  int add_view(const std::string& bytes, int stride = 0);
  int add_accessor(int view, int component_type, const std::string& type, std::size_t count);
  int add_floats(const std::vector<float>& values, const std::string& type);
  int add_indices(const std::vector<std::uint16_t>& indices);
  /// Appends an object to a list of the document; returns its index.
  int add(const char* list, nlohmann::json object);
  /// Adds a mesh of one primitive; returns the mesh's index.
  int add_mesh(nlohmann::json primitive);
  /// Adds a node to scene 0; returns its index.
  int add_root(nlohmann::json node);

  /// The document with the buffer as a binary chunk.
  std::string glb() const;
  /// The document with the buffer as a data URI.
  std::string gltf() const;
};

template <typename T>
std::string bytes_of(const std::vector<T>& values) {
  return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

/// A square of 1 m in the plane z = 0 that faces +Z, with one node and a grey material of reflectance 0.5.
/// View 0 and accessor 0: positions; view 1 and accessor 1: 6 indices.
GltfBuilder square();

/// A folder of its own that goes away with the test.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& name, const std::string& bytes) const;

 private:
  std::filesystem::path path_;
};

/// A decoder that knows one kind of image: text of width, height, channels and values.
Result<TexturePlane> decode_text_image(std::span<const std::byte> bytes, const std::string& name, bool is_srgb);

/// Writes the bytes as "scene.glb" and reads them.
Result<GltfScene> read_bytes(const std::string& bytes, const ReadOptions& options = {});

/// The text of a warning, or empty.
std::string warning_text(const GltfScene& scene, const std::string& id);

/// Expects kInvalidArgument with a message that starts with the file's name and holds all the parts.
void expect_refused(const Result<GltfScene>& result, std::initializer_list<const char*> parts);

}  // namespace radbake::gltf
