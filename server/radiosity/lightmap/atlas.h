#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "server/radiosity/survey/surfaces.h"

namespace radbake::radiosity {

/// The part of a triangle that lies inside a texel, as one triangle of a fan.
struct FootprintPiece {
  std::uint32_t triangle = 0;
  std::array<Vec2, 3> corners;  ///< barycentric weights (u, v)
  double area_up_to = 0;        ///< running sum of world areas over the texel's pieces, scene units squared
};

/// What a texel covers of the surfaces.
struct Footprint {
  std::vector<FootprintPiece> pieces;
  double coverage = 0;  ///< share of the texel's square, 0..1

  bool is_empty() const { return pieces.empty(); }
  double area() const { return pieces.empty() ? 0 : pieces.back().area_up_to; }
  /// A point, uniform by area for a uniform (x, y) in the unit square.
  SurfacePoint sample(double x, double y) const;
};

/// The lightmap's layout: which triangles lie where, by TEXCOORD_1, row 0 at the top (v = 0).
class Atlas {
 public:
  /// Side of the square blocks that triangles are sorted into, texels.
  static constexpr int kBlock = 8;

  /// Errors: kInvalidArgument naming the mesh: no TEXCOORD_1, coordinates outside 0..1, nothing with an area in the
  /// atlas, two triangles on one place (then both meshes).
  static Result<Atlas> make(const Surfaces& surfaces, int size);

  int size() const { return size_; }
  /// Texels with any coverage.
  std::uint64_t num_texels() const { return num_texels_; }
  /// Median over the triangles, weighted by area.
  double texels_per_meter() const { return texels_per_meter_; }

  /// Computes what texel (x, y) covers. The result's vectors are reused.
  void footprint(int x, int y, Footprint& out) const;

 private:
  Result<void> check_overlap() const;
  void count_texels();

  const Surfaces* surfaces_ = nullptr;
  int size_ = 0;
  int blocks_ = 0;  ///< along a side
  std::uint64_t num_texels_ = 0;
  double texels_per_meter_ = 0;
  std::vector<std::array<Vec2, 3>> corners_;   ///< [triangles], in texels
  std::vector<std::uint64_t> first_in_block_;  ///< [blocks_^2 + 1]
  std::vector<std::uint32_t> in_block_;        ///< triangles, ascending in each block
};

/// The smallest power of two, 64..4096, that gives at least this many texels a metre (over the whole scene: the root of
/// the ratio of the areas in the atlas and in the world). Meshes without TEXCOORD_1 do not count.
int atlas_size_for_density(const Surfaces& surfaces, double texels_per_meter);

/// Lightmap coordinates of a triangle's corners. Precondition: its mesh has them.
std::array<Vec2, 3> lightmap_corners(const Surfaces& surfaces, std::uint32_t triangle);

}  // namespace radbake::radiosity
