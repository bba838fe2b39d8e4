#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "client/gltf/read_accessor.h"
#include "common/base/result.h"

namespace radbake::gltf {

/// An attribute that is wanted of a compressed primitive.
struct DracoAttribute {
  std::string name;            ///< POSITION
  int unique_id = 0;           ///< in the compressed mesh
  bool is_normalized = false;  ///< its integers stand for fractions
};

/// A compressed primitive and what the file says of it.
struct DracoPrimitive {
  std::span<const std::byte> bytes;
  std::vector<DracoAttribute> attributes;
  std::uint64_t num_vertices = 0;   ///< count of its POSITION accessor
  std::uint64_t num_triangles = 0;  ///< that its indices accessor makes
};

/// Its vertices are the points of the decoded mesh, in Draco's order; its triangles are a list, whatever the mode.
struct DecodedPrimitive {
  std::map<std::string, std::vector<Numbers>> attributes;  ///< by name
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Decodes the wanted attributes, in any type that check_attribute_type() allows, and the triangles.
///
/// Not by tinygltf: that dereferences attributes that are not there, copies any number of components into four, and
/// takes a mesh that does not decode for one without vertices. A stream of 42 bytes may claim 50 million faces, and the
/// decoder takes a gigabyte before it finds out: the header is held against the accessors first.
///
/// Errors: kInvalidArgument: not Draco, another version, more than the accessors say, corrupt, attribute missing.
/// Source: Draco bitstream 2.2, header and connectivity headers.
Result<DecodedPrimitive> decode_draco(const DracoPrimitive& primitive);

}  // namespace radbake::gltf
