#include <algorithm>
#include <limits>
#include <set>

#include "server/radiosity/survey/facts.h"

namespace radbake::radiosity {
namespace {

/// Smallest and largest values by channel.
struct Range {
  Vec3 low{1, 1, 1}, high{1, 1, 1};
  double alpha_low = 1;
  bool is_grey = true;
};

Range range_of(const TexturePlane& texture) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Range range{{kInfinity, kInfinity, kInfinity}, {}, texture.channels == 4 ? kInfinity : 1, true};
  for (std::size_t at = 0; at < texture.values.size(); at += static_cast<std::size_t>(texture.channels)) {
    const float* texel = &texture.values[at];
    for (int c = 0; c < 3; ++c) {
      range.low[c] = std::min<double>(range.low[c], texel[c]);
      range.high[c] = std::max<double>(range.high[c], texel[c]);
    }
    if (texture.channels == 4) range.alpha_low = std::min<double>(range.alpha_low, texel[3]);
    range.is_grey &= texel[0] == texel[1] && texel[1] == texel[2];
  }
  return range;
}

/// Whether factor times texture is of one value: channels whose factor is zero do not count.
bool is_flat(Vec3 factor, const Range& range) { return scaled_by(factor, range.low) == scaled_by(factor, range.high); }

class MaterialFacts {
 public:
  MaterialFacts(const Surfaces& surfaces, Survey& survey) : scene_(*surfaces.scene), survey_(survey) {
    for (const TexturePlane& texture : scene_.textures) {
      ranges_.push_back(range_of(texture));
      survey.num_textures_flat += ranges_.back().low == ranges_.back().high;
    }
    survey.is_grey = true;
    survey.min_reflectance = 1;
    survey.max_reflectance = 0;
    std::vector<std::vector<std::uint32_t>> triangles(scene_.meshes.size());
    for (std::uint32_t t = 0; t < surfaces.size(); ++t) triangles[surfaces.meshes[t]].push_back(surfaces.in_mesh[t]);
    for (std::size_t m = 0; m < scene_.meshes.size(); ++m) {
      if (triangles[m].empty()) continue;
      used_.insert(scene_.meshes[m].material);
      add_mesh(scene_.meshes[m], triangles[m]);
    }
    for (const int material : used_) add_material(scene_.materials[static_cast<std::size_t>(material)]);
  }

  /// By material: masked or blended, and not opaque in fact.
  std::vector<bool> passes_by_alpha() const {
    std::vector<bool> passes;
    for (const Material& material : scene_.materials) {
      passes.push_back(material.alpha_mode != AlphaMode::kOpaque &&
                       !is_opaque_in_fact(material, range_of_use(material.reflectance_texture).alpha_low));
    }
    return passes;
  }

  /// By material: lets light through scattered.
  std::vector<bool> passes_scattered() const {
    std::vector<bool> passes;
    for (const Material& material : scene_.materials) {
      passes.push_back(is_translucent_in_fact(material, range_of_use(material.diffuse_transmittance_texture).high));
    }
    return passes;
  }

 private:
  const Range& range_of_use(const std::optional<TextureReference>& use) const {
    return use ? ranges_[static_cast<std::size_t>(use->texture)] : one_;
  }

  /// Reflectance of a mesh: factor times texture times colours.
  void add_mesh(const Mesh& mesh, const std::vector<std::uint32_t>& triangles) {
    const Material& material = scene_.materials[static_cast<std::size_t>(mesh.material)];
    const Range& base = range_of_use(material.reflectance_texture);
    Vec3 low = scaled_by(material.reflectance, base.low), high = scaled_by(material.reflectance, base.high);
    if (!mesh.colors.empty()) {
      Vec3 least{1, 1, 1}, most;
      bool is_flat_by_triangle = true;
      for (const std::uint32_t t : triangles) {
        const auto& vertices = mesh.triangles[t];
        for (const std::uint32_t vertex : vertices) {
          const Vec3 color = mesh.colors[vertex];
          for (int c = 0; c < 3; ++c) {
            least[c] = std::min(least[c], color[c]);
            most[c] = std::max(most[c], color[c]);
          }
          survey_.is_grey &= is_grey(color);
          is_flat_by_triangle &= color == mesh.colors[vertices[0]];
        }
      }
      low = scaled_by(low, least);
      high = scaled_by(high, most);
      ++survey_.varying_reflectance.num;
      survey_.varying_reflectance.num_flat += is_flat_by_triangle;
    }
    // What is sent on in all.
    high += scaled_by(material.diffuse_transmittance, range_of_use(material.diffuse_transmittance_texture).high);
    survey_.min_reflectance = std::min(survey_.min_reflectance, min_component(low));
    survey_.max_reflectance = std::max(survey_.max_reflectance, max_component(high));
  }

  void add_use(Vec3 factor, const std::optional<TextureReference>& use, VariationFacts& facts,
               std::set<std::pair<int, bool>>& seen) {
    survey_.is_grey &= is_grey(factor);
    if (!use || max_component(factor) <= 0) return;
    const Range& range = range_of_use(use);
    survey_.is_grey &= range.is_grey;
    // A texture counts once where it varies and once where it does not.
    if (!seen.insert({use->texture, is_flat(factor, range)}).second) return;
    ++facts.num;
    facts.num_flat += is_flat(factor, range);
  }

  void add_material(const Material& material) {
    // A sheet is textured by its reflectance texture even where it reflects nothing.
    add_use(material.reflectance + material.transmittance, material.reflectance_texture, survey_.varying_reflectance,
            reflectance_textures_);
    survey_.is_grey &= is_grey(material.reflectance) && is_grey(material.transmittance);
    add_use(material.diffuse_transmittance, material.diffuse_transmittance_texture, survey_.varying_reflectance,
            reflectance_textures_);
    add_use(material.emissive, material.emissive_texture, survey_.varying_emission, emission_textures_);
    survey_.num_emissive_materials += max_component(material.emissive) > 0;
    survey_.num_emissive_dark +=
        max_component(material.emissive) > 0 &&
        max_component(scaled_by(material.emissive, range_of_use(material.emissive_texture).high)) <= 0;
    if (material.alpha_mode == AlphaMode::kOpaque) return;
    ++survey_.num_alpha_materials;
    survey_.num_alpha_opaque += is_opaque_in_fact(material, range_of_use(material.reflectance_texture).alpha_low);
  }

  const Scene& scene_;
  Survey& survey_;
  const Range one_;
  std::vector<Range> ranges_;  // [textures]
  std::set<int> used_;
  std::set<std::pair<int, bool>> reflectance_textures_, emission_textures_;
};

}  // namespace

void find_material_facts(const Surfaces& surfaces, Survey& survey) {
  const MaterialFacts facts(surfaces, survey);
  const std::vector<bool> passes = facts.passes_by_alpha();
  const std::vector<bool> is_translucent = facts.passes_scattered();
  const double square_metres = surfaces.metres_per_unit * surfaces.metres_per_unit;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    const int index = surfaces.mesh(t).material;
    const Material& material = surfaces.scene->materials[static_cast<std::size_t>(index)];
    const double area = surfaces.areas[t] * square_metres;
    survey.area_masked_m2 += passes[static_cast<std::size_t>(index)] ? area : 0;
    survey.area_tinted_m2 += max_component(material.transmittance) > 0 ? area : 0;
    survey.area_translucent_m2 += is_translucent[static_cast<std::size_t>(index)] ? area : 0;
    survey.area_double_sided_m2 += material.is_double_sided ? area : 0;
    survey.area_specular_m2 += material.is_specular ? area : 0;
    survey.area_refractive_m2 += material.is_refractive ? area : 0;
    survey.area_normal_mapped_m2 += material.has_normal_map ? area : 0;
    survey.area_volume_m2 += material.has_volume ? area : 0;
  }
}

}  // namespace radbake::radiosity
