#include "client/gltf/write_document.h"

#include <algorithm>
#include <fstream>
#include <limits>
#include <map>
#include <stdexcept>

#include "client/gltf/check_document.h"
#include "client/gltf/container.h"
#include "client/gltf/limits.h"
#include "client/gltf/load_model.h"
#include "client/gltf/read_lights.h"

namespace radbake::gltf {
namespace {

constexpr std::size_t kMaxAddedLists = 16;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;

std::size_t padded(std::size_t size) { return (size + 3) / 4 * 4; }

std::size_t whole_number_or_zero(const OrderedJson& object, const char* key) {
  const auto it = object.find(key);
  return it == object.end() ? 0 : it->get<std::size_t>();
}

/// The media type of an image's bytes, empty if it is none that glTF or its extensions know.
std::string media_type_of(const std::string& bytes) {
  if (bytes.starts_with("\x89PNG")) return "image/png";
  if (bytes.starts_with("\xff\xd8\xff")) return "image/jpeg";
  if (bytes.starts_with("RIFF") && bytes.substr(8, 4) == "WEBP") return "image/webp";
  if (bytes.starts_with("\xabKTX 20")) return "image/ktx2";
  if (bytes.starts_with("DDS ")) return "image/vnd-ms.dds";
  return {};
}

/// A part of the bytes, checked. Throws std::out_of_range.
std::string_view part_of(std::string_view bytes, std::size_t offset, std::size_t size) {
  if (offset > bytes.size() || size > bytes.size() - offset) throw std::out_of_range("values beyond their buffer");
  return bytes.substr(offset, size);
}

void append_u32(std::string& bytes, std::size_t value) {
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(value >> shift & 255));
}

/// All buffers become buffer 0. What others than the first are called goes into its extras.
void merge_buffers(OrderedJson& json, const std::vector<tinygltf::Buffer>& buffers, std::string& bin) {
  std::vector<std::size_t> offsets;
  for (const tinygltf::Buffer& buffer : buffers) {
    bin.resize(padded(bin.size()));
    offsets.push_back(bin.size());
    bin.append(reinterpret_cast<const char*>(buffer.data.data()), buffer.data.size());
  }
  const auto move_view = [&](OrderedJson& view) {
    const std::size_t buffer = view.at("buffer").get<std::size_t>();
    view["buffer"] = 0;
    const std::size_t offset = whole_number_or_zero(view, "byteOffset") + offsets.at(buffer);
    if (offset > 0 || view.contains("byteOffset")) view["byteOffset"] = offset;
  };
  if (json.contains("bufferViews")) {
    for (OrderedJson& view : json["bufferViews"]) {
      move_view(view);
      if (!view.contains("extensions")) continue;
      // Compression of whole views names its buffer as views do.
      for (auto& [name, extension] : view["extensions"].items()) {
        if (extension.is_object() && extension.contains("buffer")) move_view(extension);
      }
    }
  }
  if (!json.contains("buffers") || json["buffers"].empty()) return;
  OrderedJson merged = json["buffers"][0];
  merged.erase("uri");
  for (std::size_t i = 1; i < json["buffers"].size(); ++i) {
    OrderedJson other = json["buffers"][i];
    other.erase("uri");
    other.erase("byteLength");
    if (!other.empty() && (!merged.contains("extras") || merged["extras"].is_object())) {
      merged["extras"]["merged"].push_back(std::move(other));
    }
  }
  json["buffers"] = OrderedJson::array({std::move(merged)});
}

}  // namespace

Result<Document> Document::load(const std::filesystem::path& path) {
  RADBAKE_ASSIGN_OR_RETURN(const Container file, read_container(path));
  RADBAKE_ASSIGN_OR_RETURN(nlohmann::json checked, parse_json(file.json));
  RADBAKE_RETURN_IF_ERROR(check_document(checked, path.parent_path(), file.bin.size()));
  RADBAKE_ASSIGN_OR_RETURN(const tinygltf::Model model, load_model(checked, file.bin, path.parent_path()));
  Document document;
  document.json = OrderedJson::parse(file.json);
  // An ordered object is a vector, and copies its members where it grows: room for the lists that may be added.
  auto& members = document.json.get_ref<OrderedJson::object_t&>();
  members.reserve(members.size() + kMaxAddedLists);
  merge_buffers(document.json, model.buffers, document.bin_);

  // Bring the images in.
  for (std::size_t i = 0; i < model.images.size(); ++i) {
    OrderedJson& image = document.json["images"][i];
    const std::vector<unsigned char>& loaded = model.images[i].image;
    if (!image.contains("uri") || loaded.empty()) continue;
    const std::string bytes(loaded.begin(), loaded.end());
    const std::string media_type = image.value("mimeType", media_type_of(bytes));
    if (media_type.empty()) continue;
    const std::string uri = image["uri"].get<std::string>();
    // The file's name is all that says where the picture came from.
    if (!image.contains("name") && !uri.starts_with("data:")) {
      image["name"] = std::filesystem::path(uri).stem().string();
    }
    image.erase("uri");
    image["mimeType"] = media_type;
    image["bufferView"] = document.add_view(bytes, 0, 0);
  }
  document.load_profiles(path.parent_path());
  return document;
}

void Document::load_profiles(const std::filesystem::path& folder) {
  const auto list = "/extensions/EXT_lights_ies/lights"_json_pointer;
  if (!json.contains(list)) return;
  std::map<std::string, std::size_t> view_of;
  std::uint64_t num_bytes = 0;
  for (OrderedJson& profile : json[list]) {
    if (!profile.contains("uri")) continue;
    const std::string uri = profile["uri"].get<std::string>();
    if (!view_of.contains(uri)) {
      const Result<std::string> bytes = read_ies_uri(folder, uri);
      if (!bytes.ok() || bytes->empty() || num_bytes + bytes->size() > kMaxSceneIesBytes) continue;
      num_bytes += bytes->size();
      view_of[uri] = add_view(*bytes, 0, 0);
    }
    profile.erase("uri");
    profile["mimeType"] = "application/x-ies-lm-63";
    profile["bufferView"] = view_of[uri];
  }
}

std::string_view Document::view_bytes(std::size_t view) const {
  const OrderedJson& object = json.at("bufferViews").at(view);
  return part_of(bin_, whole_number_or_zero(object, "byteOffset"), object.at("byteLength").get<std::size_t>());
}

Elements Document::elements(std::size_t index) const {
  const OrderedJson& accessor = json.at("accessors").at(index);
  Elements elements;
  elements.component_type = accessor.at("componentType").get<int>();
  elements.type = accessor.at("type").get<std::string>();
  elements.is_normalized = accessor.value("normalized", false);
  elements.count = accessor.at("count").get<std::size_t>();
  const std::size_t size = element_bytes(elements);

  // Copy a run of elements out of a view.
  const auto run = [&](const OrderedJson& place, std::size_t count, std::size_t bytes_each, bool is_strided) {
    const std::size_t view_index = place.at("bufferView").get<std::size_t>();
    const std::string_view view = view_bytes(view_index);
    const std::size_t given = whole_number_or_zero(json["bufferViews"][view_index], "byteStride");
    const std::size_t stride = is_strided && given > 0 ? given : bytes_each;
    const std::size_t offset = whole_number_or_zero(place, "byteOffset");
    std::string bytes;
    bytes.reserve(count * bytes_each);
    for (std::size_t i = 0; i < count; ++i) bytes += part_of(view, offset + i * stride, bytes_each);
    return bytes;
  };
  elements.bytes = accessor.contains("bufferView") ? run(accessor, elements.count, size, true)
                                                   : std::string(elements.count * size, '\0');
  if (!accessor.contains("sparse")) return elements;

  // Put sparse values in their places.
  const OrderedJson& sparse = accessor.at("sparse");
  Elements places;
  places.count = sparse.at("count").get<std::size_t>();
  places.component_type = sparse.at("indices").at("componentType").get<int>();
  places.bytes = run(sparse.at("indices"), places.count, element_bytes(places), false);
  const std::string values = run(sparse.at("values"), places.count, size, false);
  for (std::size_t i = 0; i < places.count; ++i) {
    const auto place = static_cast<std::size_t>(component(places, i, 0));
    if (place >= elements.count) throw std::out_of_range("a sparse index beyond its accessor");
    elements.bytes.replace(place * size, size, values, i * size, size);
  }
  return elements;
}

std::size_t Document::add(const char* list, OrderedJson object) {
  json[list].push_back(std::move(object));
  return json[list].size() - 1;
}

std::size_t Document::add_view(const std::string& bytes, int target, std::size_t stride) {
  bin_.resize(padded(bin_.size()));
  OrderedJson view = {{"buffer", 0}, {"byteOffset", bin_.size()}, {"byteLength", bytes.size()}};
  if (stride > 0) view["byteStride"] = stride;
  if (target > 0) view["target"] = target;
  bin_ += bytes;
  return add("bufferViews", std::move(view));
}

std::size_t Document::add_accessor(const Elements& elements, Use use, const OrderedJson& like, bool with_bounds) {
  // Each vertex begins at a multiple of 4 bytes.
  const std::size_t size = element_bytes(elements);
  const std::size_t stride = use == Use::kVertices ? padded(size) : size;
  std::string bytes = elements.bytes;
  if (stride != size) {
    bytes.assign(elements.count * stride, '\0');
    for (std::size_t i = 0; i < elements.count; ++i) bytes.replace(i * stride, size, elements.bytes, i * size, size);
  }
  OrderedJson accessor;
  accessor["bufferView"] =
      add_view(bytes, use == Use::kVertices ? kArrayBuffer : kElementArrayBuffer, stride != size ? stride : 0);
  accessor["componentType"] = elements.component_type;
  if (elements.is_normalized) accessor["normalized"] = true;
  accessor["count"] = elements.count;
  accessor["type"] = elements.type;
  const bool had_bounds = like.is_object() && like.contains("min") && !elements.type.starts_with("MAT");
  if ((with_bounds || had_bounds) && elements.count > 0) {
    ElementBounds bounds = bounds_of(elements);
    accessor["min"] = std::move(bounds.min);
    accessor["max"] = std::move(bounds.max);
  }
  for (const char* kept : {"name", "extensions", "extras"}) {
    if (like.is_object() && like.contains(kept)) accessor[kept] = like[kept];
  }
  return add("accessors", std::move(accessor));
}

std::size_t Document::add_image(const std::string& name, const std::string& bytes, const std::string& media_type) {
  const std::size_t view = add_view(bytes, 0, 0);
  return add("images", {{"name", name}, {"mimeType", media_type}, {"bufferView", view}});
}

void Document::use_extension(const std::string& name) {
  OrderedJson& used = json["extensionsUsed"];
  if (std::find(used.begin(), used.end(), name) == used.end()) used.push_back(name);
}

void Document::drop_extension(const std::string& name) {
  for (const char* list : {"extensionsUsed", "extensionsRequired"}) {
    if (!json.contains(list)) continue;
    OrderedJson kept = OrderedJson::array();
    for (const OrderedJson& extension : json[list]) {
      if (extension != name) kept.push_back(extension);
    }
    json[list] = std::move(kept);
    if (json[list].empty()) json.erase(list);  // glTF knows no empty lists
  }
}

Result<void> Document::write(const std::filesystem::path& path) {
  bin_.resize(padded(bin_.size()));
  if (!bin_.empty()) {
    if (!json.contains("buffers")) json["buffers"] = OrderedJson::array({OrderedJson::object()});
    json["buffers"][0]["byteLength"] = bin_.size();
  }
  std::string text = json.dump();
  text.resize(padded(text.size()), ' ');
  const std::size_t size = 12 + 8 + text.size() + (bin_.empty() ? 0 : 8 + bin_.size());
  if (size > std::numeric_limits<std::uint32_t>::max()) {
    return internal_error("cannot write " + path.string() + ": its " + std::to_string(size) +
                          " bytes are more than a .glb holds");
  }
  std::string head = "glTF";
  append_u32(head, 2);
  append_u32(head, size);
  append_u32(head, text.size());
  head += "JSON";
  std::ofstream file(path, std::ios::binary);
  file << head << text;
  if (!bin_.empty()) {
    std::string chunk;
    append_u32(chunk, bin_.size());
    file << chunk << std::string("BIN\0", 4) << bin_;
  }
  file.close();
  return file ? Result<void>() : internal_error("cannot write " + path.string());
}

}  // namespace radbake::gltf
