#pragma once

#include <cstdint>
#include <string>

#include "common/base/result.h"

namespace radbake {

/// What the head of a Draco mesh claims. A decoder allocates for these counts before it looks at the rest: a file of
/// 42 bytes can ask for a gigabyte.
struct DracoClaims {
  std::uint64_t num_faces = 0;
  std::uint64_t num_points = 0;         ///< edgebreaker: vertices before attributes split them
  std::uint64_t num_split_symbols = 0;  ///< edgebreaker: each makes one more vertex for a while
  unsigned num_connectivities = 0;      ///< edgebreaker: attributes with seams of their own, each as large as the mesh
};

/// Reads the head of a Draco mesh, bitstream 2.2, sequential or edgebreaker, without metadata. Allocates nothing.
///
/// Errors: kInvalidArgument says what is not supported, or that the blob ends.
/// Source: Draco 1.5.5, MeshEdgebreakerDecoderImpl::DecodeConnectivity, MeshSequentialDecoder::DecodeConnectivity.
Result<DracoClaims> peek_draco(const std::string& blob);

}  // namespace radbake
