#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/base/sequence.h"
#include "common/geometry/vector.h"
#include "common/scene/scene.h"
#include "server/radiosity/survey/effects.h"

namespace radbake::radiosity {

/// A place on a triangle: its index and the barycentric weights of its second and third corner.
struct SurfacePoint {
  std::uint32_t triangle = 0;
  double u = 0;
  double v = 0;
};

/// All triangles of a scene in one list, in the caller's order, without those of zero area.
///
/// Coordinates are the world's minus the centre of its bounding box, times a power of two that brings the longest side
/// into [1, 2): single precision then serves a scene of any unit anywhere, and a scene scaled by a power of two gives
/// the same numbers.
/// Shapes: all arrays [size()].
/// Units:  lengths in scene units; metres = units * metres_per_unit.
class Surfaces {
 public:
  const Scene* scene = nullptr;
  EffectSet effects = EffectSet::all();
  // As they are simulated: what an effect that is off would do is taken out.
  std::vector<Material> materials;
  std::vector<Light> lights;
  Vec3 sky;                                   ///< luminance, nit
  const TexturePlane* environment = nullptr;  ///< null: none
  Vec3 centre;
  double metres_per_unit = 1;

  std::vector<std::array<Vec3, 3>> corners;
  std::vector<Vec3> normals;             ///< geometric, unit length, on the front side
  std::vector<double> areas;             ///< scene units squared
  std::vector<std::uint32_t> meshes;     ///< index into scene->meshes
  std::vector<std::uint32_t> in_mesh;    ///< index into its mesh's triangles
  std::vector<double> ray_offsets;       ///< how far ray origins are lifted off the surface
  std::vector<Vec3> exitances;           ///< E = pi L, mean over the triangle, lx
  std::vector<std::uint8_t> is_emitter;  ///< small and bright: lights by sampling, E_out of the rows
  // Where Effect::kTexturedReflectance is off, else empty.
  std::vector<Vec3> mean_reflectances, mean_diffuse_transmittances;

  std::size_t size() const { return corners.size(); }
  const Mesh& mesh(std::uint32_t triangle) const { return scene->meshes[meshes[triangle]]; }
  const std::array<std::uint32_t, 3>& vertices(std::uint32_t triangle) const {
    return mesh(triangle).triangles[in_mesh[triangle]];
  }
  const Material& material(std::uint32_t triangle) const { return materials[mesh(triangle).material]; }

  Vec3 position(const SurfacePoint& p) const {
    const auto& c = corners[p.triangle];
    return c[0] * (1 - p.u - p.v) + c[1] * p.u + c[2] * p.v;
  }
  /// Interpolated NORMAL, unit length, or the geometric one where the mesh has none or it points away.
  Vec3 shading_normal(const SurfacePoint& p) const;
  /// NORMAL at a corner (0..2), unit length, or the geometric one where the mesh has none.
  Vec3 corner_normal(std::uint32_t triangle, int corner) const;
  /// Leaves out what an effect that is not in the set would do, and finds the emitters among what is left.
  void simulate(const EffectSet& set);
  /// Whether light passes any part of a triangle: it is masked, blended or a tinted sheet.
  bool is_see_through(std::uint32_t triangle) const {
    const Material& own = material(triangle);
    return own.alpha_mode != AlphaMode::kOpaque || max_component(own.transmittance) > 0;
  }
  /// Share of the light that stops there, by channel: coverage (1 or 0 of a mask, alpha of a blend) times
  /// (1 - transmittance). Of the surface, that share reflects and emits.
  Vec3 opacity(const SurfacePoint& p) const;
  /// Whether a tinted sheet stops channels by different shares.
  bool has_coloured_tint() const;
  /// Reflectance of what is opaque there: factor times texture times the vertices' colours over 1 - transmittance, each
  /// channel in [0, 1).
  Vec3 reflectance(const SurfacePoint& p) const;
  /// Whether light goes through scattered: a leaf, a curtain.
  bool is_translucent(std::uint32_t triangle) const {
    return max_component(material(triangle).diffuse_transmittance) > 0;
  }
  /// Share of the light on the other side of what is opaque there that leaves this one, scattered.
  Vec3 diffuse_transmittance(const SurfacePoint& p) const;
  /// Exitance there: pi times factor times texture, lx.
  Vec3 exitance(const SurfacePoint& p) const;

 private:
  Vec3 exitance_in_detail(const SurfacePoint& p) const;
  void find_emitters(const SobolPoints& points);
};

}  // namespace radbake::radiosity
