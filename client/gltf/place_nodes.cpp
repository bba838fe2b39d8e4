#include "client/gltf/place_nodes.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "client/gltf/entry.h"

namespace radbake::gltf {
namespace {

// Exporters write the last row from float arithmetic.
constexpr double kAffineTolerance = 1e-5;

Result<Transform> local_transform(const tinygltf::Model& model, int index) {
  const tinygltf::Node& node = model.nodes[index];
  if (!node.matrix.empty()) {
    std::array<double, 16> m;
    std::copy(node.matrix.begin(), node.matrix.end(), m.begin());
    if (std::fabs(m[3]) + std::fabs(m[7]) + std::fabs(m[11]) + std::fabs(m[15] - 1) > kAffineTolerance) {
      return invalid_argument(node_name(model, index) + ": its matrix is not affine: the last row is not 0 0 0 1");
    }
    return transform_from_matrix(m);
  }
  Vec3 translation, scale{1, 1, 1};
  std::array<double, 4> rotation = {0, 0, 0, 1};
  for (int i = 0; i < 3 && !node.translation.empty(); ++i) translation[i] = node.translation[i];
  for (int i = 0; i < 3 && !node.scale.empty(); ++i) scale[i] = node.scale[i];
  if (!node.rotation.empty()) std::copy(node.rotation.begin(), node.rotation.end(), rotation.begin());
  double squared = 0;
  for (const double q : rotation) squared += q * q;
  if (!(squared > 0) || !std::isfinite(squared)) {
    return invalid_argument(node_name(model, index) +
                            ": its rotation is no quaternion: its length is zero or infinite");
  }
  return transform_from_trs(translation, rotation, scale);
}

std::vector<int> roots_of(const tinygltf::Model& model) {
  if (!model.scenes.empty()) return model.scenes[std::max(model.defaultScene, 0)].nodes;
  std::vector<bool> is_child(model.nodes.size(), false);
  for (const tinygltf::Node& node : model.nodes) {
    for (const int child : node.children) is_child[child] = true;
  }
  std::vector<int> roots;
  for (std::size_t i = 0; i < is_child.size(); ++i) {
    if (!is_child[i]) roots.push_back(static_cast<int>(i));
  }
  return roots;
}

}  // namespace

std::string node_name(const tinygltf::Model& model, int node) {
  return numbered("node", static_cast<std::size_t>(node), model.nodes[node].name);
}

Result<std::vector<PlacedNode>> place_nodes(const tinygltf::Model& model) {
  // Depth first with a stack of our own: a chain of a million nodes is no reason to overflow the program's.
  std::vector<PlacedNode> placed;
  std::vector<PlacedNode> pending;
  for (const int root : roots_of(model)) pending.push_back({root, Transform{}});
  std::reverse(pending.begin(), pending.end());
  while (!pending.empty()) {
    PlacedNode next = pending.back();
    pending.pop_back();
    RADBAKE_ASSIGN_OR_RETURN(const Transform local, local_transform(model, next.node));
    next.to_world = next.to_world * local;
    placed.push_back(next);
    const std::vector<int>& children = model.nodes[next.node].children;
    for (auto child = children.rbegin(); child != children.rend(); ++child) pending.push_back({*child, next.to_world});
  }
  return placed;
}

}  // namespace radbake::gltf
