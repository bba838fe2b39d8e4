#include "server/radiosity/form_factor/analytic.h"

#include <algorithm>
#include <array>
#include <limits>

#include "common/base/check.h"
#include "server/radiosity/form_factor/analytic_exchange.h"
#include "server/radiosity/form_factor/analytic_polygon.h"

namespace radbake::radiosity {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr long kMostEvaluations = 4'000'000;
// What the contour must state, absolute and relative, or the area is integrated too: a tenth of what we promise.
constexpr double kContourError = 1e-10, kContourRelativeError = 1e-9;
constexpr double kUnoccludedError = 1e-12;

/// All polygons about a corner of the smaller patch, the longest side of the patches' box between 1/2 and 1.
struct Setting {
  Vec3 origin;
  int exponent = 0;

  PolygonCorners apply(std::span<const Vec3> corners) const {
    PolygonCorners local;
    for (const Vec3& corner : corners) {
      const Vec3 d = corner - origin;
      local.push_back({std::ldexp(d.x, -exponent), std::ldexp(d.y, -exponent), std::ldexp(d.z, -exponent)});
    }
    return local;
  }
};

double largest_coordinate(std::span<const Vec3> corners) {
  double largest = 0;
  for (const Vec3& c : corners) largest = std::max({largest, std::abs(c.x), std::abs(c.y), std::abs(c.z)});
  return largest;
}

Result<void> check_corners(std::span<const Vec3> corners, const std::string& name) {
  if (corners.size() < 3) return invalid_argument(name + " has " + std::to_string(corners.size()) + " corners");
  for (const Vec3& corner : corners) {
    if (!is_finite(corner)) return invalid_argument(name + " has a corner that is not finite");
  }
  if (largest_coordinate(corners) > 1e100) return invalid_argument(name + " has a coordinate above 1e100");
  return {};
}

Setting setting_of(std::span<const Vec3> from, std::span<const Vec3> to) {
  Setting setting;
  setting.origin = perimeter(to) < perimeter(from) ? to[0] : from[0];
  double size = 0;
  for (const auto corners : {from, to}) {
    for (const Vec3& corner : corners) {
      const Vec3 d = corner - setting.origin;
      size = std::max({size, std::abs(d.x), std::abs(d.y), std::abs(d.z)});
    }
  }
  if (size > 0) std::frexp(size, &setting.exponent);
  return setting;
}

Result<std::vector<Piece>> pieces_of(std::span<const Vec3> corners, const Setting& setting, const std::string& name) {
  const double largest = largest_coordinate(corners);
  const double ulp =
      std::ldexp(std::nextafter(largest, std::numeric_limits<double>::infinity()) - largest, -setting.exponent);
  const PolygonCorners local = setting.apply(corners);
  RADBAKE_ASSIGN_OR_RETURN(HalfSpace front, plane_of(local, ulp, name));
  return convex_pieces(local, front, name);
}

/// The pieces without what coplanar occluders cover.
std::vector<Piece> uncovered(const std::vector<Piece>& pieces, std::span<const Piece> occluders) {
  std::vector<Piece> result;
  for (const Piece& piece : pieces) {
    std::vector<PolygonCorners> left = {piece.corners};
    for (const Piece& occluder : occluders) {
      const auto lies_in = [](const PolygonCorners& corners, const HalfSpace& plane) {
        return std::all_of(corners.begin(), corners.end(), [&](Vec3 p) { return plane.side(p) == 0; });
      };
      if (!lies_in(occluder.corners, piece.front) && !lies_in(piece.corners, occluder.front)) continue;
      std::vector<HalfSpace> hole;
      for (std::size_t k = 0; k < occluder.corners.size(); ++k) {
        const Vec3 a = occluder.corners[k], b = occluder.corners[(k + 1) % occluder.corners.size()];
        const Vec3 inward = cross(occluder.front.normal, b - a);
        const double near = std::max(piece.front.near, occluder.front.near);
        if (length(inward) > 0) hole.push_back({a, normalized(inward), near, near / length(b - a)});
      }
      remove_convex(left, hole);
    }
    for (PolygonCorners& corners : left) result.push_back({std::move(corners), piece.front});
  }
  return result;
}

/// Whether some of an occluder lies inside the convex hull of two pieces.
///
/// The hull's faces: the pieces' planes, and planes through an edge of one and a corner of the other with everything on
/// one side. What touches the hull from outside has no part inside.
bool reaches_shaft(const Piece& occluder, const Piece& p, const Piece& q) {
  PolygonCorners rest = occluder.corners, clipped;
  const auto clip = [&](const HalfSpace& inside) {
    clip_convex(rest, inside, clipped);
    rest.swap(clipped);
    return !rest.empty();
  };
  if (!clip(p.front) || !clip(q.front)) return false;
  const std::array<const Piece*, 2> both = {&p, &q};
  const double near = std::max({p.front.near, q.front.near, occluder.front.near});
  for (int side = 0; side < 2; ++side) {
    const PolygonCorners& edges = both[static_cast<std::size_t>(side)]->corners;
    const PolygonCorners& others = both[static_cast<std::size_t>(1 - side)]->corners;
    for (std::size_t k = 0; k < edges.size(); ++k) {
      const Vec3 a = edges[k], ab = edges[(k + 1) % edges.size()] - a;
      for (const Vec3& corner : others) {
        const Vec3 m = cross(ab, corner - a);
        // A plane through a corner on the edge's own line is not determined.
        const double width = length(m) / std::max(length(ab), length(corner - a));
        if (!(width > 16 * near)) continue;
        HalfSpace inside{a, normalized(m), near, near / width};
        bool any_inside = false, any_outside = false;
        for (const Piece* piece : both) {
          for (const Vec3& x : piece->corners) {
            any_inside = any_inside || inside.side(x) > 0;
            any_outside = any_outside || inside.side(x) < 0;
          }
        }
        if (any_inside == any_outside) continue;
        if (!clip(any_inside ? inside : inside.reversed())) return false;
      }
    }
  }
  return true;
}

/// Whether one convex occluder covers the whole shaft: every corner's view of every corner.
bool hides_all(const Piece& occluder, const Piece& p, const Piece& q) {
  const double near = std::max({p.front.near, q.front.near, occluder.front.near, kEpsilon});
  for (const Vec3& x : p.corners) {
    for (const Vec3& y : q.corners) {
      const double dx = occluder.front.distance(x), dy = occluder.front.distance(y);
      if (occluder.front.side(x) * occluder.front.side(y) >= 0) return false;
      const Vec3 hit = x + (y - x) * (dx / (dx - dy));
      for (std::size_t k = 0; k < occluder.corners.size(); ++k) {
        const Vec3 a = occluder.corners[k], b = occluder.corners[(k + 1) % occluder.corners.size()];
        const double inside = dot(cross(b - a, hit - a), occluder.front.normal);
        if (inside < -8 * near * length(b - a)) return false;
      }
    }
  }
  return true;
}

double distance_between(const Piece& a, const Piece& b) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vec3& corner : a.corners) nearest = std::min(nearest, distance_to_polygon(corner, b));
  for (const Vec3& corner : b.corners) nearest = std::min(nearest, distance_to_polygon(corner, a));
  return nearest;
}

/// Whether the pieces lie in one plane, face each other and overlap.
bool coincide(const Piece& p, const Piece& q) {
  if (dot(p.front.normal, q.front.normal) > 0) return false;
  for (const Vec3& corner : q.corners) {
    if (p.front.side(corner) != 0) return false;
  }
  PolygonCorners rest = q.corners, clipped;
  for (std::size_t k = 0; k < p.corners.size(); ++k) {
    const Vec3 a = p.corners[k], b = p.corners[(k + 1) % p.corners.size()];
    const Vec3 inward = cross(p.front.normal, b - a);
    if (length(inward) == 0) continue;
    clip_convex(rest, {a, normalized(inward), 4 * p.front.near, p.front.near / length(b - a)}, clipped);
    rest.swap(clipped);
  }
  return !rest.empty();
}

/// How much A F can change while the corners of `moved` move by at most `near`.
///
///   |d(A F)| <= near sum over edges of length min(1, A_seen/(pi d^2)),  d: the least distance of edge and `seen`
///
/// The light of `seen` is a field without sources, at most 1: its flux through a polygon depends on the outline only.
double corner_error(const Piece& moved, const Piece& seen) {
  const Vec3 middle = mean_corner(seen.corners);
  const double radius = radius_about(middle, seen.corners), area = polygon_area(seen.corners);
  double sum = 0;
  for (std::size_t k = 0; k < moved.corners.size(); ++k) {
    const Vec3 a = moved.corners[k], b = moved.corners[(k + 1) % moved.corners.size()];
    const double distance = std::max(0.0, distance_to_segment(middle, a, b) - radius);
    const bool is_near = area >= M_PI * distance * distance;
    sum += length(b - a) * (is_near ? 1 : area / (M_PI * distance * distance));
  }
  return sum * moved.front.near;
}

Exchange unoccluded_exchange(const Piece& p, const Piece& q, double area_from, AnalyticMethod& method) {
  if (is_far(p, q)) {
    method = AnalyticMethod::kKernel;
    return kernel_exchange(p, q);
  }
  method = AnalyticMethod::kContour;
  const Exchange contour = contour_exchange(p, q);
  if (contour.error <= std::min(kContourError * area_from, kContourRelativeError * contour.value)) return contour;

  // The sum cancels: integrate over the smaller patch, where no term does.
  const bool p_is_smaller = polygon_area(p.corners) < polygon_area(q.corners);
  const double tolerance = std::max(std::min(kUnoccludedError * area_from, contour.error / 2), kEpsilon * area_from);
  Exchange area = visible_exchange(p_is_smaller ? p : q, p_is_smaller ? q : p, {}, tolerance, kMostEvaluations / 20);
  if (area.error >= contour.error) return contour;
  method = AnalyticMethod::kQuadrature;
  area.evaluations += contour.evaluations;
  return area;
}

Exchange occluded_exchange(const Piece& p, const Piece& q, const std::vector<Piece>& occluders, double tolerance) {
  for (const Piece& occluder : occluders) {
    if (hides_all(occluder, p, q)) return {};
  }
  // Near an occluder its shadow's edges are sharp: integrate over the patch that is further from all of them.
  double from_p = std::numeric_limits<double>::infinity(), from_q = from_p;
  for (const Piece& occluder : occluders) {
    from_p = std::min(from_p, distance_between(occluder, p));
    from_q = std::min(from_q, distance_between(occluder, q));
  }
  const bool over_p = from_p > from_q || (from_p == from_q && polygon_area(p.corners) <= polygon_area(q.corners));
  return visible_exchange(over_p ? p : q, over_p ? q : p, occluders, tolerance, kMostEvaluations);
}

}  // namespace

const char* analytic_method_name(AnalyticMethod method) {
  switch (method) {
    case AnalyticMethod::kZero: return "zero";
    case AnalyticMethod::kKernel: return "kernel";
    case AnalyticMethod::kContour: return "contour";
    case AnalyticMethod::kQuadrature: return "quadrature";
    case AnalyticMethod::kOccluded: return "occluded";
  }
  return "unknown";
}

Result<PolygonFormFactor> polygon_form_factor(std::span<const Vec3> from, std::span<const Vec3> to,
                                              std::span<const PolygonCorners> occluders, double tolerance) {
  // Check the input.
  if (!(tolerance > 0) || !std::isfinite(tolerance)) {
    return invalid_argument("the tolerance must be above 0, not " + std::to_string(tolerance));
  }
  RADBAKE_RETURN_IF_ERROR(check_corners(from, "the patch that sends"));
  RADBAKE_RETURN_IF_ERROR(check_corners(to, "the patch that receives"));
  for (std::size_t k = 0; k < occluders.size(); ++k) {
    RADBAKE_RETURN_IF_ERROR(check_corners(occluders[k], "occluder " + std::to_string(k)));
  }

  // Recentre, scale, cut into convex pieces.
  const Setting setting = setting_of(from, to);
  RADBAKE_ASSIGN_OR_RETURN(std::vector<Piece> all_p, pieces_of(from, setting, "the patch that sends"));
  RADBAKE_ASSIGN_OR_RETURN(std::vector<Piece> all_q, pieces_of(to, setting, "the patch that receives"));
  std::vector<Piece> blockers;
  for (std::size_t k = 0; k < occluders.size(); ++k) {
    RADBAKE_ASSIGN_OR_RETURN(std::vector<Piece> pieces,
                             pieces_of(occluders[k], setting, "occluder " + std::to_string(k)));
    blockers.insert(blockers.end(), pieces.begin(), pieces.end());
  }
  double area_from = 0;
  for (const Piece& p : all_p) area_from += polygon_area(p.corners);
  for (const Piece& p : all_p) {
    for (const Piece& q : all_q) {
      if (coincide(p, q)) return invalid_argument("the patches coincide face to face: no unique form factor");
    }
  }

  // Take out what lies on the patches, then add up the pairs of pieces that see each other.
  const std::vector<Piece> pieces_p = uncovered(all_p, blockers), pieces_q = uncovered(all_q, blockers);
  const double num_pairs = static_cast<double>(std::max<std::size_t>(1, pieces_p.size() * pieces_q.size()));
  PolygonFormFactor result;
  for (const Piece& whole_p : pieces_p) {
    for (const Piece& whole_q : pieces_q) {
      Piece p{{}, whole_p.front}, q{{}, whole_q.front};
      clip_convex(whole_p.corners, whole_q.front, p.corners);
      clip_convex(whole_q.corners, whole_p.front, q.corners);
      if (p.corners.empty() || q.corners.empty()) continue;
      std::vector<Piece> in_shaft;
      for (const Piece& blocker : blockers) {
        if (reaches_shaft(blocker, p, q)) in_shaft.push_back(blocker);
      }
      AnalyticMethod method = AnalyticMethod::kOccluded;
      const Exchange exchange = in_shaft.empty() ? unoccluded_exchange(p, q, area_from, method)
                                                 : occluded_exchange(p, q, in_shaft, tolerance * area_from / num_pairs);
      result.form_factor += exchange.value / area_from;
      double given = corner_error(p, q) + corner_error(q, p);
      for (const Piece& blocker : in_shaft) given += blocker.front.near * perimeter(blocker.corners);
      result.stated_error += (exchange.error + (exchange.value > 0 ? given : 0)) / area_from;
      result.evaluations += exchange.evaluations;
      result.method = std::max(result.method, method);
    }
  }
  return result;
}

}  // namespace radbake::radiosity
