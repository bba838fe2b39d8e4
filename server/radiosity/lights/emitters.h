#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/radiosity/survey/surfaces.h"

namespace radbake::radiosity {

/// A piece of a small bright surface that is sampled as one: a triangle, or a rectangle of two.
///
/// Points of it: corner + a s + b t, a and b in 0..1 (of a triangle a + b <= 1). Shapes: s and t are orthogonal in a
/// rectangle. Units: scene units, lx.
struct Emitter {
  static constexpr std::uint32_t kNone = 0xffffffffu;

  Vec3 corner, s, t;
  Vec3 normal;  ///< on the front side, unit length
  double area = 0;
  Vec3 exitance;     ///< mean over the emitter
  double power = 0;  ///< area times exitance, largest of the channels
  float lift = 0;    ///< how far the ends of shadow rays are lifted off it
  bool is_two_sided = false;
  bool varies = false;  ///< exitance or opacity have to be looked up at each point
  bool is_see_through = false;
  std::array<std::uint32_t, 2> triangles = {kNone, kNone};  ///< the second: of a rectangle

  bool is_rectangle() const { return triangles[1] != kNone; }
};

/// All emitters of a scene: its emitter triangles, those merged that make up a rectangle of one mesh and exitance.
std::vector<Emitter> make_emitters(const Surfaces& surfaces);

/// The place of (a, b) in the emitter's triangles.
SurfacePoint point_on(const Emitter& emitter, const Surfaces& surfaces, double a, double b);

}  // namespace radbake::radiosity
