#include "client/gltf/texel_density.h"

#include "common/scene/scene.h"

namespace radbake::gltf {

Result<void> check_texel_density(const Entry& node_or_mesh) {
  // Extras may be anything; only an object can hold a property.
  const nlohmann::json* extras = node_or_mesh.find("extras");
  if (extras == nullptr || !extras->is_object()) return {};
  return Entry(*extras, node_or_mesh.name() + ", extras").number(kTexelDensityKey, kMinTexelDensity, kMaxTexelDensity);
}

double texel_density(const tinygltf::Node& node, const tinygltf::Mesh& mesh) {
  for (const tinygltf::Value* extras : {&node.extras, &mesh.extras}) {
    if (extras->IsObject() && extras->Has(kTexelDensityKey)) return extras->Get(kTexelDensityKey).GetNumberAsDouble();
  }
  return 1;
}

}  // namespace radbake::gltf
