#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/radiosity/lights/emitters.h"
#include "server/radiosity/survey/site.h"
#include "server/radiosity/visibility/visibility.h"

// The arrays that light is sampled in: one column a coordinate, so that compilers make vector code of loops over them.
// In single precision, about the receiver's middle: distances keep their digits however near a light is. What tells one
// side of a plane from the other is computed in double before.

namespace radbake::radiosity {

/// Loops over columns run to a multiple of this: what lies beyond the end is computed and not looked at.
inline constexpr std::size_t kLanes = 16;
inline std::size_t whole_lanes(std::size_t n) { return (n + kLanes - 1) / kLanes * kLanes; }

/// Three columns of one length. Room is only ever added.
struct Vec3Columns {
  std::vector<float> x, y, z;
  void make_room(std::size_t n) {
    if (x.size() >= n) return;
    x.resize(n), y.resize(n), z.resize(n);
  }
  void set(std::size_t k, Vec3 v) {
    x[k] = static_cast<float>(v.x), y[k] = static_cast<float>(v.y), z[k] = static_cast<float>(v.z);
  }
  void set(std::size_t k, float vx, float vy, float vz) { x[k] = vx, y[k] = vy, z[k] = vz; }
};

/// The sites of a receiver that count.
struct ReceiverColumns {
  std::size_t size = 0;
  Vec3 middle;           ///< scene units; positions are about it
  float radius = 0;      ///< of the sites about it
  float lowest = 0;      ///< least dot(facing, position) of the sites, where is_flat
  bool is_flat = false;  ///< all sites have the first one's facing and normal
  Vec3 facing, normal;   ///< of the first site where flat, else the directions of their sums
  Vec3Columns position, facings, normals;
  std::vector<float> lift;                   ///< of shadow rays along the facing
  std::vector<float> scale;                  ///< 1 / share of the lobe above the surface
  std::vector<std::array<float, 3>> origin;  ///< of shadow rays

  /// Takes the sites at `open`.
  void fill(std::span<const Site> sites, std::span<const std::uint32_t> open, const Surfaces& surfaces);

 private:
  /// Where all sites lie on one triangle and have one normal.
  void fill_plain(std::span<const Site> sites, std::span<const std::uint32_t> open, const Surfaces& surfaces);
  void fill_any(std::span<const Site> sites, std::span<const std::uint32_t> open, const Surfaces& surfaces);
};

/// What does not depend on the receiver. Shapes: [emitters, to whole lanes]; beyond the end stands the first emitter.
struct EmitterColumns {
  explicit EmitterColumns(std::span<const Emitter> emitters);

  std::size_t size;

  std::vector<double> corner_x, corner_y, corner_z, normal_x, normal_y, normal_z;
  Vec3Columns s, t, normal;
  std::vector<float> area;
  std::vector<float> exitance;  ///< largest of the channels, over that of the brightest emitter
  std::vector<float> lift;
  std::vector<std::int32_t> is_rectangle, is_two_sided;
};

/// Emitters as one receiver sees them. Shapes: [slots, to whole lanes].
struct SeenEmitters {
  Vec3Columns corner;                     ///< about the receiver's middle
  std::vector<float> height;              ///< of the middle over the emitter's plane
  std::vector<float> w00, w10, w01, w11;  ///< likely contribution of the corners of the unit square, > 0
  std::vector<float> importance;          ///< likely irradiance, unoccluded; 0: certainly none
  std::vector<std::int32_t> is_near;      ///< to be sampled by solid angle
  void make_room(std::size_t n);
};

/// One sample each. Shapes: [samples, to whole lanes].
struct SampleColumns {
  std::vector<float> x, y;
  std::vector<std::uint32_t> z;
  std::vector<std::int32_t> site, emitter, slot;
  std::vector<float> per_probability;  ///< 1 / (probability of the emitter x samples of its replicate)
  Vec3Columns direction;               ///< from the ray's origin to its end
  std::vector<float> weight;           ///< irradiance a unit of exitance; 0: nothing arrives
  std::vector<float> a, b;             ///< the place on the emitter
  void make_room(std::size_t n);
  /// Makes what lies beyond the first n, to whole lanes, samples of the first site, emitter and slot.
  void pad(std::size_t n);
};

/// Shadow rays and what each brings if nothing blocks it. Room is only ever added.
struct SegmentBuffer {
  std::size_t size = 0;
  std::vector<Ray> rays;
  std::vector<Vec3> contributions;  ///< lx
  std::vector<std::uint32_t> replicate_of;

  /// For `more` segments beyond those held.
  void make_room(std::size_t more) {
    if (rays.size() >= size + more) return;
    rays.resize(2 * (size + more));
    contributions.resize(rays.size());
    replicate_of.resize(rays.size());
  }
  /// Precondition: there is room. A segment that is not kept is written over by the next.
  void put(const Ray& ray, Vec3 contribution, std::size_t replicate, bool is_kept) {
    rays[size] = ray;
    contributions[size] = contribution;
    replicate_of[size] = static_cast<std::uint32_t>(replicate);
    size += is_kept;
  }
  void add(const Ray& ray, Vec3 contribution, std::size_t replicate) {
    make_room(1);
    put(ray, contribution, replicate, true);
  }
};

/// Weighs all emitters, or the first n of a list, one a slot. Shapes: list [n, to whole lanes].
///
///   g(q) = max(cos, k) max(cos', k') / r^2 of the corners q;  importance = E min(pi, A mean(g) + min(A, r_c^2) g(q_c))
///
/// with q_c the point nearest to the middle of the receiver: where an emitter is near, its corners say little. The
/// least cosines keep an importance from 0 wherever any site may receive light.
void weigh_emitters(const EmitterColumns& emitters, const ReceiverColumns& receiver, SeenEmitters& seen);
void weigh_emitters(const EmitterColumns& emitters, const std::vector<std::int32_t>& list, std::size_t n,
                    const ReceiverColumns& receiver, SeenEmitters& seen);

/// Places n samples, padded to whole lanes, on their emitters by area, the density of a rectangle's points bilinear in
/// the corners' weights, and finds what they bring: weight = cos cos' A / (pi r^2 density) per_probability. Source:
/// Hart et al. 2020, "Practical product sampling by fitting and composing warps" (bilinear warps).
void place_samples(const EmitterColumns& emitters, const SeenEmitters& seen, const ReceiverColumns& receiver,
                   std::size_t n, SampleColumns& samples);

}  // namespace radbake::radiosity
