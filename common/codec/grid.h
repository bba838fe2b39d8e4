#pragma once

#include "common/base/result.h"
#include "common/geometry/vector.h"
#include "common/scene/scene.h"

namespace radbake {

/// The lattice { k step : k integer, |k| < 2^(bits - 1) } onto which coordinates are rounded before Draco sees them.
///
/// The step is a power of two, so every lattice point is a float32 and Draco's float32 arithmetic is exact on it:
/// what is decoded is what was rounded, bit for bit. Round coordinates of a model (0, 2.5) stay what they are.
struct Grid {
  double step = 0;  ///< 0: not quantised, the coordinates travel as float32
  int bits = 0;     ///< 0: not quantised

  bool is_quantised() const { return bits > 0; }
  /// Nearest lattice point, or x rounded to float32. Precondition: |x| is at most the extent the grid was chosen for.
  float round(double x) const;
};

/// Coarsest grid that moves no coordinate by more than `max_move`; not quantised where 24 bits do not reach `extent`.
///
/// Why 24: |k| + 1/2 must stay below 2^23 for Draco's rounding, floor(k + 0.5f), to be exact. The grid is signed for
/// the same reason: from 0 to 2^24 the upper half would be off by one.
/// Units:  max_move and extent (largest |x|) in the unit of the coordinates.
Grid choose_grid(double extent, double max_move);

/// Where the positions of a scene go.
struct PositionGrid {
  Vec3 origin;            ///< centre of the bounding box, rounded to the lattice
  Grid grid;              ///< of the positions relative to origin
  double texel_size = 0;  ///< metres: 5th percentile over the triangles
};

/// How much of a texel a position may move, and a texture coordinate.
inline constexpr double kPositionMoveTexels = 1e-3;
inline constexpr double kUvMoveTexels = 1e-2;

/// Chooses the one grid of a scene: positions move by at most 1/1000 of the 5th-percentile texel.
///
///   texel = sqrt(area / (area in texcoord1 * atlas_size^2)); without atlas_size or texcoord1: 1 / texels_per_meter
///
/// Errors: kInvalidArgument without a triangle that has an area, or for an extent beyond float32.
Result<PositionGrid> choose_position_grid(const Scene& scene, int atlas_size, double texels_per_meter);

}  // namespace radbake
