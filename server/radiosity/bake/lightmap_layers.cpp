#include "server/radiosity/bake/lightmap_layers.h"

#include <algorithm>
#include <span>

#include "server/radiosity/lightmap/fill.h"
#include "server/radiosity/lightmap/level_seams.h"

namespace radbake::radiosity {
namespace {

constexpr int kPadding = 2;  ///< texels around charts that get their neighbours' mean

/// What one kind of layer shows; its name is prefix + number of the sheet + suffix.
struct Kind {
  const char* prefix;
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
                    const Kind& kind, bool levels_seams, std::vector<float> rgba, std::vector<Layer>& layers) {
  Finish finish;
  const auto sheet_texels = static_cast<std::size_t>(atlas.width()) * atlas.height();
  for (int sheet = 0; sheet < atlas.num_sheets(); ++sheet) {
    const std::size_t first = sheet_texels * static_cast<std::size_t>(sheet);
    const FillCounts counts = fill_from_neighbours(std::span(states).subspan(first, sheet_texels), atlas.width(),
                                                   kPadding, std::span(rgba).subspan(4 * first, 4 * sheet_texels));
    finish.fill.num_filled += counts.num_filled;
    finish.fill.num_dilated += counts.num_dilated;
  }
  if (levels_seams) finish.seams = level_seams(surfaces, atlas.layout(), states, rgba);
  for (int sheet = 0; sheet < atlas.num_sheets(); ++sheet) {
    const auto first = rgba.begin() + static_cast<std::ptrdiff_t>(4 * sheet_texels) * sheet;
    layers.push_back({kind.prefix + std::to_string(sheet) + kind.suffix, kind.quantity, kind.unit, atlas.width(),
                      atlas.height(), 4,
                      std::vector<float>(first, first + static_cast<std::ptrdiff_t>(4 * sheet_texels))});
  }
  return finish;
}

}  // namespace

LightmapSummary append_layers(const Surfaces& surfaces, const LightmapGather& gather, WantedLayers wanted,
                              std::vector<float> standard_errors, std::vector<Layer>& layers) {
  const Atlas& atlas = gather.atlas();
  const LightEstimate& light = gather.estimate();
  const std::vector<TexelFacts>& facts = gather.facts();
  std::vector<TexelState> states;
  states.reserve(facts.size());
  for (const TexelFacts& texel : facts) states.push_back(texel.state);
  const auto append = [&](const Kind& kind, const auto& value_of) {
    std::vector<float> rgba(4 * facts.size());
    for (std::size_t i = 0; i < facts.size(); ++i) {
      const Vec3 value = value_of(i);
      for (int c = 0; c < 3; ++c) rgba[4 * i + static_cast<std::size_t>(c)] = static_cast<float>(value[c]);
      rgba[4 * i + 3] = facts[i].coverage;
    }
    return append_layer(surfaces, atlas, states, kind, true, std::move(rgba), layers);
  };
  const Finish all = append({"lightmap_", "", "irradiance", "lx"}, [&](std::size_t i) { return light.irradiance(i); });
  if (wanted.direct) {
    append({"lightmap_", "_direct", "irradiance", "lx"}, [&](std::size_t i) {
      // What is not indirect: rounding must not make it negative.
      const Vec3 direct = light.irradiance(i) - light.reflected(i);
      return Vec3{std::max(direct.x, 0.0), std::max(direct.y, 0.0), std::max(direct.z, 0.0)};
    });
  }
  if (wanted.indirect) {
    append({"lightmap_", "_indirect", "irradiance", "lx"}, [&](std::size_t i) { return light.reflected(i); });
  }
  if (wanted.openness) {
    append({"lightmap_", "_ao", "openness", "1"}, [&](std::size_t i) { return Vec3{1, 1, 1} * light.openness(i); });
  }
  append_layer(surfaces, atlas, states, {"error_", "", "standard_error", "lx"}, false, std::move(standard_errors),
               layers);

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
