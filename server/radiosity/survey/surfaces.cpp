#include "server/radiosity/survey/surfaces.h"

#include <algorithm>
#include <numbers>

#include "server/radiosity/survey/facts.h"
#include "server/radiosity/survey/texture.h"

namespace radbake::radiosity {
namespace {

/// Equal values give that value itself, to the last bit.
template <typename T>
T interpolated(const std::vector<T>& values, const std::array<std::uint32_t, 3>& vertices, const SurfacePoint& p) {
  const T first = values[vertices[0]];
  return first + (values[vertices[1]] - first) * p.u + (values[vertices[2]] - first) * p.v;
}

Vec2 texture_coordinate(const Surfaces& surfaces, const SurfacePoint& p, const TextureReference& reference) {
  const Mesh& mesh = surfaces.mesh(p.triangle);
  const auto& texcoord = reference.texcoord == 0 ? mesh.texcoord0 : mesh.texcoord1;
  return reference.transform.apply(interpolated(texcoord, surfaces.vertices(p.triangle), p));
}

Vec3 textured(const Surfaces& surfaces, const SurfacePoint& p, Vec3 factor,
              const std::optional<TextureReference>& reference) {
  if (!reference) return factor;
  return scaled_by(factor, sampled_texture(surfaces.scene->textures[reference->texture],
                                           texture_coordinate(surfaces, p, *reference)));
}

/// Mean of the channels in each; (x, x, x) stays itself, to the last bit.
Vec3 in_grey(Vec3 v) { return Vec3{1, 1, 1} * (v.x + ((v.y - v.x) + (v.z - v.x)) / 3); }

/// What a sheet passes there: where no colour is simulated, one share for all channels, as they share their rays.
Vec3 passed_share(const Surfaces& surfaces, const SurfacePoint& p) {
  const Material& own = surfaces.material(p.triangle);
  const Vec3 passed = textured(surfaces, p, own.transmittance, own.reflectance_texture);
  return surfaces.effects.has(Effect::kColor) ? passed : in_grey(passed);
}

}  // namespace

Vec3 Surfaces::shading_normal(const SurfacePoint& p) const {
  const Vec3 geometric = normals[p.triangle];
  const Mesh& own = mesh(p.triangle);
  if (own.normals.empty()) return geometric;
  const Vec3 normal = interpolated(own.normals, vertices(p.triangle), p);
  const double size = length(normal);
  if (size <= 0 || dot(normal, geometric) <= 0) return geometric;
  return normal / size;
}

Vec3 Surfaces::corner_normal(std::uint32_t triangle, int corner) const {
  const Mesh& own = mesh(triangle);
  if (own.normals.empty()) return normals[triangle];
  const Vec3 normal = own.normals[vertices(triangle)[corner]];
  return length(normal) > 0 ? normalized(normal) : normals[triangle];
}

Vec3 Surfaces::reflectance(const SurfacePoint& p) const {
  if (!mean_reflectances.empty()) return mean_reflectances[p.triangle];
  const Material& own = material(p.triangle);
  Vec3 reflectance = textured(*this, p, own.reflectance, own.reflectance_texture);
  const std::vector<Vec3>& colors = mesh(p.triangle).colors;
  if (!colors.empty()) reflectance = scaled_by(reflectance, interpolated(colors, vertices(p.triangle), p));
  if (max_component(own.transmittance) <= 0) return reflectance;
  const Vec3 passed = passed_share(*this, p);
  // By channel reflectance + passed <= 1: so are their means.
  if (!effects.has(Effect::kColor)) reflectance = in_grey(reflectance);
  for (int c = 0; c < 3; ++c) reflectance[c] = passed[c] < 1 ? reflectance[c] / (1 - passed[c]) : 0;
  return reflectance;
}

Vec3 Surfaces::diffuse_transmittance(const SurfacePoint& p) const {
  if (!mean_diffuse_transmittances.empty()) return mean_diffuse_transmittances[p.triangle];
  const Material& own = material(p.triangle);
  if (max_component(own.diffuse_transmittance) <= 0) return {};
  Vec3 through = textured(*this, p, own.diffuse_transmittance, own.diffuse_transmittance_texture);
  if (max_component(own.transmittance) <= 0) return through;
  const Vec3 passed = passed_share(*this, p);
  if (!effects.has(Effect::kColor)) through = in_grey(through);
  for (int c = 0; c < 3; ++c) through[c] = passed[c] < 1 ? through[c] / (1 - passed[c]) : 0;
  return through;
}

Vec3 Surfaces::opacity(const SurfacePoint& p) const {
  const Material& own = material(p.triangle);
  double coverage = 1;
  if (own.alpha_mode != AlphaMode::kOpaque) {
    coverage = own.alpha;
    if (own.reflectance_texture) {
      coverage *= sampled_opacity(scene->textures[own.reflectance_texture->texture],
                                  texture_coordinate(*this, p, *own.reflectance_texture));
    }
    coverage =
        own.alpha_mode == AlphaMode::kMask ? (coverage >= own.alpha_cutoff ? 1.0 : 0.0) : std::min(coverage, 1.0);
  }
  if (max_component(own.transmittance) <= 0) return Vec3{1, 1, 1} * coverage;
  return (Vec3{1, 1, 1} - passed_share(*this, p)) * coverage;
}

bool Surfaces::has_coloured_tint() const {
  if (!effects.has(Effect::kColor)) return false;
  std::vector<std::uint8_t> is_used(materials.size(), 0);
  for (const Mesh& mesh : scene->meshes) is_used[mesh.material] = 1;
  for (std::size_t m = 0; m < materials.size(); ++m) {
    const Material& own = materials[m];
    if (!is_used[m] || max_component(own.transmittance) <= 0) continue;
    if (!is_grey(own.transmittance)) return true;
    if (!own.reflectance_texture) continue;
    const TexturePlane& texture = scene->textures[own.reflectance_texture->texture];
    for (std::size_t at = 0; at < texture.values.size(); at += static_cast<std::size_t>(texture.channels)) {
      if (!is_grey({texture.values[at], texture.values[at + 1], texture.values[at + 2]})) return true;
    }
  }
  return false;
}

Vec3 Surfaces::exitance(const SurfacePoint& p) const {
  return effects.has(Effect::kTexturedEmission) ? exitance_in_detail(p) : exitances[p.triangle];
}

Vec3 Surfaces::exitance_in_detail(const SurfacePoint& p) const {
  const Material& own = material(p.triangle);
  return textured(*this, p, own.emissive, own.emissive_texture) * std::numbers::pi;
}

}  // namespace radbake::radiosity
