#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "common/base/result.h"
#include "common/scene/scene.h"
#include "server/radiosity/lightmap/plane_triangles.h"
#include "server/radiosity/survey/surfaces.h"

namespace radbake::radiosity {

/// Where the layout comes from. Field for field radbake.v1.LightmapUv.
enum class LightmapUv { kAuto, kKeep, kUnwrap };

struct LayoutOptions {
  LightmapUv uv = LightmapUv::kAuto;
  int sheet_size = 0;             ///< texels along a side; 0: as small as holds the scene
  double texels_per_meter = 32;   ///< before each mesh's own factor
  bool may_lower_density = true;  ///< where the scene would take too many sheets or texels: else that is an error
};

inline constexpr int kMinSheet = 64, kMaxSheet = 4096;
/// Texels of all sheets, and sheets.
inline constexpr std::int64_t kMaxTexels = std::int64_t{1} << 26;
inline constexpr int kMaxSheets = 64;

/// Where a mesh's lightmap coordinates come from. Field for field radbake.v1.UvSource.
enum class UvSource { kNone, kKept, kPlaced, kUnwrapped };

/// How a mesh lies in the lightmaps.
struct MeshPlacement {
  UvSource source = UvSource::kNone;
  int sheet = 0;
  Vec2 scale{1, 1}, offset;  ///< kKept, kPlaced: final coordinate = scale * own + offset
};

inline constexpr std::uint32_t kNoChart = std::numeric_limits<std::uint32_t>::max();

/// Which triangle lies where. All sheets have one size; they are stacked, sheet k from row k * height on.
struct Layout {
  int width = 0, height = 0, num_sheets = 1;
  std::vector<PlaneTriangle> corners;   ///< [triangles], texels of the stack
  std::vector<std::uint32_t> chart_of;  ///< [triangles], kNoChart: not unwrapped
  std::vector<MeshPlacement> meshes;    ///< [scene meshes]
  std::uint64_t num_charts = 0;         ///< of unwrapped meshes
  double max_stretch = 0;               ///< of unwrapped meshes
  std::vector<Warning> warnings;

  /// A corner's final texture coordinate, 0..1 in its sheet.
  Vec2 uv_of(std::uint32_t triangle, int corner, int sheet) const {
    const Vec2 p = corners[triangle][corner];
    return {p.x / width, (p.y - static_cast<double>(sheet) * height) / height};
  }
};

/// Lays a scene out.
///
///   kept       TEXCOORD_1 of all meshes is disjoint over the whole scene: one sheet, as it is
///   placed     else an object whose TEXCOORD_1 is inside 0..1 and without overlap gets a rectangle for it
///   unwrapped  any other object is cut into charts (unwrap.h)
///
/// Rectangles and charts get texels_per_meter times the mesh's factor, stand two texels apart, and fill sheet after
/// sheet; an object lies in one sheet. Sheets that are sized here have sides that are multiples of 32; a kept layout's
/// is a power of two.
/// Errors: kInvalidArgument, naming the mesh: kKeep and no valid TEXCOORD_1; more than
/// kMaxTexels or kMaxSheets; an object of more charts than a sheet has room for.
Result<Layout> make_layout(const Surfaces& surfaces, const LayoutOptions& options);

}  // namespace radbake::radiosity
