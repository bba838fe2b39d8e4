#include <string>
#include <vector>

#include "client/gltf/check_document.h"
#include "client/gltf/texel_density.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;

constexpr std::size_t kNoParent = static_cast<std::size_t>(-1);

// A node that is its own ancestor, or kNoParent. Every node has one parent at most, so going up from a node either
// ends at a root or runs in a circle; what an earlier climb has seen is not climbed again.
std::size_t node_on_cycle(const std::vector<std::size_t>& parents) {
  std::vector<std::size_t> seen_by(parents.size(), kNoParent);
  for (std::size_t start = 0; start < parents.size(); ++start) {
    std::size_t node = start;
    while (node != kNoParent && seen_by[node] == kNoParent) {
      seen_by[node] = start;
      node = parents[node];
    }
    if (node != kNoParent && seen_by[node] == start) return node;
  }
  return kNoParent;
}

// A light that a node places, of those that the file lists under this extension.
Result<std::optional<Entry>> check_placed_light(const Entry& node, const Entry& root, const char* name) {
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> light, node.extension(name));
  if (!light) return light;
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> lights, root.extension(name));
  RADBAKE_RETURN_IF_ERROR(light->required_whole_number("light"));
  RADBAKE_RETURN_IF_ERROR(light->index("light", lights ? list_size(*lights, "lights") : 0, "lights"));
  return light;
}

Result<void> check_node(const Entry& node, const Entry& root) {
  RADBAKE_RETURN_IF_ERROR(node.text("name"));
  RADBAKE_RETURN_IF_ERROR(check_texel_density(node));
  RADBAKE_RETURN_IF_ERROR(node.index("mesh", list_size(root, "meshes"), "meshes"));
  RADBAKE_RETURN_IF_ERROR(node.whole_number("skin"));
  RADBAKE_RETURN_IF_ERROR(node.numbers("matrix", 16));
  RADBAKE_RETURN_IF_ERROR(node.numbers("translation", 3));
  RADBAKE_RETURN_IF_ERROR(node.numbers("rotation", 4));
  RADBAKE_RETURN_IF_ERROR(node.numbers("scale", 3));
  RADBAKE_RETURN_IF_ERROR(check_placed_light(node, root, "KHR_lights_punctual"));
  RADBAKE_ASSIGN_OR_RETURN(const auto luminaire, check_placed_light(node, root, "EXT_lights_ies"));
  if (luminaire) {
    constexpr double kMaxMultiplier = 2e9;
    RADBAKE_RETURN_IF_ERROR(luminaire->number("multiplier", 0, kMaxMultiplier));
    RADBAKE_RETURN_IF_ERROR(luminaire->numbers("color", 3, 0, kMaxMultiplier));
  }
  return {};
}

}  // namespace

Result<void> check_nodes(const Entry& root) {
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> nodes, root.list("nodes", "node"));
  std::vector<std::size_t> parents(nodes.size(), kNoParent);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    RADBAKE_RETURN_IF_ERROR(check_node(nodes[i], root));
    RADBAKE_ASSIGN_OR_RETURN(const std::vector<std::uint64_t> children,
                             nodes[i].indices("children", nodes.size(), "nodes"));
    for (const std::uint64_t child : children) {
      if (parents[child] != kNoParent) {
        return nodes[child].error("it is a child of node " + std::to_string(parents[child]) + " and of node " +
                                  std::to_string(i));
      }
      parents[child] = i;
    }
  }
  if (const std::size_t node = node_on_cycle(parents); node != kNoParent) {
    return nodes[node].error("it is its own ancestor: a cycle in the node tree");
  }
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> scenes, root.list("scenes", "scene"));
  for (const Entry& scene : scenes) {
    RADBAKE_ASSIGN_OR_RETURN(const std::vector<std::uint64_t> roots, scene.indices("nodes", nodes.size(), "nodes"));
    std::vector<bool> is_root(nodes.size(), false);
    for (const std::uint64_t node : roots) {
      if (parents[node] != kNoParent) {
        return scene.error(nodes[node].name() + " is no root: it is a child of node " + std::to_string(parents[node]));
      }
      if (is_root[node]) return scene.error(nodes[node].name() + " is listed twice");
      is_root[node] = true;
    }
  }
  RADBAKE_RETURN_IF_ERROR(root.index("scene", scenes.size(), "scenes"));
  return {};
}

}  // namespace radbake::gltf
