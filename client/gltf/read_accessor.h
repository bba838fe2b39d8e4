#pragma once

#include <array>
#include <string>
#include <vector>

#include "client/gltf/load_model.h"
#include "common/base/result.h"

namespace radbake::gltf {

/// Up to four numbers of a vertex; those that an attribute lacks are 0, but the fourth, opacity, is 1.
using Numbers = std::array<double, 4>;

/// Zeros of an attribute of so many components.
inline Numbers zeros(int num_components) { return {0, 0, 0, num_components < 4 ? 1.0 : 0.0}; }

/// Checks that an accessor, or data decoded in its place, holds what an attribute may hold.
///
/// POSITION: three floats or integers of 8 or 16 bits; NORMAL: three floats or normalised signed integers;
/// TEXCOORD_n: two floats or integers of 8 or 16 bits; COLOR_0: three or four floats or normalised unsigned integers.
/// Errors: kInvalidArgument that says what it holds and what it should; the caller names the accessor.
/// Source: glTF 2.0, 3.7.2.1 (meshes); KHR_mesh_quantization.
Result<void> check_attribute_type(const std::string& attribute, int num_components, int component_type,
                                  bool is_normalized);

/// Values of an attribute, vertex by vertex: strided, normalised and sparse as the accessor says. Without a buffer view
/// they are zero but for the sparse ones.
///
/// Precondition: check_document() has passed: view and sparse parts lie inside their buffers.
/// Errors: kInvalidArgument, naming accessor and value: another type, another count than the primitive has vertices,
///         sparse indices that are out of range or do not ascend, more than kMaxUnbackedElements without a view.
Result<std::vector<Numbers>> read_attribute(const tinygltf::Model& model, int accessor, const std::string& attribute,
                                            std::size_t num_vertices);

/// Values of an indices accessor, as above. Errors: also kInvalidArgument if they are not unsigned integers.
Result<std::vector<std::uint32_t>> read_indices(const tinygltf::Model& model, int accessor);

/// "accessor 3 (POSITION)".
std::string accessor_name(int accessor, const std::string& attribute);

}  // namespace radbake::gltf
