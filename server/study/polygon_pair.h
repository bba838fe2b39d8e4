#pragma once

#include <array>
#include <memory>
#include <vector>

#include "common/base/result.h"
#include "server/radiosity/visibility/visibility.h"
#include "server/study/polygon_cases.h"

namespace radbake::study {

/// A pair of polygons for rays from the first to the second, in coordinates about the first.
///
/// Rays are single precision, so the origin is a corner of `from`, and a power of two brings its perimeter into [1, 2);
/// what they meet is found in double. Occluders in the plane of a patch are lifted off its front by 2^-20, so that they
/// cover it.
class PolygonPair {
 public:
  /// Errors: kInvalidArgument for what the analytic form factor refuses.
  static Result<PolygonPair> make(const PolygonCase& source);

  /// A point of `from`, uniform by area for a uniform (x, y) in the unit square.
  Vec3 site(double x, double y) const;
  /// Of `from`, unit length.
  Vec3 normal() const { return normal_; }
  /// What rays from `from` may meet: the occluders, then `to`.
  const radiosity::Visibility& visibility() const { return *visibility_; }
  /// Whether a ray met the front of `to`.
  bool shows_target(const radiosity::Hit& hit, const radiosity::Ray& ray) const;

  /// The case in these coordinates.
  const PolygonCase& local() const { return local_; }

 private:
  PolygonPair() = default;

  PolygonCase local_;
  std::vector<radiosity::Corners> from_;  ///< triangles
  std::vector<double> area_up_to_;        ///< running sum over them
  Vec3 normal_, target_normal_;
  std::uint32_t first_target_ = 0;  ///< triangles from this one on are `to`
  std::unique_ptr<radiosity::Visibility> visibility_;
};

inline std::array<float, 3> to_float(Vec3 v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

}  // namespace radbake::study
