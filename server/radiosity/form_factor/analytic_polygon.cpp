#include "server/radiosity/form_factor/analytic_polygon.h"

#include <algorithm>
#include <limits>
#include <sstream>

namespace radbake::radiosity {
namespace {

constexpr double kPlanarUlps = 8;
// Below this width no digit of the normal is certain.
constexpr double kWidthUlps = 8;

bool is_convex(const PolygonCorners& corners, Vec3 normal, double slack) {
  const std::size_t n = corners.size();
  double turned = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 a = corners[(i + 1) % n] - corners[i], b = corners[(i + 2) % n] - corners[(i + 1) % n];
    const double turn = dot(cross(a, b), normal);
    if (turn < -slack * (length(a) + length(b))) return false;
    turned += std::atan2(turn, dot(a, b));
  }
  // A star turns left at every corner too, more than once round.
  return turned < 3 * M_PI;
}

bool triangle_holds(Vec3 a, Vec3 b, Vec3 c, Vec3 p, Vec3 normal) {
  return dot(cross(b - a, p - a), normal) >= 0 && dot(cross(c - b, p - b), normal) >= 0 &&
         dot(cross(a - c, p - c), normal) >= 0;
}

}  // namespace

Vec3 twice_area_vector(std::span<const Vec3> corners) {
  Vec3 sum;
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    sum += cross(corners[i] - corners[0], corners[i + 1] - corners[0]);
  }
  return sum;
}

double perimeter(std::span<const Vec3> corners) {
  double sum = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) sum += length(corners[(i + 1) % corners.size()] - corners[i]);
  return sum;
}

double radius_about(Vec3 centre, std::span<const Vec3> corners) {
  double largest = 0;
  for (const Vec3& corner : corners) largest = std::max(largest, length(corner - centre));
  return largest;
}

Vec3 mean_corner(std::span<const Vec3> corners) {
  Vec3 sum;
  for (const Vec3& corner : corners) sum += corner - corners[0];
  return corners[0] + sum / static_cast<double>(corners.size());
}

Result<HalfSpace> plane_of(std::span<const Vec3> corners, double ulp, const std::string& name) {
  const Vec3 twice_area = twice_area_vector(corners);
  const double round = perimeter(corners);
  const double width = length(twice_area) / round;
  if (!(round > 0) || !(width > kWidthUlps * ulp)) return invalid_argument(name + " has no area");

  // A needle's normal has lost digits: make it exact along the longest edge, where they would show.
  Vec3 longest;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 edge = corners[(i + 1) % corners.size()] - corners[i];
    if (dot(edge, edge) > dot(longest, longest)) longest = edge;
  }
  Vec3 normal = normalized(twice_area);
  normal = normalized(normal - longest * (dot(normal, longest) / dot(longest, longest)));

  HalfSpace front{mean_corner(corners), normal, kPlanarUlps * ulp, kPlanarUlps * ulp / width};
  double furthest = 0;
  for (const Vec3& corner : corners) furthest = std::max(furthest, std::abs(front.distance(corner)));
  if (furthest > kPlanarUlps * ulp) {
    std::ostringstream text;
    text << name << " is not planar: a corner is off its plane by " << furthest / ulp
         << " ulp of its largest coordinate, at most " << kPlanarUlps << " allowed";
    return invalid_argument(text.str());
  }
  return front;
}

Result<std::vector<Piece>> convex_pieces(const PolygonCorners& corners, const HalfSpace& front,
                                         const std::string& name) {
  std::vector<Piece> pieces;
  if (is_convex(corners, front.normal, front.near)) {
    pieces.push_back({corners, front});
    return pieces;
  }
  // Cut off the ear with the largest smallest angle's sine: fat triangles integrate best.
  PolygonCorners rest = corners;
  while (rest.size() >= 3) {
    const std::size_t n = rest.size();
    std::size_t best = n;
    double best_shape = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3 a = rest[(i + n - 1) % n], b = rest[i], c = rest[(i + 1) % n];
      const double area = dot(cross(b - a, c - a), front.normal);
      const double longest = std::max({length(b - a), length(c - b), length(a - c)});
      if (area <= front.near * longest) continue;
      bool is_ear = true;
      for (std::size_t k = 0; k < n && is_ear; ++k) {
        if (rest[k] == a || rest[k] == b || rest[k] == c) continue;
        is_ear = !triangle_holds(a, b, c, rest[k], front.normal);
      }
      const double shape = area / (longest * longest);
      if (is_ear && shape > best_shape) best = i, best_shape = shape;
    }
    if (best == n) {
      // What is left may have no area: corners on one line.
      if (polygon_area(rest) <= front.near * perimeter(rest)) break;
      return invalid_argument(name + " crosses itself");
    }
    pieces.push_back({{rest[(best + n - 1) % n], rest[best], rest[(best + 1) % n]}, front});
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(best));
  }
  return pieces;
}

void clip_convex(const PolygonCorners& corners, const HalfSpace& inside, PolygonCorners& clipped) {
  clipped.clear();
  const std::size_t n = corners.size();
  bool any_inside = false;
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 a = corners[i], b = corners[(i + 1) % n];
    const int side_a = inside.side(a), side_b = inside.side(b);
    any_inside = any_inside || side_a > 0;
    if (side_a >= 0) clipped.push_back(a);
    if (side_a * side_b < 0) {
      const double da = inside.distance(a), db = inside.distance(b);
      clipped.push_back(a + (b - a) * (da / (da - db)));
    }
  }
  if (!any_inside || clipped.size() < 3) clipped.clear();
}

Reach reach_of(std::span<const Vec3> corners, const HalfSpace& plane) {
  Reach reach;
  for (const Vec3& corner : corners) {
    const int side = plane.side(corner);
    reach.front = reach.front || side > 0;
    reach.back = reach.back || side < 0;
  }
  return reach;
}

PolygonCorners part_inside(const PolygonCorners& corners, const HalfSpace& inside, bool reaches_outside) {
  if (!reaches_outside) return corners;
  PolygonCorners part;
  clip_convex(corners, inside, part);
  return part;
}

void remove_convex(std::vector<PolygonCorners>& polygons, std::span<const HalfSpace> hole) {
  std::vector<PolygonCorners> left;
  PolygonCorners outside, inside;
  for (PolygonCorners& polygon : polygons) {
    // Leave a polygon whole that lies outside one of the half-spaces.
    const bool is_apart = std::any_of(hole.begin(), hole.end(), [&](const HalfSpace& half) {
      return std::none_of(polygon.begin(), polygon.end(), [&](Vec3 p) { return half.side(p) > 0; });
    });
    if (is_apart) {
      left.push_back(std::move(polygon));
      continue;
    }
    // Keep what is outside each half-space and go on with the rest; what is inside all of them is gone.
    for (const HalfSpace& half : hole) {
      clip_convex(polygon, half.reversed(), outside);
      if (outside.empty()) continue;
      left.push_back(outside);
      clip_convex(polygon, half, inside);
      polygon.swap(inside);
      if (polygon.empty()) break;
    }
  }
  polygons.swap(left);
}

double distance_to_segment(Vec3 p, Vec3 a, Vec3 b) {
  const Vec3 u = b - a;
  const double squared = dot(u, u);
  const double t = squared > 0 ? std::clamp(dot(p - a, u) / squared, 0.0, 1.0) : 0;
  return length(p - a - u * t);
}

double distance_to_polygon(Vec3 p, const Piece& piece) {
  const std::size_t n = piece.corners.size();
  bool is_over = true;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec3 a = piece.corners[i], b = piece.corners[(i + 1) % n];
    is_over = is_over && dot(cross(b - a, p - a), piece.front.normal) >= 0;
    nearest = std::min(nearest, distance_to_segment(p, a, b));
  }
  return is_over ? std::abs(piece.front.distance(p)) : nearest;
}

}  // namespace radbake::radiosity
