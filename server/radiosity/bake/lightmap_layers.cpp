#include "server/radiosity/bake/lightmap_layers.h"

#include <span>

#include "server/radiosity/lightmap/fill.h"
#include "server/radiosity/lightmap/level_seams.h"

namespace radbake::radiosity {
namespace {

constexpr int kPadding = 2;  ///< texels around charts that get their neighbours' mean

/// What one kind of layer shows.
struct Kind {
  const char* suffix;
  const char* quantity;
  const char* unit;
};

/// How a layer was completed.
struct Finish {
  FillCounts fill;
  SeamReport seams;
};

Finish append_layer(const Surfaces& surfaces, const Atlas& atlas, const std::vector<TexelState>& states,
                    const Kind& kind, std::vector<float>& rgba, std::vector<Layer>& layers) {
  Finish finish;
  const auto sheet_texels = static_cast<std::size_t>(atlas.width()) * atlas.height();
  for (int sheet = 0; sheet < atlas.num_sheets(); ++sheet) {
    const std::size_t first = sheet_texels * static_cast<std::size_t>(sheet);
    const FillCounts counts = fill_from_neighbours(std::span(states).subspan(first, sheet_texels), atlas.width(),
                                                   kPadding, std::span(rgba).subspan(4 * first, 4 * sheet_texels));
    finish.fill.num_filled += counts.num_filled;
    finish.fill.num_dilated += counts.num_dilated;
  }
  finish.seams = level_seams(surfaces, atlas.layout(), states, rgba);
  for (int sheet = 0; sheet < atlas.num_sheets(); ++sheet) {
    const auto first = rgba.begin() + static_cast<std::ptrdiff_t>(4 * sheet_texels) * sheet;
    layers.push_back({lightmap_name(sheet) + kind.suffix, kind.quantity, kind.unit, atlas.width(), atlas.height(), 4,
                      std::vector<float>(first, first + static_cast<std::ptrdiff_t>(4 * sheet_texels))});
  }
  rgba = {};
  return finish;
}

}  // namespace

LightmapSummary append_layers(const Surfaces& surfaces, const Atlas& atlas, GatheredMap& map,
                              std::vector<Layer>& layers) {
  const auto append = [&](const Kind& kind, std::vector<float>& rgba) {
    return append_layer(surfaces, atlas, map.states, kind, rgba, layers);
  };
  const Finish all = append({"", "irradiance", "lx"}, map.rgba);
  if (!map.direct.empty()) append({"_direct", "irradiance", "lx"}, map.direct);
  if (!map.indirect.empty()) append({"_indirect", "irradiance", "lx"}, map.indirect);
  if (!map.openness.empty()) append({"_ao", "openness", "1"}, map.openness);

  LightmapSummary summary;
  summary.num_texels_filled = all.fill.num_filled;
  summary.num_texels_dilated = all.fill.num_dilated;
  summary.num_seam_samples = all.seams.num_samples;
  summary.seam_difference_before = all.seams.difference_before;
  summary.seam_difference = all.seams.difference;
  summary.atlas_size = atlas.width();
  summary.atlas_height = atlas.height();
  summary.num_lightmaps = atlas.num_sheets();
  summary.num_texels = atlas.num_texels();
  summary.texels_per_meter = atlas.texels_per_meter();
  summary.fill = atlas.fill();
  summary.num_charts = atlas.layout().num_charts;
  summary.max_stretch = atlas.layout().max_stretch;
  for (const MeshPlacement& mesh : atlas.layout().meshes) {
    summary.num_meshes_kept += mesh.source == UvSource::kKept;
    summary.num_meshes_placed += mesh.source == UvSource::kPlaced;
    summary.num_meshes_unwrapped += mesh.source == UvSource::kUnwrapped;
  }
  return summary;
}

}  // namespace radbake::radiosity
