#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "common/geometry/vector.h"

namespace radbake::radiosity {

/// A half-line or segment: origin + t direction, 0 <= t <= max_distance. Direction need not be of unit length.
struct Ray {
  std::array<float, 3> origin;
  std::array<float, 3> direction;
  float max_distance = std::numeric_limits<float>::infinity();
};

inline constexpr std::uint32_t kNoHit = 0xffffffffu;

/// The nearest triangle on a ray: its index and the barycentric weights of its second and third corner.
struct Hit {
  std::uint32_t triangle = kNoHit;
  float u = 0;
  float v = 0;
  float distance = std::numeric_limits<float>::infinity();  ///< in lengths of the ray's direction
  /// The ray met something on its way that stops channels by different shares: they may end elsewhere.
  bool differs_by_channel = false;
};

/// How much of a surface stands in the way of light, where that is not all of it: holes, partial coverage, tinted
/// sheets. Thread-safe.
class Opacity {
 public:
  virtual ~Opacity() = default;
  /// Whether light passes any part of a triangle: the others are never asked for their opacity.
  virtual bool is_see_through(std::uint32_t triangle) const = 0;
  /// Share of the light that a point stops, by channel, 0..1. (u, v): weights of the second and third corner.
  virtual Vec3 opacity(std::uint32_t triangle, double u, double v) const = 0;
};

/// A convex region: within a distance of a segment, and inside all of some half-spaces.
struct Shaft {
  /// Inside where dot(normal, x) >= offset.
  struct HalfSpace {
    Vec3 normal;  ///< unit length
    double offset = 0;
  };
  Vec3 begin, end;
  double radius = 0;  ///< > 0
  std::vector<HalfSpace> half_spaces;

  /// Whether some of a triangle's corners is inside of each half-space, or nearer to it than `margin`.
  bool may_hold(const std::array<Vec3, 3>& corners, double margin) const {
    return std::all_of(half_spaces.begin(), half_spaces.end(), [&](const HalfSpace& half) {
      return std::any_of(corners.begin(), corners.end(),
                         [&](Vec3 corner) { return dot(half.normal, corner) >= half.offset - margin; });
    });
  }
};

/// Answers what rays meet. Thread-safe; answers do not depend on how many threads ask.
class Visibility {
 public:
  virtual ~Visibility() = default;

  /// Nearest hit of each ray, from either side. Shapes: rays [n], hits [n].
  ///
  /// Of what is see-through, a ray is stopped with the probability of its opacity in this channel, as Chances says: the
  /// shares of the rays of a batch are right, and channels of equal opacity agree.
  virtual void trace(std::span<const Ray> rays, std::span<Hit> hits) const = 0;

  /// As trace(), of those rays alone that are wanted: the others' hits stay as they are.
  /// Shapes: rays, wanted, hits [n]; wanted 0 or 1.
  virtual void trace_again(std::span<const Ray> rays, std::span<const std::uint8_t> wanted, std::span<Hit> hits) const {
    std::vector<Hit> all(rays.size());
    trace(rays, all);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (wanted[i]) hits[i] = all[i];
    }
  }

  /// Whether anything lies on each segment, be it see-through in part. Shapes: segments [n], blocked [n], 0 or 1.
  virtual void blocked(std::span<const Ray> segments, std::span<std::uint8_t> blocked) const = 0;

  /// The share of light that each segment lets through, by channel: the product of 1 - opacity of all that it crosses.
  /// Shapes: segments [n], shares [n].
  virtual void transmitted(std::span<const Ray> segments, std::span<Vec3> shares) const = 0;

  /// Whether `transmitted` may be anything but 0 and 1.
  virtual bool is_see_through() const { return false; }

  /// The same surfaces as another channel (0, 1, 2) meets them. Lives as long as this.
  virtual const Visibility& channel(int) const { return *this; }

  /// Triangles that come within a distance of a point, ascending; a superset, never fewer.
  virtual void triangles_near(Vec3 point, double distance, std::vector<std::uint32_t>& triangles) const = 0;

  /// Triangles that reach into a shaft, ascending; a superset, never fewer: bounds are wider by what single precision
  /// may move them. Those that lie outside of one of its half-spaces, or far from its axis, are left out.
  virtual void triangles_in(const Shaft& shaft, std::vector<std::uint32_t>& triangles) const = 0;

  /// The instruction set that rays are traced with: equal bytes are promised for one.
  virtual std::string instruction_set() const = 0;
};

using Corners = std::array<Vec3, 3>;

/// Embree's tree over triangles, watertight at shared edges. Corners should lie within a few units of 0: they are
/// stored in float. Null where `stop` was requested while the tree was built. `opacity` outlives it; null: all is
/// opaque. Throws std::bad_alloc where memory does not suffice, as vectors do.
std::unique_ptr<Visibility> make_embree_visibility(std::span<const Corners> triangles, std::stop_token stop = {},
                                                   const Opacity* opacity = nullptr);

/// The slow twin for tests: every ray against every triangle, in double (Moeller & Trumbore 1997).
std::unique_ptr<Visibility> make_brute_force_visibility(std::span<const Corners> triangles,
                                                        const Opacity* opacity = nullptr);

/// Answers as `visibility`, which outlives it, but nothing ever blocks a segment: for direct light and receivers in
/// scenes where nothing can, or to see what shadows do.
std::unique_ptr<Visibility> make_unblocked(const Visibility& visibility);

/// The numbers in [0, 1) that decide which rays of a batch are stopped: those below the opacity.
///
/// Ray i meets triangle t at frac(a_t (i + 1/2) + shift(batch, t)) with a_t one of a few irrational numbers: the rays
/// that meet a sheet are stopped in turn rather than by lot, and two sheets in different turns. Source: Weyl 1916
/// (equidistribution); Cranley & Patterson 1976 (shifts).
class Chances {
 public:
  explicit Chances(std::span<const Ray> batch);
  double of(std::size_t ray, std::uint32_t triangle) const;

 private:
  std::uint64_t seed_ = 0;  ///< what the first ray of the batch is
};

}  // namespace radbake::radiosity
