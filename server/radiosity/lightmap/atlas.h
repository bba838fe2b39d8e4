#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "server/radiosity/lightmap/layout.h"
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

/// The lightmaps' texels: which triangles each one covers. Sheets are stacked: row y lies in sheet y / height().
class Atlas {
 public:
  /// Side of the square blocks that triangles are sorted into, texels.
  static constexpr int kBlock = 8;

  /// Errors: kInvalidArgument where the layout covers no texel.
  static Result<Atlas> make(const Surfaces& surfaces, Layout layout);

  const Layout& layout() const { return layout_; }
  int width() const { return layout_.width; }
  int height() const { return layout_.height; }  ///< of a sheet
  int num_sheets() const { return layout_.num_sheets; }
  int num_rows() const { return layout_.height * layout_.num_sheets; }
  /// Texels with any coverage.
  std::uint64_t num_texels() const { return num_texels_; }
  /// Share of all texels' area that is covered.
  double fill() const { return fill_; }
  /// Median over the triangles, weighted by area.
  double texels_per_meter() const { return texels_per_meter_; }

  /// Computes what texel (x, y) covers. The result's vectors are reused.
  void footprint(int x, int y, Footprint& out) const;

 private:
  void measure_density();
  void sort_into_blocks();
  void count_texels();
  /// Marks what the rows of a row of blocks cover. Returns the area, texels. Shapes: is_covered [rows * width].
  double cover_block_row(int by, std::vector<std::uint8_t>& is_covered) const;

  const Surfaces* surfaces_ = nullptr;
  Layout layout_;
  int blocks_x_ = 0, blocks_y_ = 0;
  std::uint64_t num_texels_ = 0;
  double fill_ = 0;
  double texels_per_meter_ = 0;
  std::vector<std::uint64_t> first_in_block_;  ///< [blocks + 1]
  std::vector<std::uint32_t> in_block_;        ///< triangles, ascending in each block
};

}  // namespace radbake::radiosity
