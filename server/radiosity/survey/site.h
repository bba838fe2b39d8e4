#pragma once

#include <array>

#include "common/geometry/vector.h"
#include "server/radiosity/survey/surfaces.h"

namespace radbake::radiosity {

/// A point that receives light, one of several that stand for a patch or a texel.
struct Site {
  SurfacePoint point;
  Vec3 position;  ///< on the surface, scene units
  Vec3 facing;    ///< geometric normal on the receiving side, unit length
  Vec3 normal;    ///< that irradiance is measured about, unit length; within 90 degrees of facing
};

/// A site at a point of a surface: its front, or the back about the geometric normal.
inline Site front_site(const Surfaces& surfaces, const SurfacePoint& p, Vec3 normal) {
  return {p, surfaces.position(p), surfaces.normals[p.triangle], normal};
}
/// The same about the interpolated normal.
inline Site front_site(const Surfaces& surfaces, const SurfacePoint& p) {
  return front_site(surfaces, p, surfaces.shading_normal(p));
}
inline Site side_site(const Surfaces& surfaces, const SurfacePoint& p, Vec3 facing) {
  return {p, surfaces.position(p), facing, facing};
}

/// Where rays from a point of a surface start: lifted off it by more than single precision moves it.
inline std::array<float, 3> lifted_origin(const Surfaces& surfaces, Vec3 position, Vec3 facing,
                                          std::uint32_t triangle) {
  const Vec3 p = position + facing * surfaces.ray_offsets[triangle];
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

}  // namespace radbake::radiosity
