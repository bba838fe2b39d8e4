#pragma once

#include <span>
#include <vector>

namespace radbake::radiosity {

/// A rectangle of whole texels, padding included, and where it lies.
struct PackedRectangle {
  int width = 0, height = 0;
  int x = 0, y = 0;
};

/// Places rectangles without overlap in width x height texels; false where they do not all fit, then places mean
/// nothing. Rectangles are not turned. Skyline, best fit, by stb_rect_pack.
bool pack(std::span<PackedRectangle> rectangles, int width, int height);

struct SheetSize {
  int width = 0, height = 0;
};

/// The smallest sheet, sides multiples of `step` and at most `max_side`, in which all rectangles fit, and their places;
/// among equals the squarest. {0, 0}: there is none.
SheetSize pack_tightly(std::span<PackedRectangle> rectangles, int min_side, int max_side, int step);

}  // namespace radbake::radiosity
