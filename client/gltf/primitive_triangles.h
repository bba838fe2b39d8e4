#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"

namespace radbake::gltf {

/// A primitive's `mode` where it has triangles; lower modes are points and lines.
inline constexpr int kModeTriangles = 4;
inline constexpr int kModeTriangleStrip = 5;
inline constexpr int kModeTriangleFan = 6;

/// Number of triangles that corners make: 0 for points, lines, and strips and fans of fewer than three corners.
std::size_t num_triangles_of(int mode, std::size_t num_corners);

/// The triangles of a primitive, in the file's order and of the file's vertices, those that use a vertex twice
/// included. Whoever goes over the triangles of a primitive does it by this, so that numbers of triangles agree.
///
///   list: (v_3i, v_3i+1, v_3i+2)   strip: (v_i, v_i+1+i%2, v_i+2-i%2)   fan: (v_i+1, v_i+2, v_0)
///
/// `corners`: the indices; without indices, consecutive_corners(num_vertices). No corners make no triangles.
/// Errors: kInvalidArgument, naming corner and value: an index that is no vertex, a list whose number of corners is no
///         multiple of three, a strip or fan of one or two corners, a mode of points or lines.
/// Source: glTF 2.0, 3.7.2.1 (topology types).
Result<std::vector<std::array<std::uint32_t, 3>>> primitive_triangles(int mode, std::span<const std::uint32_t> corners,
                                                                      std::size_t num_vertices);

/// 0, 1, 2, ... n - 1: the corners of a primitive of n vertices without indices.
std::vector<std::uint32_t> consecutive_corners(std::size_t num_vertices);

}  // namespace radbake::gltf
