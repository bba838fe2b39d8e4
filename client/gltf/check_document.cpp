#include "client/gltf/check_document.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "client/gltf/limits.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;

// Read, or read and warned about.
constexpr std::array<std::string_view, 12> kRead = {"KHR_materials_emissive_strength",
                                                    "KHR_lights_punctual",
                                                    "KHR_draco_mesh_compression",
                                                    "KHR_materials_unlit",
                                                    "KHR_materials_transmission",
                                                    "KHR_mesh_quantization",
                                                    "KHR_texture_transform",
                                                    "KHR_materials_volume",
                                                    "KHR_materials_clearcoat",
                                                    "KHR_materials_ior",
                                                    "KHR_materials_diffuse_transmission",
                                                    "EXT_lights_ies"};
// Gloss, or nothing that is seen, or light of an earlier bake: no effect on diffuse light.
constexpr std::array<std::string_view, 8> kWithoutEffect = {
    "KHR_materials_specular", "KHR_materials_anisotropy", "KHR_materials_iridescence", "KHR_materials_dispersion",
    "KHR_materials_variants", "KHR_xmp_json_ld",          "KHR_animation_pointer",     "MOZ_lightmap"};

bool is_known(const std::string& extension) {
  return std::find(kRead.begin(), kRead.end(), extension) != kRead.end() ||
         std::find(kWithoutEffect.begin(), kWithoutEffect.end(), extension) != kWithoutEffect.end();
}

Result<std::vector<std::string>> names(const Entry& root, const char* key) {
  std::vector<std::string> names;
  const json* list = root.find(key);
  if (list == nullptr) return names;
  if (!list->is_array()) return root.error(std::string(key) + " is not an array");
  for (const json& name : *list) {
    if (!name.is_string()) return root.error(std::string(key) + " holds " + name.dump() + ", not a text");
    names.push_back(name.get<std::string>());
  }
  return names;
}

// Bounds depth and number of values before any memory is taken for them, by the brackets and commas outside texts.
// (The parser's own callback would do, but makes it quadratic in the length of lists.)
Result<void> check_json_size(const std::string& text) {
  std::size_t num_values = 1;
  int depth = 0;
  bool is_in_text = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_in_text && c == '\\') ++i;
    if (c == '"') is_in_text = !is_in_text;
    if (is_in_text) continue;
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (c == '[' || c == '{' || c == ',') ++num_values;
    if (depth > kMaxJsonDepth) {
      return invalid_argument("its JSON is nested deeper than " + std::to_string(kMaxJsonDepth));
    }
    if (num_values > kMaxJsonValues) {
      return invalid_argument("its JSON has more than " + std::to_string(kMaxJsonValues) + " values");
    }
  }
  return {};
}

}  // namespace

Result<json> parse_json(const std::string& text) {
  RADBAKE_RETURN_IF_ERROR(check_json_size(text));
  try {
    json document = json::parse(text);
    if (!document.is_object()) return invalid_argument("not a glTF: its JSON is not an object");
    return document;
  } catch (const json::exception& error) {
    // The parser quotes what it read last, which may be long and may hold control characters.
    return invalid_argument("its JSON cannot be read: " + printable(error.what()));
  }
}

std::size_t list_size(const Entry& root, const char* key) {
  const json* list = root.find(key);
  return list == nullptr ? 0 : list->size();
}

Result<void> check_extensions(const Entry& root) {
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<std::string> required, names(root, "extensionsRequired"));
  for (const std::string& extension : required) {
    if (!is_known(extension)) return root.error("required extension " + in_quotes(extension) + " is not supported");
  }
  return names(root, "extensionsUsed").ok() ? Result<void>() : root.error("extensionsUsed is not a list of texts");
}

std::vector<std::string> ignored_extensions(const json& document) {
  const Result<std::vector<std::string>> used = names(Entry(document, ""), "extensionsUsed");
  std::vector<std::string> ignored;
  if (!used.ok()) return ignored;
  std::copy_if(used->begin(), used->end(), std::back_inserter(ignored),
               [](const std::string& extension) { return !is_known(extension); });
  return ignored;
}

Result<void> check_document(json& document, const std::filesystem::path& folder, std::uint64_t bin_bytes) {
  const Entry root(document, "");
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> asset, root.member("asset"));
  if (!asset) return root.error("not a glTF: it has no asset");
  const json* version = asset->find("version");
  if (version == nullptr || !version->is_string()) return root.error("not a glTF: its asset has no version");
  if (!version->get_ref<const std::string&>().starts_with("2.")) {
    return root.error("glTF of version " + in_quotes(version->get_ref<const std::string&>()) +
                      "; only version 2 is read");
  }
  RADBAKE_RETURN_IF_ERROR(check_extensions(root));
  RADBAKE_RETURN_IF_ERROR(check_buffers(document, folder, bin_bytes));
  RADBAKE_RETURN_IF_ERROR(check_accessors(root));
  RADBAKE_RETURN_IF_ERROR(check_materials(root));
  RADBAKE_RETURN_IF_ERROR(check_meshes(root));
  RADBAKE_RETURN_IF_ERROR(check_lights(root));
  return check_nodes(root);
}

}  // namespace radbake::gltf
