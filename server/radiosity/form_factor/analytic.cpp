#include "server/radiosity/form_factor/analytic.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "common/base/check.h"
#include "server/radiosity/form_factor/analytic_pair.h"

namespace radbake::radiosity {
namespace {

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
  const Occluders between(std::move(blockers));
  std::vector<std::uint32_t> all(between.pieces().size());
  std::iota(all.begin(), all.end(), 0);
  const double num_pairs = static_cast<double>(std::max<std::size_t>(1, pieces_p.size() * pieces_q.size()));
  PolygonFormFactor result;
  for (const Piece& p : pieces_p) {
    for (const Piece& q : pieces_q) {
      const PairExchange exchange = pair_exchange(p, q, between, all, tolerance * area_from / num_pairs);
      result.form_factor += exchange.value / area_from;
      result.stated_error += exchange.error / area_from;
      result.evaluations += exchange.evaluations;
      result.method = std::max(result.method, exchange.method);
    }
  }
  return result;
}

}  // namespace radbake::radiosity
