#include "client/gltf/scene_warnings.h"

#include <cstdio>
#include <functional>

#include "client/gltf/entry.h"

namespace radbake::gltf {
namespace {

std::string compact(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

}  // namespace

std::string some_of(const std::vector<std::string>& names) {
  constexpr std::size_t kShown = 3;
  std::string text;
  for (std::size_t i = 0; i < names.size() && i < kShown; ++i) text += (i == 0 ? "" : ", ") + in_quotes(names[i]);
  if (names.size() > kShown) text += " and " + std::to_string(names.size() - kShown) + " more";
  return text;
}

std::vector<Warning> scene_warnings(std::span<const Material> materials, std::span<const MaterialFacts> facts,
                                    const ReadCounts& counts, const std::vector<std::string>& ignored_extensions,
                                    const ReadOptions& options) {
  std::vector<Warning> warnings;
  const auto share = [&](double area_m2) {
    return " (" + compact(100 * area_m2 / counts.total_area_m2) + " % of the area)";
  };
  // One warning for all materials of which a fact holds on some of their area.
  const auto warn_areas = [&](const char* id, const std::string& text,
                              const std::function<double(std::size_t)>& area_of) {
    std::vector<std::string> names;
    double area_m2 = 0;
    for (std::size_t i = 0; i < materials.size(); ++i) {
      if (area_of(i) <= 0) continue;
      names.push_back(materials[i].name);
      area_m2 += area_of(i);
    }
    if (!names.empty()) warnings.push_back({id, text + ": material " + some_of(names) + share(area_m2)});
  };
  const auto warn = [&](const char* id, const std::string& text,
                        const std::function<bool(const MaterialFacts&)>& holds) {
    warn_areas(id, text, [&](std::size_t i) { return holds(facts[i]) ? counts.area_m2[i] : 0; });
  };
  const auto warn_count = [&](const char* id, std::uint64_t count, const std::string& text) {
    if (count > 0) warnings.push_back({id, std::to_string(count) + " " + text});
  };
  warn_areas("reflectance_limited", "reflectance limited to " + compact(options.max_reflectance),
             [&](std::size_t i) { return counts.limited_area_m2[i]; });
  warn("metallic_as_diffuse", "metal is baked as a diffuse surface of base colour x roughness^2 / 2",
       [](const MaterialFacts& f) { return f.is_metallic; });
  warn("transmission_texture_ignored", "textures of transmission are not followed: the factor holds everywhere",
       [](const MaterialFacts& f) { return f.has_transmission_texture; });
  warn("diffuse_transmission_texture_as_mean", "textures of the share of diffuse transmission count with their mean",
       [](const MaterialFacts& f) { return f.has_diffuse_transmission_texture; });
  warn("normal_map_not_simulated", "normal maps do not change the baked light",
       [](const MaterialFacts& f) { return f.has_normal_map; });
  warn("unlit", "unlit materials are baked as diffuse surfaces of their base colour",
       [](const MaterialFacts& f) { return f.is_unlit; });
  const auto warn_area = [&](const char* id, double area_m2, const std::string& text) {
    if (area_m2 > 0) warnings.push_back({id, text + share(area_m2)});
  };
  warn_area("vertex_colors_limited", counts.recolored_area_m2, "vertex colours outside 0 to 1 are limited to it");
  warn_area("vertex_alpha_not_simulated", counts.translucent_color_area_m2, "opacity of vertex colours is ignored");
  warn_area("morph_targets_not_simulated", counts.morphed_area_m2,
            "morph targets are ignored: baked in the base shape");
  warn_area("normals_replaced", counts.renormaled_area_m2,
            "normals of zero length or not finite are replaced by those of their triangles");
  if (!ignored_extensions.empty()) {
    warnings.push_back({"extensions_ignored", "extensions that are not read: " + some_of(ignored_extensions)});
  }
  warn_count("triangles_dropped", counts.num_triangles_dropped, "triangles of zero area dropped (0 % of the area)");
  warn_count("primitives_skipped", counts.num_points_and_lines,
             "primitives of points or lines skipped: they have no area");
  warn_count("primitives_skipped", counts.num_skinned, "skinned primitives skipped: what moves is not baked");
  return warnings;
}

}  // namespace radbake::gltf
