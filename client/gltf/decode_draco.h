#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>

#include "common/base/result.h"
#include "common/scene/scene.h"

namespace radbake::gltf {

/// A compressed primitive and what the file says of it.
struct DracoPrimitive {
  std::span<const std::byte> bytes;
  std::map<std::string, int> attributes;  ///< POSITION -> unique id in the compressed mesh
  std::uint64_t num_vertices = 0;         ///< count of its POSITION accessor
  std::uint64_t num_indices = 0;          ///< count of its indices accessor
};

/// Decodes positions, normals, texture coordinates and triangles; name and material stay empty.
///
/// Not by tinygltf: that dereferences attributes that are not there, copies any number of components into four, and
/// takes a mesh that does not decode for one without vertices. A stream of 42 bytes may claim 50 million faces, and the
/// decoder takes a gigabyte before it finds out: the header is held against the accessors first.
///
/// Errors: kInvalidArgument: not Draco, another version, more than the accessors say, corrupt, attribute missing.
/// Source: Draco bitstream 2.2, header and connectivity headers.
Result<Mesh> decode_draco(const DracoPrimitive& primitive);

}  // namespace radbake::gltf
