#include "server/study/polygon_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/radiosity/form_factor/analytic_polygon.h"

namespace radbake::study {
namespace {

using radiosity::Corners;
using radiosity::HalfSpace;
using radiosity::PolygonCorners;

/// Above the rounding of a ray's origin, below what a form factor shows.
constexpr double kLift = 0x1p-20;

double ulp_of(const PolygonCorners& corners) {
  double largest = 0;
  for (const Vec3& c : corners) largest = std::max({largest, std::fabs(c.x), std::fabs(c.y), std::fabs(c.z)});
  return std::nextafter(largest, std::numeric_limits<double>::infinity()) - largest;
}

/// A polygon as triangles, and the half-space in front of it.
struct Triangulated {
  std::vector<Corners> triangles;
  HalfSpace front;
};

/// `ulp`: of the coordinates as they were given, in the units that the corners have now.
Result<Triangulated> triangulated(const PolygonCorners& corners, double ulp, const std::string& name) {
  if (corners.size() < 3) return invalid_argument(name + " has " + std::to_string(corners.size()) + " corners");
  for (const Vec3& corner : corners) {
    if (!is_finite(corner)) return invalid_argument(name + " has a corner that is not finite");
  }
  Triangulated out;
  RADBAKE_ASSIGN_OR_RETURN(out.front, radiosity::plane_of(corners, ulp, name));
  RADBAKE_ASSIGN_OR_RETURN(const auto pieces, radiosity::convex_pieces(corners, out.front, name));
  for (const radiosity::Piece& piece : pieces) {
    for (std::size_t k = 1; k + 1 < piece.corners.size(); ++k) {
      out.triangles.push_back({piece.corners[0], piece.corners[k], piece.corners[k + 1]});
    }
  }
  return out;
}

bool lies_in(const PolygonCorners& corners, const HalfSpace& plane) {
  return std::all_of(corners.begin(), corners.end(), [&](Vec3 p) { return plane.side(p) == 0; });
}

}  // namespace

Result<PolygonPair> PolygonPair::make(const PolygonCase& source) {
  // Refuse what has no value, coincident patches among it, by the formula that refuses it.
  RADBAKE_RETURN_IF_ERROR(radiosity::polygon_form_factor(source.from, source.to, {}));

  PolygonPair pair;
  const Vec3 origin = source.from[0];
  int exponent = 0;
  std::frexp(radiosity::perimeter(source.from), &exponent);
  const auto local = [&](const PolygonCorners& corners) {
    PolygonCorners out;
    for (const Vec3& corner : corners) {
      const Vec3 d = corner - origin;
      out.push_back({std::ldexp(d.x, 1 - exponent), std::ldexp(d.y, 1 - exponent), std::ldexp(d.z, 1 - exponent)});
    }
    return out;
  };
  const auto ulp = [&](const PolygonCorners& corners) { return std::ldexp(ulp_of(corners), 1 - exponent); };
  pair.local_ = {local(source.from), local(source.to), {}};
  RADBAKE_ASSIGN_OR_RETURN(Triangulated from, triangulated(pair.local_.from, ulp(source.from), "from"));
  RADBAKE_ASSIGN_OR_RETURN(Triangulated to, triangulated(pair.local_.to, ulp(source.to), "to"));

  // What lies on a patch covers it.
  std::vector<Corners> obstacles;
  for (std::size_t k = 0; k < source.occluders.size(); ++k) {
    PolygonCorners corners = local(source.occluders[k]);
    for (const HalfSpace& front : {from.front, to.front}) {
      if (!lies_in(corners, front)) continue;
      for (Vec3& corner : corners) corner += front.normal * kLift;
    }
    const double coarser_ulp = std::max(ulp(source.occluders[k]), ulp_of(corners));
    RADBAKE_ASSIGN_OR_RETURN(const Triangulated occluder,
                             triangulated(corners, coarser_ulp, "occluder " + std::to_string(k)));
    obstacles.insert(obstacles.end(), occluder.triangles.begin(), occluder.triangles.end());
    pair.local_.occluders.push_back(std::move(corners));
  }
  pair.first_target_ = static_cast<std::uint32_t>(obstacles.size());
  obstacles.insert(obstacles.end(), to.triangles.begin(), to.triangles.end());
  pair.visibility_ = radiosity::make_brute_force_visibility(obstacles);

  pair.normal_ = from.front.normal;
  pair.target_normal_ = to.front.normal;
  pair.from_ = std::move(from.triangles);
  double area = 0;
  for (const Corners& triangle : pair.from_) {
    area += radiosity::polygon_area(triangle);
    pair.area_up_to_.push_back(area);
  }
  return pair;
}

Vec3 PolygonPair::site(double x, double y) const {
  // Choose a triangle by area, and use what is left of x within it.
  const double wanted = x * area_up_to_.back();
  auto at = std::upper_bound(area_up_to_.begin(), area_up_to_.end(), wanted);
  if (at == area_up_to_.end()) --at;
  const double before = at == area_up_to_.begin() ? 0 : *(at - 1);
  const double root = std::sqrt(std::clamp((wanted - before) / (*at - before), 0.0, 1.0));
  const Corners& c = from_[static_cast<std::size_t>(at - area_up_to_.begin())];
  return c[0] * (1 - root) + c[1] * (root * (1 - y)) + c[2] * (root * y);
}

bool PolygonPair::shows_target(const radiosity::Hit& hit, const radiosity::Ray& ray) const {
  const Vec3 direction{ray.direction[0], ray.direction[1], ray.direction[2]};
  return hit.triangle != radiosity::kNoHit && hit.triangle >= first_target_ && dot(direction, target_normal_) < 0;
}

}  // namespace radbake::study
