#include "server/radiosity/lightmap/layout.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "server/radiosity/lightmap/given_layout.h"
#include "server/radiosity/lightmap/pack.h"
#include "server/radiosity/lightmap/unwrap.h"

namespace radbake::radiosity {
namespace {

/// Sides of sheets that are sized here are multiples of it: whole tiles, whole blocks of compressed textures.
constexpr int kSheetStep = 32;
/// Texels around what is packed, on each side: two stand apart by twice this, so a bilinear look-up at the border of
/// one never meets the other.
constexpr int kMargin = 1;
/// By how much an object that does not fit in a sheet is made coarser, until it fits.
constexpr double kCoarser = 0.9;
constexpr std::size_t kNamedMeshes = 5;

/// Something that is packed: a chart, or the used part of an object's own layout.
struct Item {
  Vec2 low;   ///< placed: of the used part of 0..1
  Vec2 size;  ///< in texels at the wanted density
  int chart = -1;
};

/// The meshes that share one layout.
struct Object {
  std::vector<std::uint32_t> meshes;
  std::string fault;           ///< why its own layout does not serve; empty: placed
  bool has_given = false;      ///< every mesh has a TEXCOORD_1
  double texels_per_unit = 0;  ///< placed: texels of a whole 0..1 at the wanted density
  double coarsening = 1;       ///< factor on its texels, at most 1
  std::size_t first_item = 0, end_item = 0;
  int sheet = 0;
};

std::string in_quotes(const std::string& name) { return "'" + name + "'"; }

class LayoutMaker {
 public:
  LayoutMaker(const Surfaces& surfaces, const LayoutOptions& options)
      : surfaces_(surfaces), options_(options), meshes_(surfaces.scene->meshes), ranges_(mesh_ranges(surfaces)) {}

  Result<Layout> make() {
    layout_.meshes.resize(meshes_.size());
    layout_.corners.resize(surfaces_.size());
    layout_.chart_of.assign(surfaces_.size(), kNoChart);
    find_objects();
    if (options_.uv != LightmapUv::kUnwrap && can_be_kept()) {
      keep();
      return std::move(layout_);
    }
    RADBAKE_RETURN_IF_ERROR(judge_objects());
    for (Object& object : objects_) add_items(object);
    RADBAKE_RETURN_IF_ERROR(pack_sheets());
    place_objects();
    return std::move(layout_);
  }

 private:
  void find_objects() {
    std::map<int, std::size_t> object_of;
    for (std::uint32_t m = 0; m < meshes_.size(); ++m) {
      if (ranges_[m].begin == ranges_[m].end) continue;
      const auto [it, is_new] = object_of.emplace(meshes_[m].object, objects_.size());
      if (is_new) objects_.emplace_back();
      objects_[it->second].meshes.push_back(m);
    }
    for (Object& object : objects_) {
      object.has_given = true;
      for (const std::uint32_t m : object.meshes) {
        object.has_given = object.has_given && !meshes_[m].texcoord1.empty();
        const std::string fault = given_fault(surfaces_, m, ranges_[m]);
        if (object.fault.empty() && !fault.empty()) object.fault = in_quotes(meshes_[m].name) + " " + fault;
      }
    }
  }

  /// Whether TEXCOORD_1 is disjoint over the whole scene. Says where it is not, if that is all that is wrong with it.
  bool can_be_kept() {
    std::vector<MeshRange> used;
    for (const Object& object : objects_) {
      if (!object.fault.empty()) return false;
      for (const std::uint32_t m : object.meshes) used.push_back(ranges_[m]);
    }
    const GivenOverlap overlap = given_overlap(surfaces_, used);
    const bool is_disjoint = overlap.share <= kToleratedOverlap;
    if (!overlap.names.empty()) {
      layout_.warnings.push_back(
          {"lightmap_uv_overlap", "TEXCOORD_1 overlaps: " + overlap.names +
                                      (is_disjoint ? "; the light there is mixed"
                                                   : "; so every object gets a rectangle of its own for its layout")});
    }
    return is_disjoint;
  }

  /// Takes TEXCOORD_1 as it is, in one sheet.
  void keep() {
    const double metres = surfaces_.metres_per_unit;
    double in_layout = 0, in_world = 0;
    for (std::uint32_t t = 0; t < surfaces_.size(); ++t) {
      layout_.corners[t] = given_corners(surfaces_, t);
      in_layout += std::fabs(twice_area(layout_.corners[t])) / 2;
      in_world += surfaces_.areas[t] * metres * metres;
    }
    int size = options_.sheet_size;
    if (size == 0) {
      size = kMinSheet;
      const double wanted = options_.texels_per_meter * std::sqrt(in_world);
      while (size < kMaxSheet && size * std::sqrt(in_layout) < wanted) size *= 2;
    }
    for (PlaneTriangle& triangle : layout_.corners) {
      for (Vec2& corner : triangle) corner = corner * size;
    }
    layout_.width = layout_.height = size;
    for (MeshPlacement& placement : layout_.meshes) placement.source = UvSource::kKept;
  }

  /// Decides which objects keep their own layout. Errors: one must and cannot.
  Result<void> judge_objects() {
    std::string unwrapped;
    std::size_t num_unwrapped = 0;
    for (Object& object : objects_) {
      if (options_.uv == LightmapUv::kUnwrap) {
        object.fault = "unwrap";
        continue;
      }
      if (object.fault.empty()) {
        std::vector<MeshRange> own;
        for (const std::uint32_t m : object.meshes) own.push_back(ranges_[m]);
        const GivenOverlap overlap = given_overlap(surfaces_, own);
        if (overlap.share > kToleratedOverlap) object.fault = "TEXCOORD_1 overlaps: " + overlap.names;
      }
      if (object.fault.empty()) continue;
      if (options_.uv == LightmapUv::kKeep) {
        return invalid_argument(object.fault + "; --lightmap-uv auto unwraps such meshes");
      }
      // A mesh that never had a layout is no surprise; one whose layout was thrown away is.
      if (!object.has_given) continue;
      if (++num_unwrapped <= kNamedMeshes) unwrapped += (unwrapped.empty() ? "" : "; ") + object.fault;
    }
    if (num_unwrapped > 0) {
      if (num_unwrapped > kNamedMeshes) unwrapped += "; ...";
      layout_.warnings.push_back({"lightmap_uv_unwrapped", std::to_string(num_unwrapped) +
                                                               " objects have a TEXCOORD_1 that cannot hold a "
                                                               "lightmap and were unwrapped: " +
                                                               unwrapped});
    }
    return {};
  }

  /// Texels a scene unit that an object's mesh is to get.
  double wanted_density(std::uint32_t mesh) const {
    return options_.texels_per_meter * meshes_[mesh].texel_density * surfaces_.metres_per_unit;
  }

  void add_items(Object& object) {
    object.first_item = items_.size();
    if (object.fault.empty()) {
      // The root of the ratio of the areas, as the mean over the object.
      Vec2 low{1, 1}, high{0, 0};
      double in_layout = 0, wanted = 0;
      for (const std::uint32_t m : object.meshes) {
        for (std::uint32_t t = ranges_[m].begin; t < ranges_[m].end; ++t) {
          const PlaneTriangle corners = given_corners(surfaces_, t);
          for (const Vec2 corner : corners) {
            low = {std::min(low.x, corner.x), std::min(low.y, corner.y)};
            high = {std::max(high.x, corner.x), std::max(high.y, corner.y)};
          }
          in_layout += std::fabs(twice_area(corners)) / 2;
          wanted += surfaces_.areas[t] * wanted_density(m) * wanted_density(m);
        }
      }
      object.texels_per_unit = std::sqrt(wanted / in_layout);
      items_.push_back({low, (high - low) * object.texels_per_unit, -1});
    } else {
      for (const std::uint32_t m : object.meshes) {
        for (Chart& chart : unwrap(surfaces_, ranges_[m].begin, ranges_[m].end, kMargin / wanted_density(m))) {
          layout_.max_stretch = std::max(layout_.max_stretch, chart.stretch);
          items_.push_back({{}, chart.size * wanted_density(m), static_cast<int>(charts_.size())});
          charts_.push_back(std::move(chart));
        }
      }
    }
    object.end_item = items_.size();
  }

  /// The rectangles of objects [first, end), in order.
  std::vector<PackedRectangle> rectangles(std::size_t first, std::size_t end) const {
    std::vector<PackedRectangle> out;
    for (std::size_t o = first; o < end; ++o) {
      for (std::size_t i = objects_[o].first_item; i < objects_[o].end_item; ++i) {
        const Vec2 size = items_[i].size * (objects_[o].coarsening * lowered_);
        // Rounding must not open another row of texels.
        constexpr double kSlack = 1e-6;
        const auto side = [](double texels) {
          return static_cast<int>(std::ceil(std::clamp(texels - kSlack, 1.0, 1e6))) + 2 * kMargin;
        };
        out.push_back({side(size.x), side(size.y), 0, 0});
      }
    }
    return out;
  }

  bool fits(const std::vector<PackedRectangle>& rectangles, int side) const {
    for (const PackedRectangle& r : rectangles) {
      if (r.width > side || r.height > side) return false;
    }
    return true;
  }

  static double texels(const std::vector<PackedRectangle>& rectangles) {
    double sum = 0;
    for (const PackedRectangle& r : rectangles) sum += static_cast<double>(r.width) * r.height;
    return sum;
  }

  Result<void> pack_sheets() {
    const int side = options_.sheet_size > 0 ? options_.sheet_size : kMaxSheet;
    RADBAKE_RETURN_IF_ERROR(hold_to_limit(side));
    for (;;) {
      RADBAKE_RETURN_IF_ERROR(make_each_fit(side));
      if (options_.sheet_size == 0 && pack_one_sheet()) break;
      pack_sheet_after_sheet(side);
      if (layout_.num_sheets <= most_sheets(side)) break;
      if (!options_.may_lower_density) return too_many_sheets(side, layout_.num_sheets);
      lowered_ *= kCoarser;
    }
    warn_of_coarser(side);
    return {};
  }

  /// Packs everything in one sheet of the size that it takes; false where it does not fit.
  bool pack_one_sheet() {
    std::vector<PackedRectangle> all = rectangles(0, objects_.size());
    if (texels(all) > static_cast<double>(kMaxSheet) * kMaxSheet) return false;
    const SheetSize size = pack_tightly(all, kMinSheet, kMaxSheet, kSheetStep);
    if (size.width == 0) return false;
    layout_.width = size.width;
    layout_.height = size.height;
    layout_.num_sheets = 1;
    places_ = std::move(all);
    return true;
  }

  /// Fills each sheet with the longest run of objects that fits, found by halving.
  void pack_sheet_after_sheet(int side) {
    layout_.width = layout_.height = side;
    layout_.num_sheets = 0;
    places_.clear();
    for (std::size_t first = 0; first < objects_.size(); ++layout_.num_sheets) {
      std::size_t fitting = first + 1, too_many = objects_.size() + 1;
      std::vector<PackedRectangle> placed = rectangles(first, fitting);
      pack(placed, side, side);
      while (fitting + 1 < too_many) {
        const std::size_t middle = fitting + (too_many - fitting) / 2;
        std::vector<PackedRectangle> trial = rectangles(first, middle);
        if (texels(trial) <= static_cast<double>(side) * side && pack(trial, side, side)) {
          fitting = middle;
          placed = std::move(trial);
        } else {
          too_many = middle;
        }
      }
      for (std::size_t o = first; o < fitting; ++o) objects_[o].sheet = layout_.num_sheets;
      places_.insert(places_.end(), placed.begin(), placed.end());
      first = fitting;
    }
  }

  static std::int64_t most_sheets(std::int64_t side) {
    return std::min<std::int64_t>(kMaxSheets, kMaxTexels / (side * side));
  }

  Error too_many_sheets(int side, double sheets) const {
    return invalid_argument("at " + std::to_string(options_.texels_per_meter * lowered_) +
                            " texels per metre the scene takes about " + std::to_string(std::llround(sheets)) +
                            " lightmaps of " + std::to_string(side) + " x " + std::to_string(side) +
                            " texels, above the limit of " + std::to_string(most_sheets(side)) +
                            ": lower --texels-per-meter" + (side < kMaxSheet ? " or raise --atlas-size" : ""));
  }

  /// Makes the whole scene coarser where it would take too many texels, if that is allowed.
  Result<void> hold_to_limit(int side) {
    // Packing leaves some of each sheet empty.
    constexpr double kUsable = 0.7;
    const double sheet = static_cast<double>(side) * side;
    const double usable = kUsable * sheet * static_cast<double>(most_sheets(side));
    const double wanted = texels(rectangles(0, objects_.size()));
    if (wanted <= usable) return {};
    if (!options_.may_lower_density) return too_many_sheets(side, wanted / sheet);
    while (texels(rectangles(0, objects_.size())) > usable && lowered_ > 1e-9) lowered_ *= kCoarser;
    layout_.warnings.push_back(
        {"texel_density_lowered",
         "the scene would take " + std::to_string(static_cast<std::int64_t>(wanted)) + " texels at " +
             std::to_string(static_cast<int>(options_.texels_per_meter)) + " texels per metre; it is baked at " +
             std::to_string(options_.texels_per_meter * lowered_) + " (is it in metres? --texels-per-meter decides)"});
    return {};
  }

  /// Makes objects coarser that do not fit in a sheet by themselves. Errors: one has too many charts for any scale.
  Result<void> make_each_fit(int side) {
    for (std::size_t o = 0; o < objects_.size(); ++o) {
      objects_[o].coarsening = 1;
      std::vector<PackedRectangle> own = rectangles(o, o + 1);
      while (!fits(own, side) || texels(own) > static_cast<double>(side) * side || !pack(own, side, side)) {
        objects_[o].coarsening *= kCoarser;
        // Each chart takes a texel and its margin at least.
        if (objects_[o].coarsening < 1e-6) {
          return invalid_argument(name_of(objects_[o]) + " has " + std::to_string(own.size()) +
                                  " charts, too many for a lightmap of " + std::to_string(side) +
                                  " texels: raise --atlas-size, or bake to vertices");
        }
        own = rectangles(o, o + 1);
      }
    }
    return {};
  }

  std::string name_of(const Object& object) const { return in_quotes(meshes_[object.meshes[0]].name); }

  void warn_of_coarser(int side) {
    if (lowered_ < 1) {
      layout_.warnings.push_back(
          {"texel_density_lowered",
           "the scene is too large for " + std::to_string(static_cast<int>(options_.texels_per_meter)) +
               " texels per metre and is baked at " + std::to_string(options_.texels_per_meter * lowered_) +
               " (is it in metres? --texels-per-meter decides)"});
    }
    std::string names;
    std::size_t num_coarser = 0;
    for (const Object& object : objects_) {
      if (object.coarsening == 1 || ++num_coarser > kNamedMeshes) continue;
      names += (names.empty() ? "" : ", ") + name_of(object) + " (by " +
               std::to_string(1 / object.coarsening).substr(0, 4) + ")";
    }
    if (num_coarser == 0) return;
    layout_.warnings.push_back({"object_too_large", std::to_string(num_coarser) +
                                                        " objects do not fit in a lightmap of " + std::to_string(side) +
                                                        " texels and are baked coarser: " + names});
  }

  void place_objects() {
    for (const Object& object : objects_) {
      const double coarsening = object.coarsening * lowered_;
      for (const std::uint32_t m : object.meshes) {
        layout_.meshes[m].sheet = object.sheet;
        layout_.meshes[m].source = object.fault.empty() ? UvSource::kPlaced : UvSource::kUnwrapped;
      }
      for (std::size_t i = object.first_item; i < object.end_item; ++i) {
        const Vec2 in_sheet{static_cast<double>(places_[i].x) + kMargin, static_cast<double>(places_[i].y) + kMargin};
        const Vec2 in_stack = in_sheet + Vec2{0, static_cast<double>(object.sheet) * layout_.height};
        if (items_[i].chart >= 0) {
          place_chart(charts_[items_[i].chart], static_cast<std::uint32_t>(items_[i].chart), in_stack, coarsening);
          continue;
        }
        const double scale = object.texels_per_unit * coarsening;
        for (const std::uint32_t m : object.meshes) {
          for (std::uint32_t t = ranges_[m].begin; t < ranges_[m].end; ++t) {
            const PlaneTriangle given = given_corners(surfaces_, t);
            for (int k = 0; k < 3; ++k) layout_.corners[t][k] = in_stack + (given[k] - items_[i].low) * scale;
          }
          const Vec2 corner = in_sheet - items_[i].low * scale;
          layout_.meshes[m].scale = {scale / layout_.width, scale / layout_.height};
          layout_.meshes[m].offset = {corner.x / layout_.width, corner.y / layout_.height};
        }
      }
    }
    layout_.num_charts = charts_.size();
  }

  void place_chart(const Chart& chart, std::uint32_t index, Vec2 corner, double coarsening) {
    const double scale = wanted_density(surfaces_.meshes[chart.triangles[0]]) * coarsening;
    for (const std::uint32_t t : chart.triangles) {
      const PlaneTriangle flat = chart.corners(surfaces_, t);
      for (int k = 0; k < 3; ++k) layout_.corners[t][k] = corner + flat[k] * scale;
      layout_.chart_of[t] = index;
    }
  }

  const Surfaces& surfaces_;
  const LayoutOptions& options_;
  const std::vector<Mesh>& meshes_;
  std::vector<MeshRange> ranges_;
  std::vector<Object> objects_;
  std::vector<Item> items_;
  std::vector<Chart> charts_;
  std::vector<PackedRectangle> places_;  ///< [items_]
  double lowered_ = 1;                   ///< factor on all densities
  Layout layout_;
};

}  // namespace

Result<Layout> make_layout(const Surfaces& surfaces, const LayoutOptions& options) {
  return LayoutMaker(surfaces, options).make();
}

}  // namespace radbake::radiosity
