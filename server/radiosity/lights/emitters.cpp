#include "server/radiosity/lights/emitters.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

namespace radbake::radiosity {
namespace {

using Key = std::array<double, 3>;
using Edge = std::pair<Key, Key>;

Key key_of(Vec3 v) { return {v.x, v.y, v.z}; }
Edge edge_between(Vec3 a, Vec3 b) { return std::minmax(key_of(a), key_of(b)); }

/// A parallelogram deviates from a rectangle, and the corners of two triangles from a parallelogram, by rounding.
constexpr double kSquare = 1e-5;
/// Of the offset that lifts shadow rays off a surface.
constexpr double kFlat = 0.125;

Emitter emitter_of(const Surfaces& surfaces, std::uint32_t t) {
  const auto& c = surfaces.corners[t];
  const Material& own = surfaces.material(t);
  Emitter emitter;
  emitter.corner = c[0];
  emitter.s = c[1] - c[0];
  emitter.t = c[2] - c[0];
  emitter.normal = surfaces.normals[t];
  emitter.area = surfaces.areas[t];
  emitter.exitance = surfaces.exitances[t];
  emitter.lift = static_cast<float>(surfaces.ray_offsets[t]);
  emitter.is_two_sided = own.is_double_sided;
  emitter.is_see_through = surfaces.is_see_through(t);
  emitter.varies =
      emitter.is_see_through || (own.emissive_texture.has_value() && surfaces.effects.has(Effect::kTexturedEmission));
  emitter.triangles = {t, Emitter::kNone};
  return emitter;
}

/// The rectangle that two triangles make up, which share the edge between corners k + 1 and k + 2 of the first.
std::optional<Emitter> rectangle_of(const Surfaces& surfaces, std::uint32_t first, int k, std::uint32_t second) {
  if (surfaces.meshes[first] != surfaces.meshes[second]) return std::nullopt;
  if (!(surfaces.exitances[first] == surfaces.exitances[second])) return std::nullopt;
  const auto& c = surfaces.corners[first];
  const Vec3 corner = c[k], s = c[(k + 1) % 3] - corner, t = c[(k + 2) % 3] - corner, opposite = corner + s + t;
  const double limit = kFlat * std::min(surfaces.ray_offsets[first], surfaces.ray_offsets[second]);
  const auto& others = surfaces.corners[second];
  const bool has_opposite =
      std::any_of(others.begin(), others.end(), [&](Vec3 other) { return length(other - opposite) <= limit; });
  if (!has_opposite || dot(surfaces.normals[first], surfaces.normals[second]) <= 0) return std::nullopt;
  if (std::fabs(dot(s, t)) > kSquare * length(s) * length(t)) return std::nullopt;

  Emitter emitter = emitter_of(surfaces, first);
  emitter.corner = corner;
  emitter.s = s;
  emitter.t = t;
  emitter.area = surfaces.areas[first] + surfaces.areas[second];
  emitter.lift = static_cast<float>(std::max(surfaces.ray_offsets[first], surfaces.ray_offsets[second]));
  emitter.triangles = {first, second};
  return emitter;
}

}  // namespace

std::vector<Emitter> make_emitters(const Surfaces& surfaces) {
  std::vector<Emitter> emitters;
  // Emitters that are still one triangle, by their edges.
  std::map<Edge, std::size_t> open;
  for (std::uint32_t t = 0; t < surfaces.size(); ++t) {
    if (!surfaces.is_emitter[t]) continue;
    const auto& c = surfaces.corners[t];
    bool is_merged = false;
    for (int k = 0; k < 3 && !is_merged; ++k) {
      const auto at = open.find(edge_between(c[(k + 1) % 3], c[(k + 2) % 3]));
      if (at == open.end() || emitters[at->second].is_rectangle()) continue;
      const auto merged = rectangle_of(surfaces, t, k, emitters[at->second].triangles[0]);
      if (!merged) continue;
      emitters[at->second] = *merged;
      is_merged = true;
    }
    if (is_merged) continue;
    for (int k = 0; k < 3; ++k) open[edge_between(c[k], c[(k + 1) % 3])] = emitters.size();
    emitters.push_back(emitter_of(surfaces, t));
  }
  for (Emitter& emitter : emitters) emitter.power = emitter.area * max_component(emitter.exitance);
  return emitters;
}

SurfacePoint point_on(const Emitter& emitter, const Surfaces& surfaces, double a, double b) {
  if (!emitter.is_rectangle()) return {emitter.triangles[0], a, b};
  // The diagonal that both share runs from s to t: a + b < 1 is the first's half.
  const std::uint32_t t = emitter.triangles[a + b > 1];
  const Vec3 at = emitter.corner + emitter.s * a + emitter.t * b;
  const auto& c = surfaces.corners[t];
  const Vec3 e1 = c[1] - c[0], e2 = c[2] - c[0], n = cross(e1, e2), d = at - c[0];
  const double scale = 1 / dot(n, n);
  const double u = std::clamp(dot(cross(d, e2), n) * scale, 0.0, 1.0);
  return {t, u, std::clamp(dot(cross(e1, d), n) * scale, 0.0, 1.0 - u)};
}

}  // namespace radbake::radiosity
