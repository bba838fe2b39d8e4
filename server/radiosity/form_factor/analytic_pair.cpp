#include "server/radiosity/form_factor/analytic_pair.h"

#include <algorithm>
#include <limits>

#include "server/radiosity/form_factor/analytic_lines.h"

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

/// Sides of a half-space that a polygon reaches.
struct Reach {
  bool front = false, back = false;
};
Reach reach_of(const PolygonCorners& corners, const HalfSpace& plane) {
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

PolygonCorners reversed(const PolygonCorners& corners) { return {corners.rbegin(), corners.rend()}; }

/// Finds the light from p to q that passes through each occluder.
class PassingFinder {
 public:
  PassingFinder(const Piece& p, const Piece& q, const Occluders& occluders)
      : p_(p), q_(q), occluders_(occluders), q_reversed_(reversed(q.corners)) {}

  /// Whether bodies hold parts of the patches: then their faces cannot be counted one by one.
  bool is_tangled() const { return is_tangled_; }
  /// Whether one patch is in a body and the other out of it, or one occluder hides all.
  bool hides_all() const {
    return is_walled_off_ ||
           std::any_of(passings_.begin(), passings_.end(), [](const Passing& passing) { return passing.hides_all; });
  }
  std::span<const Passing> passings() const { return passings_; }

  /// Returns whether the occluder reaches the lines between p and q.
  bool find(std::uint32_t k) {
    const Piece& occluder = occluders_.pieces()[k];
    const Reach in_front_of_p = reach_of(occluder.corners, p_.front);
    const Reach in_front_of_q = reach_of(occluder.corners, q_.front);
    if (!in_front_of_p.front || !in_front_of_q.front) return false;
    const Reach p_side = reach_of(p_.corners, occluder.front), q_side = reach_of(q_.corners, occluder.front);
    bool enters = p_side.front && q_side.back, leaves = p_side.back && q_side.front;
    if (!enters && !leaves) return false;
    PolygonCorners between = part_inside(occluder.corners, p_.front, in_front_of_p.back);
    if (!between.empty()) between = part_inside(between, q_.front, in_front_of_q.back);
    if (between.empty()) return false;

    const std::size_t before = passings_.size();
    if (enters) add(k, between, false, p_side, q_side);
    if (leaves) add(k, between, true, p_side, q_side);
    if (passings_.size() == before) return false;
    // Lines that start outside of a body are counted where they enter it, others where they leave it.
    const std::uint32_t body = occluders_.body_of(k);
    if (body != kNoBody) {
      const auto [place_p, place_q] = places_of_patches(body);
      is_tangled_ = is_tangled_ || place_p == Place::kAcross || place_q == Place::kAcross;
      is_walled_off_ = is_walled_off_ || (place_p != place_q && !is_tangled_);
      const bool counts_entries = place_p == Place::kOutside;
      std::erase_if(passings_, [&](const Passing& passing) {
        return passing.occluder == k && (passing.ahead.normal == occluder.front.normal) == counts_entries;
      });
    }
    return true;
  }

 private:
  void add(std::uint32_t k, const PolygonCorners& between, bool leaves, Reach p_side, Reach q_side) {
    const Piece& occluder = occluders_.pieces()[k];
    const HalfSpace ahead = leaves ? occluder.front : occluder.front.reversed();
    const bool cuts_p = leaves ? p_side.front : p_side.back, cuts_q = leaves ? q_side.back : q_side.front;
    Passing passing;
    passing.p = part_inside(p_.corners, ahead.reversed(), cuts_p);
    passing.q = part_inside(q_reversed_, ahead, cuts_q);
    if (passing.p.empty() || passing.q.empty()) return;
    passing.between = leaves ? between : reversed(between);
    const Passage passage = passage_of(passing.p, passing.q, passing.between);
    if (passage == Passage::kBeside) return;
    const std::uint32_t body = occluders_.body_of(k);
    passing.ahead = ahead;
    passing.item = body == kNoBody ? static_cast<std::uint32_t>(occluders_.pieces().size()) + k : body;
    passing.occluder = k;
    passing.hides_all = passage == Passage::kThrough && !cuts_p && !cuts_q;
    passings_.push_back(std::move(passing));
  }

  std::pair<Place, Place> places_of_patches(std::uint32_t body) {
    for (const Places& known : places_) {
      if (known.body == body) return {known.p, known.q};
    }
    places_.push_back({body, place_of(p_, occluders_, body), place_of(q_, occluders_, body)});
    return {places_.back().p, places_.back().q};
  }

  struct Places {
    std::uint32_t body;
    Place p, q;
  };
  const Piece& p_;
  const Piece& q_;
  const Occluders& occluders_;
  PolygonCorners q_reversed_;
  std::vector<Passing> passings_;
  std::vector<Places> places_;
  bool is_tangled_ = false, is_walled_off_ = false;
};

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

  // Find what is between.
  PassingFinder finder(p, q, occluders);
  std::vector<std::uint32_t> in_shaft;
  for (const std::uint32_t k : candidates) {
    if (finder.find(k)) in_shaft.push_back(k);
    if (finder.hides_all()) return {{0, 0, 0}, AnalyticMethod::kOccluded};
  }

  PairExchange result;
  bool is_difference = false;
  if (in_shaft.empty()) {
    result = unoccluded_exchange(p, q);
  } else {
    result = {{0, std::numeric_limits<double>::infinity(), 0}, AnalyticMethod::kOccluded};
    double open_value = 0;
    is_difference = true;
    if (!finder.is_tangled()) {
      // What is open, less what is hidden.
      const PairExchange open = unoccluded_exchange(p, q);
      const Exchange hidden = hidden_exchange(finder.passings(), tolerance / 2, std::min(most, kMostHiddenEvaluations));
      open_value = open.value;
      result.value = open.value - hidden.value;
      result.error = open.error + hidden.error;
      result.evaluations = open.evaluations + hidden.evaluations;
    }
    if (!(result.error <= std::min(tolerance, kMostHiddenError * open_value))) {
      std::vector<Piece> pieces;
      for (const std::uint32_t k : in_shaft) pieces.push_back(occluders.pieces()[k]);
      const Exchange visible = visible_past(p, q, pieces, tolerance, most);
      if (visible.error <= std::max(tolerance, result.error)) {
        result = {visible, AnalyticMethod::kOccluded};
        is_difference = false;
      }
    }
  }

  // Corners are known to 8 ulp.
  double given =
      movement_error(p.corners, p.front.near, q.corners) + movement_error(q.corners, q.front.near, p.corners);
  for (const std::uint32_t k : in_shaft) {
    const Piece& occluder = occluders.pieces()[k];
    given += occluder.front.near * perimeter(occluder.corners);
  }
  if (result.value > 0 || result.error > 0) result.error += given;
  if (is_difference && result.value <= result.error) {
    result.error += std::max(result.value, 0.0);
    result.value = 0;
  }
  return result;
}

}  // namespace radbake::radiosity
