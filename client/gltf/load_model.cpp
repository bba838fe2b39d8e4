// The one file that compiles tinygltf: without its image library, and with the JSON parser that we use too.
#include <fstream>  // which tinygltf needs and includes only with the file callbacks that we replace
#include <nlohmann/json.hpp>
#define TINYGLTF_IMPLEMENTATION
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#include "client/gltf/load_model.h"
#pragma GCC diagnostic pop

#include <array>
#include <exception>

#include "client/gltf/container.h"
#include "client/gltf/entry.h"
#include "client/gltf/external_file.h"
#include "client/gltf/limits.h"

namespace radbake::gltf {
namespace {

constexpr std::array kUsed = {"asset", "buffers",   "bufferViews", "accessors", "meshes",   "nodes",     "scenes",
                              "scene", "materials", "textures",    "images",    "samplers", "extensions"};

// tinygltf takes a plus in a file's URI for a space.
void escape_pluses(json& object) {
  if (!object.contains("uri") || object["uri"].get_ref<const std::string&>().starts_with("data:")) return;
  auto& uri = object["uri"].get_ref<std::string&>();
  for (std::size_t at = uri.find('+'); at != std::string::npos; at = uri.find('+', at)) uri.replace(at, 1, "%2B");
}

json without_unused_parts(const json& document) {
  json reduced;
  for (const char* key : kUsed) {
    if (document.contains(key)) reduced[key] = document[key];
  }
  for (const char* list : {"buffers", "images"}) {
    if (!reduced.contains(list)) continue;
    for (json& object : reduced[list]) escape_pluses(object);
  }
  if (!reduced.contains("meshes")) return reduced;
  for (json& mesh : reduced["meshes"]) {
    if (!mesh.contains("primitives")) continue;
    for (json& primitive : mesh["primitives"]) {
      if (!primitive.contains("/extensions/KHR_draco_mesh_compression"_json_pointer)) continue;
      if (!primitive.contains("indices")) continue;
      primitive["extensions"]["KHR_draco_mesh_compression"]["indices"] = primitive["indices"];
      primitive.erase("indices");
    }
  }
  return reduced;
}

void append_u32(std::string& bytes, std::size_t value) {
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(value >> shift & 255));
}

// A .glb of the reduced JSON and the binary chunk, both padded to 4 bytes.
std::string as_binary(std::string text, const std::string& bin) {
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const std::size_t padded = (bin.size() + 3) / 4 * 4;
  std::string bytes = "glTF";
  append_u32(bytes, 2);
  append_u32(bytes, 12 + 8 + text.size() + 8 + padded);
  append_u32(bytes, text.size());
  bytes += "JSON" + text;
  append_u32(bytes, padded);
  bytes += std::string("BIN\0", 4) + bin;
  bytes.resize(bytes.size() + padded - bin.size());
  return bytes;
}

// The file behind a path that tinygltf made of the folder and a URI. Its own callbacks would expand the path as a
// shell does, $(commands) included (CVE-2022-3008), and would read any file.
Result<std::filesystem::path> file_inside(const std::string& path, void* folder) {
  const auto& inside = *static_cast<const std::filesystem::path*>(folder);
  return resolve_path(inside, std::filesystem::path(path).lexically_relative(inside));
}

tinygltf::FsCallbacks confined_to(std::filesystem::path& folder) {
  tinygltf::FsCallbacks callbacks{};
  callbacks.FileExists = [](const std::string& path, void* inside) { return file_inside(path, inside).ok(); };
  callbacks.ExpandFilePath = [](const std::string& path, void*) { return path; };
  callbacks.ReadWholeFile = [](std::vector<unsigned char>* out, std::string* error, const std::string& path,
                               void* inside) {
    const Result<std::filesystem::path> file = file_inside(path, inside);
    const Result<std::string> bytes = file.ok() ? read_file(*file, kMaxFileBytes) : Result<std::string>(file.error());
    if (bytes.ok()) {
      out->assign(bytes->begin(), bytes->end());
    } else if (error != nullptr) {
      *error = bytes.error().message;
    }
    return bytes.ok();
  };
  callbacks.WriteWholeFile = [](std::string*, const std::string&, const std::vector<unsigned char>&, void*) {
    return false;
  };
  callbacks.user_data = &folder;
  return callbacks;
}

bool keep_encoded(tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* bytes,
                  int size, void*) {
  image->image.assign(bytes, bytes + size);
  image->as_is = true;
  return true;
}

}  // namespace

Result<tinygltf::Model> load_model(const json& document, const std::string& bin, const std::filesystem::path& folder) {
  try {
    std::filesystem::path inside = std::filesystem::canonical(folder.empty() ? "." : folder);
    tinygltf::TinyGLTF loader;
    loader.SetFsCallbacks(confined_to(inside));
    loader.SetImageLoader(keep_encoded, nullptr);
    tinygltf::Model model;
    std::string error, warning;
    const std::string text = without_unused_parts(document).dump();
    bool is_loaded = false;
    if (bin.empty()) {
      is_loaded = loader.LoadASCIIFromString(&model, &error, &warning, text.data(),
                                             static_cast<unsigned int>(text.size()), inside.string());
    } else {
      const std::string bytes = as_binary(text, bin);
      is_loaded =
          loader.LoadBinaryFromMemory(&model, &error, &warning, reinterpret_cast<const unsigned char*>(bytes.data()),
                                      static_cast<unsigned int>(bytes.size()), inside.string());
    }
    if (is_loaded) return model;
    // It quotes URIs, which may hold a whole buffer.
    return invalid_argument("cannot be loaded: " + printable(error));
  } catch (const std::exception& error) {
    return invalid_argument(std::string("cannot be loaded: ") + error.what());
  }
}

}  // namespace radbake::gltf
