#include "server/radiosity/lightmap/pack.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#define STB_RECT_PACK_IMPLEMENTATION
#define STBRP_STATIC
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wconversion"
#include <stb/stb_rect_pack.h>
#pragma GCC diagnostic pop

namespace radbake::radiosity {
namespace {

/// Widths that are tried: between a square's side and the side that makes the sheet twice as wide as high.
constexpr int kWidthsTried = 10;
/// From here on one pass takes a good part of a second.
constexpr std::size_t kManyRectangles = 20000;

int rounded_up(double x, int step) { return static_cast<int>(std::ceil(x / step)) * step; }

}  // namespace

bool pack(std::span<PackedRectangle> rectangles, int width, int height) {
  std::vector<stbrp_rect> rects(rectangles.size());
  for (std::size_t i = 0; i < rects.size(); ++i) {
    rects[i].id = static_cast<int>(i);
    rects[i].w = rectangles[i].width;
    rects[i].h = rectangles[i].height;
  }
  // As many nodes as texels in width: the skyline is then never coarsened.
  std::vector<stbrp_node> nodes(static_cast<std::size_t>(width));
  stbrp_context context;
  stbrp_init_target(&context, width, height, nodes.data(), width);
  stbrp_setup_heuristic(&context, STBRP_HEURISTIC_Skyline_BF_sortHeight);
  if (!stbrp_pack_rects(&context, rects.data(), static_cast<int>(rects.size()))) return false;
  for (const stbrp_rect& rect : rects) {
    rectangles[static_cast<std::size_t>(rect.id)].x = rect.x;
    rectangles[static_cast<std::size_t>(rect.id)].y = rect.y;
  }
  return true;
}

SheetSize pack_tightly(std::span<PackedRectangle> rectangles, int min_side, int max_side, int step) {
  double area = 0;
  int widest = min_side;
  for (const PackedRectangle& rectangle : rectangles) {
    area += static_cast<double>(rectangle.width) * rectangle.height;
    widest = std::max(widest, rectangle.width);
  }
  const double side = std::sqrt(area);
  const int narrow = std::min(rounded_up(std::max<double>(widest, side), step), max_side);
  const int wide = std::min(std::max(rounded_up(side * std::sqrt(2.0), step), narrow), max_side);
  const int tries = rectangles.size() > kManyRectangles ? 1 : kWidthsTried;
  const int stride = std::max(step, rounded_up(static_cast<double>(wide - narrow) / tries, step));

  SheetSize best;
  std::vector<PackedRectangle> trial(rectangles.begin(), rectangles.end());
  for (int width = narrow; width <= wide; width += stride) {
    if (!pack(trial, width, max_side)) continue;
    int used = min_side;
    for (const PackedRectangle& rectangle : trial) used = std::max(used, rectangle.y + rectangle.height);
    const int height = rounded_up(used, step);
    const auto size = static_cast<std::int64_t>(width) * height;
    const auto best_size = static_cast<std::int64_t>(best.width) * best.height;
    if (best_size > 0 &&
        (size > best_size || (size == best_size && std::abs(width - height) >= std::abs(best.width - best.height)))) {
      continue;
    }
    best = {width, height};
    std::copy(trial.begin(), trial.end(), rectangles.begin());
  }
  if (best.width > 0 || narrow == max_side) return best;
  // The widths tried were too narrow for the height: the widest sheet may still do.
  if (!pack(trial, max_side, max_side)) return {};
  std::copy(trial.begin(), trial.end(), rectangles.begin());
  return {max_side, max_side};
}

}  // namespace radbake::radiosity
