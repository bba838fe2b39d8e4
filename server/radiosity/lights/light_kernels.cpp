// The loops of light_columns.h, compiled so that they become vector code.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "server/radiosity/lights/light_columns.h"
#include "server/radiosity/lights/vector_clones.h"

#define RADBAKE_INLINE [[gnu::always_inline]] inline

namespace radbake::radiosity {
namespace {

constexpr float kPi = static_cast<float>(std::numbers::pi);
/// Least cosines that likely contributions are weighed with: at a receiver of one normal, of several, and at an
/// emitter.
constexpr float kLeastCosine = 0.05f, kLeastCosineOfSeveral = 0.3f, kLeastEmitterCosine = 0.05f;
/// Least weight of a corner beside the largest: what bounds the weight of a sample.
constexpr float kLeastCorner = 0.1f;
/// An emitter whose area is more than this times the squared distance to its nearest point is sampled by solid angle.
constexpr float kNear = 2.0f;
constexpr float kLeastSquaredDistance = 1e-14f;

struct Float3 {
  float x, y, z;
};
RADBAKE_INLINE Float3 operator+(Float3 a, Float3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
RADBAKE_INLINE Float3 operator-(Float3 a, Float3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
RADBAKE_INLINE Float3 operator*(Float3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
RADBAKE_INLINE float dot(Float3 a, Float3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
RADBAKE_INLINE float least(float a, float b) { return a < b ? a : b; }
RADBAKE_INLINE float most(float a, float b) { return a > b ? a : b; }
RADBAKE_INLINE float between_0_and_1(float v) { return least(most(v, 0.0f), 1.0f); }
RADBAKE_INLINE float at(const std::vector<float>& column, std::int32_t k) { return column.data()[k]; }
RADBAKE_INLINE std::int32_t at(const std::vector<std::int32_t>& column, std::int32_t k) { return column.data()[k]; }
RADBAKE_INLINE double at(const std::vector<double>& column, std::int32_t k) { return column.data()[k]; }
RADBAKE_INLINE Float3 at(const Vec3Columns& columns, std::int32_t k) {
  return {at(columns.x, k), at(columns.y, k), at(columns.z, k)};
}
Float3 to_float(Vec3 v) { return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)}; }

/// What all slots are weighed with.
struct Weighing {
  Float3 facing, normal;
  float least_cosine, least_squared, radius, lowest;
  bool is_flat;
};

RADBAKE_INLINE float geometry(Float3 q, float height, const Weighing& weighing) {
  const float squared = most(dot(q, q), weighing.least_squared), per_distance = 1 / std::sqrt(squared);
  const float receiving = most(dot(q, weighing.normal) * per_distance, weighing.least_cosine);
  const float sending = most(height * per_distance, kLeastEmitterCosine);
  return receiving * sending / squared;
}

RADBAKE_INLINE void weigh(const EmitterColumns& emitters, std::int32_t e, Vec3 middle, const Weighing& weighing,
                          SeenEmitters& seen, std::int32_t slot) {
  const double x = at(emitters.corner_x, e) - middle.x, y = at(emitters.corner_y, e) - middle.y,
               z = at(emitters.corner_z, e) - middle.z;
  const auto signed_height =
      static_cast<float>(-(x * at(emitters.normal_x, e) + y * at(emitters.normal_y, e) + z * at(emitters.normal_z, e)));
  const Float3 c{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  const Float3 s = at(emitters.s, e), t = at(emitters.t, e);
  const bool is_rectangle = at(emitters.is_rectangle, e) != 0, is_two_sided = at(emitters.is_two_sided, e) != 0;
  const float height = is_two_sided ? std::fabs(signed_height) : most(signed_height, 0.0f);

  // The unit square's corners: a triangle's first corner is two of them.
  const Float3 q10 = c + s, q_t = c + t, q_st = q10 + t;
  const Float3 q11{is_rectangle ? q_st.x : q_t.x, is_rectangle ? q_st.y : q_t.y, is_rectangle ? q_st.z : q_t.z};
  const Float3 q01{is_rectangle ? q_t.x : c.x, is_rectangle ? q_t.y : c.y, is_rectangle ? q_t.z : c.z};
  const float g00 = geometry(c, height, weighing), g10 = geometry(q10, height, weighing);
  const float g01 = geometry(q01, height, weighing), g11 = geometry(q11, height, weighing);
  const float largest = most(most(g00, g10), most(g01, g11));

  // The nearest point, of a triangle nearly.
  const float a = between_0_and_1(-dot(c, s) / dot(s, s)), b = between_0_and_1(-dot(c, t) / dot(t, t));
  const float over = is_rectangle ? 0.0f : 0.5f * most(a + b - 1, 0.0f);
  const Float3 nearest = c + s * most(a - over, 0.0f) + t * most(b - over, 0.0f);
  const float squared = most(dot(nearest, nearest), weighing.least_squared);
  const float area = at(emitters.area, e);
  const float form_factor =
      least(0.25f * area * (g00 + g10 + g01 + g11) + least(area, squared) * geometry(nearest, height, weighing), kPi);

  // Nothing arrives from below every site's horizon, or from the back of what is single-sided.
  const float top = most(most(dot(c, weighing.facing), dot(q10, weighing.facing)),
                         most(dot(q01, weighing.facing), dot(q11, weighing.facing)));
  const bool is_under = weighing.is_flat & (top <= weighing.lowest);
  const bool is_behind = !is_two_sided & (signed_height <= -weighing.radius);

  seen.corner.x.data()[slot] = c.x;
  seen.corner.y.data()[slot] = c.y;
  seen.corner.z.data()[slot] = c.z;
  seen.height.data()[slot] = signed_height;
  const float floor = kLeastCorner * largest;
  seen.w00.data()[slot] = most(g00, floor);
  seen.w10.data()[slot] = most(g10, floor);
  seen.w01.data()[slot] = most(g01, floor);
  seen.w11.data()[slot] = most(g11, floor);
  const float importance = at(emitters.exitance, e) * form_factor;
  seen.importance.data()[slot] = is_under | is_behind ? 0.0f : importance;
  seen.is_near.data()[slot] = area > kNear * squared;
}

Weighing weighing_of(const ReceiverColumns& receiver) {
  return {to_float(receiver.facing),
          to_float(receiver.normal),
          receiver.is_flat ? kLeastCosine : kLeastCosineOfSeveral,
          std::max(receiver.radius * receiver.radius, kLeastSquaredDistance),
          receiver.radius,
          receiver.lowest,
          receiver.is_flat};
}

RADBAKE_VECTOR_CLONES
void weigh_all(const EmitterColumns& emitters, std::int32_t n, Vec3 middle, const Weighing& weighing,
               SeenEmitters& seen) {
#pragma GCC ivdep
  for (std::int32_t e = 0; e < n; ++e) weigh(emitters, e, middle, weighing, seen, e);
}

RADBAKE_VECTOR_CLONES
void weigh_listed(const EmitterColumns& emitters, const std::int32_t* list, std::int32_t n, Vec3 middle,
                  const Weighing& weighing, SeenEmitters& seen) {
#pragma GCC ivdep
  for (std::int32_t k = 0; k < n; ++k) weigh(emitters, list[k], middle, weighing, seen, k);
}

/// For a uniform u, a number in [0, 1] of density proportional to (1 - v) a + v b.
RADBAKE_INLINE float linear(float u, float a, float b) {
  return least(u * (a + b) / (a + std::sqrt((1 - u) * a * a + u * b * b)), 1.0f);
}

struct Receiver {
  Float3 facing, normal;
};

template <bool kIsFlat>
RADBAKE_INLINE void place(const EmitterColumns& emitters, const SeenEmitters& seen, const ReceiverColumns& receiver,
                          Receiver first, std::int32_t k, std::int32_t e, std::int32_t slot, SampleColumns& samples) {
  const std::int32_t site = at(samples.site, k);
  // Warp the square to the corners' weights.
  const float w00 = at(seen.w00, slot), w10 = at(seen.w10, slot), w01 = at(seen.w01, slot), w11 = at(seen.w11, slot);
  const float y = linear(at(samples.y, k), w00 + w10, w01 + w11);
  const float low = w00 + (w01 - w00) * y, high = w10 + (w11 - w10) * y;
  const float x = linear(at(samples.x, k), low, high);
  const float per_density = 0.25f * (w00 + w10 + w01 + w11) / (low + (high - low) * x);
  // To the rectangle as it is, or on to the triangle.
  const bool is_rectangle = at(emitters.is_rectangle, e) != 0;
  const float root = std::sqrt(x);
  const float a = is_rectangle ? x : root * (1 - y), b = is_rectangle ? y : root * y;

  const Float3 p = at(receiver.position, site);
  const Float3 normal = kIsFlat ? first.normal : at(receiver.normals, site);
  const Float3 facing = kIsFlat ? first.facing : at(receiver.facings, site);
  const Float3 d = at(seen.corner, slot) + at(emitters.s, e) * a + at(emitters.t, e) * b - p;
  const Float3 source_normal = at(emitters.normal, e);
  const float height = at(seen.height, slot) + dot(source_normal, p);
  const float sending = at(emitters.is_two_sided, e) != 0 ? std::fabs(height) : height;
  const float receiving = dot(d, normal), squared = dot(d, d);
  const float weight = at(receiver.scale, site) * receiving * sending * at(emitters.area, e) * per_density *
                       at(samples.per_probability, k) / (kPi * squared * squared);
  const bool arrives = (receiving > 0) & (sending > 0) & (dot(d, facing) > 0) & (squared > kLeastSquaredDistance);
  samples.weight.data()[k] = arrives ? weight : 0.0f;
  samples.a.data()[k] = a;
  samples.b.data()[k] = b;
  const float lift = height < 0 ? -at(emitters.lift, e) : at(emitters.lift, e);
  const Float3 segment = d + source_normal * lift - facing * at(receiver.lift, site);
  samples.direction.x.data()[k] = segment.x;
  samples.direction.y.data()[k] = segment.y;
  samples.direction.z.data()[k] = segment.z;
}

RADBAKE_VECTOR_CLONES
void place_flat_of_one(const EmitterColumns& emitters, const SeenEmitters& seen, const ReceiverColumns& receiver,
                       Receiver first, std::int32_t n, SampleColumns& samples) {
  n -= n % static_cast<std::int32_t>(kLanes);  // it is whole: so compilers know
#pragma GCC ivdep
  for (std::int32_t k = 0; k < n; ++k) place<true>(emitters, seen, receiver, first, k, 0, 0, samples);
}

RADBAKE_VECTOR_CLONES
void place_flat(const EmitterColumns& emitters, const SeenEmitters& seen, const ReceiverColumns& receiver,
                Receiver first, std::int32_t n, SampleColumns& samples) {
  n -= n % static_cast<std::int32_t>(kLanes);  // it is whole: so compilers know
#pragma GCC ivdep
  for (std::int32_t k = 0; k < n; ++k) {
    place<true>(emitters, seen, receiver, first, k, at(samples.emitter, k), at(samples.slot, k), samples);
  }
}

RADBAKE_VECTOR_CLONES
void place_curved(const EmitterColumns& emitters, const SeenEmitters& seen, const ReceiverColumns& receiver,
                  Receiver first, std::int32_t n, SampleColumns& samples) {
  n -= n % static_cast<std::int32_t>(kLanes);  // it is whole: so compilers know
#pragma GCC ivdep
  for (std::int32_t k = 0; k < n; ++k) {
    place<false>(emitters, seen, receiver, first, k, at(samples.emitter, k), at(samples.slot, k), samples);
  }
}

}  // namespace

void weigh_emitters(const EmitterColumns& emitters, const ReceiverColumns& receiver, SeenEmitters& seen) {
  seen.make_room(emitters.size);
  weigh_all(emitters, static_cast<std::int32_t>(emitters.size), receiver.middle, weighing_of(receiver), seen);
}

void weigh_emitters(const EmitterColumns& emitters, const std::vector<std::int32_t>& list, std::size_t n,
                    const ReceiverColumns& receiver, SeenEmitters& seen) {
  seen.make_room(n);
  weigh_listed(emitters, list.data(), static_cast<std::int32_t>(n), receiver.middle, weighing_of(receiver), seen);
}

void place_samples(const EmitterColumns& emitters, const SeenEmitters& seen, const ReceiverColumns& receiver,
                   std::size_t n, SampleColumns& samples) {
  const Receiver first{to_float(receiver.facing), to_float(receiver.normal)};
  samples.pad(n);
  const auto whole = static_cast<std::int32_t>(whole_lanes(n));
  if (!receiver.is_flat) {
    place_curved(emitters, seen, receiver, first, whole, samples);
  } else if (emitters.size > 1) {
    place_flat(emitters, seen, receiver, first, whole, samples);
  } else {
    place_flat_of_one(emitters, seen, receiver, first, whole, samples);
  }
}

}  // namespace radbake::radiosity
