#include "server/radiosity/survey/surfaces.h"

#include <numbers>

#include "server/radiosity/survey/texture.h"

namespace radbake::radiosity {
namespace {

template <typename T>
T interpolated(const std::vector<T>& values, const std::array<std::uint32_t, 3>& vertices, const SurfacePoint& p) {
  return values[vertices[0]] * (1 - p.u - p.v) + values[vertices[1]] * p.u + values[vertices[2]] * p.v;
}

Vec3 textured(const Surfaces& surfaces, const SurfacePoint& p, Vec3 factor,
              const std::optional<TextureReference>& reference) {
  if (!reference) return factor;
  const Mesh& mesh = surfaces.mesh(p.triangle);
  const auto& texcoord = reference->texcoord == 0 ? mesh.texcoord0 : mesh.texcoord1;
  const Vec2 uv = interpolated(texcoord, surfaces.vertices(p.triangle), p);
  return scaled_by(factor,
                   sampled_texture(surfaces.scene->textures[reference->texture], reference->transform.apply(uv)));
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
  const Vec3 reflectance = textured(*this, p, own.reflectance, own.reflectance_texture);
  const std::vector<Vec3>& colors = mesh(p.triangle).colors;
  return colors.empty() ? reflectance : scaled_by(reflectance, interpolated(colors, vertices(p.triangle), p));
}

Vec3 Surfaces::exitance(const SurfacePoint& p) const {
  return effects.has(Effect::kTexturedEmission) ? exitance_in_detail(p) : exitances[p.triangle];
}

Vec3 Surfaces::exitance_in_detail(const SurfacePoint& p) const {
  const Material& own = material(p.triangle);
  return textured(*this, p, own.emissive, own.emissive_texture) * std::numbers::pi;
}

}  // namespace radbake::radiosity
