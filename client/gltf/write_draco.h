#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "client/gltf/write_elements.h"
#include "common/base/result.h"

namespace radbake::gltf {

/// A compressed primitive with all its attributes, whatever they mean.
struct DracoElements {
  std::map<std::string, Elements> attributes;  ///< by name, one element a point
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// What the file says of an attribute: its unique id in the compressed mesh, and its accessor, without values.
struct DracoAttribute {
  std::uint32_t unique_id = 0;
  Elements accessor;
};

/// Decodes a compressed primitive, each attribute in the component type of its accessor.
///
/// Precondition: read_gltf() has read the same bytes, so their header was held against the accessors.
/// Errors: kInvalidArgument, naming the attribute: not there, other components, a value that its type does not hold.
Result<DracoElements> decode_draco_elements(std::string_view bytes,
                                            const std::map<std::string, DracoAttribute>& attributes);

}  // namespace radbake::gltf
