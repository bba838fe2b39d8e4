#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/radiosity/lightmap/fill.h"
#include "server/radiosity/lightmap/layout.h"

namespace radbake::radiosity {

/// How the two sides of seams differ. A seam is an edge between two triangles of a mesh whose normals agree along it
/// but that do not lie side by side in the lightmap: a viewer sees both sides next to each other.
struct SeamReport {
  std::uint64_t num_samples = 0;  ///< places on seams, two a texel
  double difference_before = 0;   ///< root mean square of the difference of the two bilinear values, over their mean
  double difference = 0;          ///< and after levelling
};

/// Brings the two sides of every seam together, moving texels as little as that takes:
///
///   min  sum_t w_t |x_t - x_t^0|^2  +  k sum_s |bilinear(x, a_s) - bilinear(x, b_s)|^2
///
/// over the texels that samples look up; w_t is 1 where a texel was measured, little where it was filled, so the sum of
/// light hardly changes. Solved by conjugate gradients.
/// Shapes: filled sheets, stacked: states [num_rows * width], rgba [num_rows * width * 4].
/// Source: Iwanicki 2013, "Lighting technology of The Last of Us" (SIGGRAPH courses).
SeamReport level_seams(const Surfaces& surfaces, const Layout& layout, std::span<const TexelState> states,
                       std::span<float> rgba);

}  // namespace radbake::radiosity
