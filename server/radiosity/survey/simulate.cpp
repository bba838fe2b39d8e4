#include <algorithm>

#include "common/base/sequence.h"
#include "server/radiosity/survey/facts.h"
#include "server/radiosity/survey/surfaces.h"
#include "server/radiosity/survey/survey.h"
#include "server/radiosity/survey/texture.h"

namespace radbake::radiosity {
namespace {

/// Points that a textured triangle's means are taken over.
constexpr int kMeanSamples = 64;

/// Calls visit(point) for a net of points over a triangle.
template <typename Visit>
void over_triangle(std::uint32_t triangle, const SobolPoints& points, const Visit& visit) {
  const auto seeds = SobolPoints::seeds_of(triangle);
  for (int i = 0; i < points.size(); ++i) {
    double u = points.coordinate(i, 0, seeds), v = points.coordinate(i, 1, seeds);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    visit(SurfacePoint{triangle, u, v});
  }
}

/// Mean of a property over a triangle. Equal values give themselves, to the last bit.
template <typename Property>
Vec3 mean_over(std::uint32_t triangle, const SobolPoints& points, const Property& property) {
  const Vec3 first = property({triangle, 0, 0});
  Vec3 excess;
  over_triangle(triangle, points, [&](const SurfacePoint& p) { excess += property(p) - first; });
  return first + excess / points.size();
}

bool is_simulated(const Light& light, const EffectSet& set) {
  if (std::holds_alternative<PointLight>(light.kind)) return set.has(Effect::kPoint);
  if (std::holds_alternative<SpotLight>(light.kind)) return set.has(Effect::kSpot);
  if (std::holds_alternative<ProfileLight>(light.kind)) return set.has(Effect::kIes);
  return set.has(std::get<DirectionalLight>(light.kind).angular_diameter_radians > 0 ? Effect::kSun
                                                                                     : Effect::kDirectional);
}

/// What is opaque in fact is simulated as that, whatever else is masked.
bool stops_all(const Material& material, const Scene& scene) {
  const auto& texture = material.reflectance_texture;
  return material.alpha_mode != AlphaMode::kOpaque &&
         is_opaque_in_fact(material, texture ? least_opacity(scene.textures[texture->texture]) : 1);
}

}  // namespace

void Surfaces::simulate(const EffectSet& set) {
  effects = set;
  materials = scene->materials;
  for (Material& material : materials) {
    if (!set.has(Effect::kEmitters)) material.emissive = {};
    if (!set.has(Effect::kAlphaMask) || stops_all(material, *scene)) material.alpha_mode = AlphaMode::kOpaque;
    if (!set.has(Effect::kTint)) material.transmittance = {};
    // Through what has no back nothing comes.
    if (!set.has(Effect::kDiffuseTransmission) || !set.has(Effect::kTwoSided) ||
        !is_translucent_in_fact(material, brightest(*scene, material.diffuse_transmittance_texture))) {
      material.diffuse_transmittance = {};
    }
    if (!set.has(Effect::kTwoSided)) material.is_double_sided = false;
  }
  lights.clear();
  for (const Light& light : scene->lights) {
    if (is_simulated(light, set)) lights.push_back(light);
  }
  sky = set.has(Effect::kSky) ? scene->sky : Vec3{};
  environment = scene->environment && set.has(Effect::kHdri) ? &*scene->environment : nullptr;

  const SobolPoints points(kMeanSamples);
  mean_reflectances.clear();
  mean_diffuse_transmittances.clear();
  if (!set.has(Effect::kTexturedReflectance)) {
    std::vector<Vec3> means(size()), through(size());
    for (std::uint32_t t = 0; t < size(); ++t) {
      const bool varies = material(t).reflectance_texture || !mesh(t).colors.empty();
      const auto reflectance_at = [this](const SurfacePoint& p) { return reflectance(p); };
      means[t] = varies ? mean_over(t, points, reflectance_at) : reflectance({t, 0, 0});
      const auto through_at = [this](const SurfacePoint& p) { return diffuse_transmittance(p); };
      // What passes a tinted sheet straight is textured as its reflectance, and leaves the rest.
      const bool rest_varies = material(t).reflectance_texture && max_component(material(t).transmittance) > 0;
      through[t] = material(t).diffuse_transmittance_texture || rest_varies ? mean_over(t, points, through_at)
                                                                            : through_at({t, 0, 0});
    }
    mean_reflectances = std::move(means);
    mean_diffuse_transmittances = std::move(through);
  }
  find_emitters(points);
}

void Surfaces::find_emitters(const SobolPoints& points) {
  double area = 0, flux = 0;
  exitances.assign(size(), {});
  is_emitter.assign(size(), 0);
  for (std::uint32_t t = 0; t < size(); ++t) {
    const Material& own = material(t);
    // As the file says, so that the same surfaces are emitters where backs are not simulated.
    const int sides = scene->materials[mesh(t).material].is_double_sided ? 2 : 1;
    area += areas[t] * sides;
    if (max_component(own.emissive) <= 0) continue;
    const auto exitance_at = [this](const SurfacePoint& p) { return exitance_in_detail(p); };
    exitances[t] = own.emissive_texture ? mean_over(t, points, exitance_at) : exitance_at({t, 0, 0});
    flux += areas[t] * sides * max_component(exitances[t]);
  }
  const double threshold = area > 0 ? kEmitterThreshold * flux / area : 0;
  for (std::uint32_t t = 0; t < size(); ++t) {
    const double exitance = max_component(exitances[t]);
    is_emitter[t] = exitance > 0 && exitance > threshold;
  }
}

}  // namespace radbake::radiosity
