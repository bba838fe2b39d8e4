#include "server/radiosity/form_factor/analytic_pair.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace radbake::radiosity {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// Of the lines between edges, before what is visible is integrated: these cost little.
constexpr long kMostHiddenEvaluations = 400'000;
// What the contour must state, relative to the smaller area and to its value, or the area is integrated too: a tenth of
// what is promised.
constexpr double kContourError = 1e-10, kContourRelativeError = 1e-9;
constexpr double kUnoccludedError = 1e-12;
// Of the open value: above it, what is left of a far pair would have no digits, and the visible part is integrated.
constexpr double kMostHiddenError = 1e-2;
// So many occluders are looked at from a point in the time of one evaluation.
constexpr long kOccludersOfEvaluation = 8;
// How often a piece is cut where there are too many chains of occluders to count.
constexpr int kMostCuts = 4;

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

PairExchange unoccluded_exchange(const Piece& p, const Piece& q) {
  if (is_far(p, q)) return {kernel_exchange(p, q), AnalyticMethod::kKernel};
  const Exchange contour = contour_exchange(p, q);
  const double area = std::min(polygon_area(p.corners), polygon_area(q.corners));
  if (contour.error <= std::min(kContourError * area, kContourRelativeError * contour.value)) {
    return {contour, AnalyticMethod::kContour};
  }
  // The sum cancels: integrate over the smaller patch, where no term does.
  const bool p_is_smaller = polygon_area(p.corners) < polygon_area(q.corners);
  const double tolerance = std::max(std::min(kUnoccludedError * area, contour.error / 2), kEpsilon * area);
  Exchange smooth =
      visible_exchange(p_is_smaller ? p : q, p_is_smaller ? q : p, {}, tolerance, kMostPairEvaluations / 20);
  if (smooth.error >= contour.error) return {contour, AnalyticMethod::kContour};
  smooth.evaluations += contour.evaluations;
  return {smooth, AnalyticMethod::kQuadrature};
}

Exchange visible_past(const Piece& p, const Piece& q, const std::vector<Piece>& occluders, double tolerance,
                      long most) {
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
  return visible_exchange(over_p ? p : q, over_p ? q : p, occluders, tolerance, most);
}

/// Corners are known to 8 ulp.
double given_error(const Piece& p, const Piece& q) {
  return movement_error(p.corners, p.front.near, q.corners) + movement_error(q.corners, q.front.near, p.corners);
}

/// What is open, and what of it is left.
struct Difference : Exchange {
  double open = 0;
};

struct Effort {
  double tolerance = 0;
  long most = 0;
  int num_cuts = 0;
};

Difference open_less_hidden(const Piece& p, const Piece& q, const Passings& passings, const Occluders& occluders,
                            const Effort& effort);

/// Adds up over parts of p. They are cut from what is in front of q, so only what is between them changes.
Difference sum_over_parts(std::span<const PolygonCorners> parts, const Piece& p, const Piece& q,
                          const Passings& passings, const Occluders& occluders, const Effort& effort) {
  const auto num_parts = static_cast<double>(parts.size());
  const Effort of_part{effort.tolerance / num_parts, effort.most / std::max(1L, static_cast<long>(parts.size())),
                       effort.num_cuts + 1};
  Difference sum;
  for (const PolygonCorners& corners : parts) {
    const Piece part{corners, p.front};
    const Passings own = find_passings(part, q, occluders, passings.in_shaft);
    if (own.hides_all) continue;
    const Difference one = open_less_hidden(part, q, own, occluders, of_part);
    sum.value += one.value;
    sum.error += one.error;
    sum.evaluations += one.evaluations;
    sum.open += one.open;
  }
  return sum;
}

/// What of a piece lies in a body, and what does not.
std::vector<PolygonCorners> parts_by_body(const Piece& p, const Occluders& occluders, std::uint32_t body) {
  std::vector<HalfSpace> inside;
  for (const std::uint32_t k : occluders.faces(body)) inside.push_back(occluders.pieces()[k].front.reversed());
  std::vector<PolygonCorners> parts = {p.corners};
  remove_convex(parts, inside);
  PolygonCorners rest = p.corners;
  for (const HalfSpace& half : inside) {
    const Reach reach = reach_of(rest, half);
    if (reach.back) rest = part_inside(rest, half, true);
  }
  if (!rest.empty()) parts.push_back(std::move(rest));
  return parts;
}

std::vector<PolygonCorners> halves(const Piece& p) {
  const std::size_t n = p.corners.size();
  std::size_t longest = 0;
  const auto edge = [&](std::size_t k) { return p.corners[(k + 1) % n] - p.corners[k]; };
  for (std::size_t k = 1; k < n; ++k) {
    if (dot(edge(k), edge(k)) > dot(edge(longest), edge(longest))) longest = k;
  }
  const HalfSpace half{mean_corner(p.corners), normalized(edge(longest)), 0, 0};
  std::vector<PolygonCorners> parts;
  for (const HalfSpace& side : {half, half.reversed()}) {
    PolygonCorners part;
    clip_convex(p.corners, side, part);
    if (!part.empty()) parts.push_back(std::move(part));
  }
  return parts;
}

Difference open_less_hidden(const Piece& p, const Piece& q, const Passings& passings, const Occluders& occluders,
                            const Effort& effort) {
  const bool may_cut = effort.num_cuts < kMostCuts;
  if (passings.tangled_body != kNoBody && may_cut) {
    // Lines from within a body and from outside of it are counted at different faces.
    const bool is_p = place_of(p, occluders, passings.tangled_body) == Place::kAcross;
    return sum_over_parts(parts_by_body(is_p ? p : q, occluders, passings.tangled_body), is_p ? p : q, is_p ? q : p,
                          passings, occluders, effort);
  }
  const PairExchange open = unoccluded_exchange(p, q);
  const Difference nothing_known{{open.value / 2, open.value / 2 + open.error, open.evaluations}, open.value};
  if (passings.tangled_body != kNoBody) return nothing_known;
  const Exchange hidden =
      hidden_exchange(passings.all, effort.tolerance / 2, std::min(effort.most, kMostHiddenEvaluations));
  if (std::isfinite(hidden.error)) {
    return {{open.value - hidden.value, open.error + hidden.error, open.evaluations + hidden.evaluations}, open.value};
  }
  if (!may_cut) return nothing_known;
  const bool p_is_larger = polygon_area(p.corners) >= polygon_area(q.corners);
  const Piece &larger = p_is_larger ? p : q, &other = p_is_larger ? q : p;
  return sum_over_parts(halves(larger), larger, other, passings, occluders, effort);
}

}  // namespace

double movement_error(const PolygonCorners& moved, double near, const PolygonCorners& seen) {
  const Vec3 middle = mean_corner(seen);
  const double radius = radius_about(middle, seen), area = polygon_area(seen);
  double sum = 0;
  for (std::size_t k = 0; k < moved.size(); ++k) {
    const Vec3 a = moved[k], b = moved[(k + 1) % moved.size()];
    const double distance = std::max(0.0, distance_to_segment(middle, a, b) - radius);
    const bool is_near = area >= M_PI * distance * distance;
    sum += length(b - a) * (is_near ? 1 : area / (M_PI * distance * distance));
  }
  return sum * near;
}

PairExchange pair_exchange(const Piece& whole_p, const Piece& whole_q, const Occluders& occluders,
                           std::span<const std::uint32_t> candidates, double tolerance, long most) {
  // Clip each piece to the front of the other.
  const Reach p_reach = reach_of(whole_p.corners, whole_q.front), q_reach = reach_of(whole_q.corners, whole_p.front);
  if (!p_reach.front || !q_reach.front) return {};
  const Piece p{part_inside(whole_p.corners, whole_q.front, p_reach.back), whole_p.front};
  const Piece q{part_inside(whole_q.corners, whole_p.front, q_reach.back), whole_q.front};
  if (p.corners.empty() || q.corners.empty()) return {};

  const Passings passings = find_passings(p, q, occluders, candidates);
  if (passings.hides_all) return {{}, AnalyticMethod::kOccluded};
  if (passings.in_shaft.empty()) {
    PairExchange result = unoccluded_exchange(p, q);
    if (result.value > 0) result.error += given_error(p, q);
    return result;
  }
  const Difference difference = open_less_hidden(p, q, passings, occluders, {tolerance, most, 0});
  PairExchange result{{difference.value, difference.error, difference.evaluations}, AnalyticMethod::kOccluded};
  bool may_be_none = true;
  if (!(result.error <= std::min(tolerance, kMostHiddenError * difference.open))) {
    // What is visible has more digits, or is all there is; the difference bounds it.
    std::vector<Piece> pieces;
    for (const std::uint32_t k : passings.in_shaft) pieces.push_back(occluders.pieces()[k]);
    // A point costs as much as there are occluders.
    const long most_points = most / (1 + static_cast<long>(pieces.size()) / kOccludersOfEvaluation);
    const Exchange visible = visible_past(p, q, pieces, tolerance, most_points);
    const double low = std::max(0.0, result.value - result.error), high = result.value + result.error;
    const double value = std::clamp(visible.value, low, std::max(low, high));
    result.error = std::max(value - low, high - value);
    result.value = value;
    result.evaluations += visible.evaluations;
    may_be_none = false;
  }
  if (result.value > 0 || result.error > 0) result.error += given_error(p, q);
  for (const std::uint32_t k : passings.in_shaft) {
    const Piece& occluder = occluders.pieces()[k];
    if (result.error > 0) result.error += occluder.front.near * perimeter(occluder.corners);
  }
  if (may_be_none && result.value <= result.error) {
    result.error += std::max(result.value, 0.0);
    result.value = 0;
  }
  return result;
}

}  // namespace radbake::radiosity
