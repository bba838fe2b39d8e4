#include <map>
#include <string_view>

#include "client/gltf/check_document.h"
#include "client/gltf/component.h"
#include "client/gltf/limits.h"
#include "client/gltf/primitive_triangles.h"
#include "client/gltf/texel_density.h"

namespace radbake::gltf {
namespace {

using nlohmann::json;

const std::map<std::uint64_t, std::uint64_t> kComponentBytes = {{5120, 1}, {5121, 1}, {5122, 2},
                                                                {5123, 2}, {5125, 4}, {5126, 4}};
const std::map<std::string_view, std::uint64_t> kComponents = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4},
                                                               {"MAT2", 4},   {"MAT3", 9}, {"MAT4", 16}};

// Bytes that a list of an accessor's elements takes in a view, against those that are there.
Result<void> check_extent(const Entry& owner, const Entry& view, std::uint64_t offset, std::uint64_t count,
                          std::uint64_t stride, std::uint64_t element) {
  RADBAKE_ASSIGN_OR_RETURN(const std::uint64_t view_bytes, view.required_whole_number("byteLength"));
  const std::uint64_t end = offset + (count - 1) * stride + element;
  if (end <= view_bytes) return {};
  return owner.error("its " + std::to_string(count) + " elements end at byte " + std::to_string(end) + " of " +
                     view.name() + ", which has " + std::to_string(view_bytes));
}

// One of the two lists of a sparse accessor; both are tightly packed.
Result<void> check_sparse_list(const Entry& sparse, const char* key, const std::vector<Entry>& views,
                               std::uint64_t count, std::uint64_t element) {
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> list, sparse.member(key));
  if (!list) return sparse.error(std::string(key) + " is missing");
  RADBAKE_RETURN_IF_ERROR(list->required_whole_number("bufferView"));
  RADBAKE_ASSIGN_OR_RETURN(const auto view, list->index("bufferView", views.size(), "buffer views"));
  RADBAKE_ASSIGN_OR_RETURN(const auto offset, list->whole_number("byteOffset"));
  return check_extent(*list, views[*view], offset.value_or(0), count, element, element);
}

Result<void> check_sparse(const Entry& accessor, const std::vector<Entry>& views, std::uint64_t num_elements,
                          std::uint64_t element) {
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> sparse, accessor.member("sparse"));
  if (!sparse) return {};
  RADBAKE_ASSIGN_OR_RETURN(const std::uint64_t count, sparse->required_whole_number("count", kMaxCount));
  if (count == 0 || count > num_elements) {
    return sparse->error("count is " + std::to_string(count) + ", not from 1 to the accessor's " +
                         std::to_string(num_elements));
  }
  // Whole numbers only: what tells which elements are replaced.
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> indices, sparse->member("indices"));
  if (!indices) return sparse->error("indices is missing");
  RADBAKE_ASSIGN_OR_RETURN(const std::uint64_t type, indices->required_whole_number("componentType"));
  if (type != kUint8 && type != kUint16 && type != kUint32) {
    return indices->error("componentType is " + std::to_string(type) + ", not one of unsigned integers");
  }
  RADBAKE_RETURN_IF_ERROR(check_sparse_list(*sparse, "indices", views, count, component_bytes(static_cast<int>(type))));
  return check_sparse_list(*sparse, "values", views, count, element);
}

Result<void> check_attributes(const Entry& primitive, const char* what, std::size_t num_accessors) {
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> attributes, primitive.member("attributes"));
  if (!attributes) return primitive.error(std::string(what) + " has no attributes");
  for (const auto& [name, value] : primitive.find("attributes")->items()) {
    RADBAKE_RETURN_IF_ERROR(attributes->index(name.c_str(), num_accessors, "accessors"));
  }
  return {};
}

Result<void> check_draco(const Entry& primitive, std::size_t num_views) {
  RADBAKE_ASSIGN_OR_RETURN(const std::optional<Entry> draco, primitive.extension("KHR_draco_mesh_compression"));
  if (!draco) return {};
  RADBAKE_RETURN_IF_ERROR(draco->required_whole_number("bufferView"));
  RADBAKE_RETURN_IF_ERROR(draco->index("bufferView", num_views, "buffer views"));
  // Unique ids of the compressed attributes: any number, looked up in the decoded mesh.
  return check_attributes(*draco, "KHR_draco_mesh_compression", kMaxInt);
}

}  // namespace

Result<void> check_accessors(const Entry& root) {
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> views, root.list("bufferViews", "buffer view"));
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> accessors, root.list("accessors", "accessor"));
  for (const Entry& accessor : accessors) {
    // Size of an element.
    RADBAKE_ASSIGN_OR_RETURN(const std::uint64_t component, accessor.required_whole_number("componentType"));
    const auto component_bytes = kComponentBytes.find(component);
    if (component_bytes == kComponentBytes.end()) {
      return accessor.error("componentType is " + std::to_string(component) + ", which glTF does not know");
    }
    RADBAKE_RETURN_IF_ERROR(accessor.text("type"));
    const json* type = accessor.find("type");
    if (type == nullptr || !kComponents.contains(type->get_ref<const std::string&>())) {
      return accessor.error("type is " + (type ? in_quotes(type->get_ref<const std::string&>()) : "missing"));
    }
    const std::uint64_t element = component_bytes->second * kComponents.at(type->get_ref<const std::string&>());
    RADBAKE_ASSIGN_OR_RETURN(const std::uint64_t count, accessor.required_whole_number("count", kMaxCount));
    RADBAKE_RETURN_IF_ERROR(accessor.flag("normalized"));
    RADBAKE_ASSIGN_OR_RETURN(const auto offset, accessor.whole_number("byteOffset"));
    RADBAKE_RETURN_IF_ERROR(check_sparse(accessor, views, count, element));
    // Without a view its values are compressed, or zero.
    RADBAKE_ASSIGN_OR_RETURN(const auto view_index, accessor.index("bufferView", views.size(), "buffer views"));
    if (!view_index || count == 0) continue;
    const Entry& view = views[*view_index];
    RADBAKE_ASSIGN_OR_RETURN(const auto view_stride, view.whole_number("byteStride"));
    const std::uint64_t stride = view_stride.value_or(element);
    if (stride < element) {
      return accessor.error("its elements of " + std::to_string(element) + " bytes overlap: " + view.name() +
                            " has a byteStride of " + std::to_string(stride));
    }
    RADBAKE_RETURN_IF_ERROR(check_extent(accessor, view, offset.value_or(0), count, stride, element));
  }
  return {};
}

Result<void> check_meshes(const Entry& root) {
  const std::size_t num_accessors = list_size(root, "accessors");
  RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> meshes, root.list("meshes", "mesh"));
  for (const Entry& mesh : meshes) {
    RADBAKE_RETURN_IF_ERROR(mesh.text("name"));
    RADBAKE_RETURN_IF_ERROR(check_texel_density(mesh));
    RADBAKE_ASSIGN_OR_RETURN(const std::vector<Entry> primitives, mesh.list("primitives", "primitive"));
    for (const Entry& primitive : primitives) {
      RADBAKE_RETURN_IF_ERROR(check_attributes(primitive, "it", num_accessors));
      RADBAKE_RETURN_IF_ERROR(primitive.index("indices", num_accessors, "accessors"));
      RADBAKE_RETURN_IF_ERROR(primitive.index("material", list_size(root, "materials"), "materials"));
      RADBAKE_RETURN_IF_ERROR(primitive.whole_number("mode", kModeTriangleFan));
      RADBAKE_RETURN_IF_ERROR(check_draco(primitive, list_size(root, "bufferViews")));
    }
  }
  return {};
}

}  // namespace radbake::gltf
