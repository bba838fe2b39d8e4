#include <algorithm>

#include "server/radiosity/form_factor/analytic_lines.h"
#include "server/radiosity/form_factor/analytic_pair.h"

namespace radbake::radiosity {
namespace {

class PassingFinder {
 public:
  PassingFinder(const Piece& p, const Piece& q, const Occluders& occluders)
      : p_(p), q_(q), occluders_(occluders), q_reversed_(reversed(q.corners)) {}

  Passings& found() { return found_; }

  void find(std::uint32_t k) {
    const Piece& occluder = occluders_.pieces()[k];
    const Reach in_front_of_p = reach_of(occluder.corners, p_.front);
    const Reach in_front_of_q = reach_of(occluder.corners, q_.front);
    if (!in_front_of_p.front || !in_front_of_q.front) return;
    const Reach p_side = reach_of(p_.corners, occluder.front), q_side = reach_of(q_.corners, occluder.front);
    const bool enters = p_side.front && q_side.back, leaves = p_side.back && q_side.front;
    if (!enters && !leaves) return;
    PolygonCorners between = part_inside(occluder.corners, p_.front, in_front_of_p.back);
    if (!between.empty()) between = part_inside(between, q_.front, in_front_of_q.back);
    if (between.empty()) return;

    // Lines that start outside of a body are counted where they enter it, others where they leave it.
    const std::uint32_t body = occluders_.body_of(k);
    bool reaches = false;
    Places places{body, Place::kOutside, Place::kOutside};
    if (body != kNoBody) places = places_of_patches(body);
    if (enters) reaches = add(k, between, false, p_side, q_side, body == kNoBody || places.p == Place::kOutside);
    if (leaves) reaches |= add(k, between, true, p_side, q_side, body == kNoBody || places.p != Place::kOutside);
    if (!reaches) return;
    found_.in_shaft.push_back(k);
    if (places.p == Place::kAcross || places.q == Place::kAcross) {
      found_.tangled_body = std::min(found_.tangled_body, body);
    } else if (places.p != places.q) {
      found_.hides_all = true;
    }
  }

 private:
  struct Places {
    std::uint32_t body;
    Place p, q;
  };

  /// Returns whether lines pass; they are noted down where they count.
  bool add(std::uint32_t k, const PolygonCorners& between, bool leaves, Reach p_side, Reach q_side, bool counts) {
    const Piece& occluder = occluders_.pieces()[k];
    const HalfSpace ahead = leaves ? occluder.front : occluder.front.reversed();
    const bool cuts_p = leaves ? p_side.front : p_side.back, cuts_q = leaves ? q_side.back : q_side.front;
    const std::uint32_t body = occluders_.body_of(k);
    Passing passing;
    passing.p = part_inside(p_.corners, ahead.reversed(), cuts_p);
    passing.q = part_inside(q_reversed_, ahead, cuts_q);
    if (passing.p.empty() || passing.q.empty()) return false;
    passing.between = leaves ? between : reversed(between);
    passing.ahead = ahead;
    passing.item = body == kNoBody ? static_cast<std::uint32_t>(occluders_.pieces().size()) + k : body;
    const Passage passage = passage_of(passing.p, passing.q, passing.between);
    if (passage == Passage::kBeside) return false;
    if (!counts) return true;
    found_.hides_all = found_.hides_all || (passage == Passage::kThrough && !cuts_p && !cuts_q);

    // What others in the same plane hide is hidden once.
    std::vector<PolygonCorners> parts = {passing.between};
    for (const Passing& other : found_.all) {
      if (dot(other.ahead.normal, ahead.normal) <= 0 || !lies_in(other.between, ahead)) continue;
      std::vector<HalfSpace> hole;
      for (std::size_t i = 0; i < other.between.size(); ++i) {
        const Vec3 a = other.between[i], b = other.between[(i + 1) % other.between.size()];
        const Vec3 inward = cross(ahead.normal, b - a);
        if (length(inward) > 0) hole.push_back({a, normalized(inward), ahead.near, ahead.near / length(b - a)});
      }
      remove_convex(parts, hole);
    }
    for (PolygonCorners& part : parts) {
      passing.between = std::move(part);
      found_.all.push_back(passing);
    }
    return true;
  }

  static bool lies_in(const PolygonCorners& corners, const HalfSpace& plane) {
    return std::all_of(corners.begin(), corners.end(), [&](Vec3 corner) { return plane.side(corner) == 0; });
  }

  Places places_of_patches(std::uint32_t body) {
    for (const Places& known : places_) {
      if (known.body == body) return known;
    }
    places_.push_back({body, place_of(p_, occluders_, body), place_of(q_, occluders_, body)});
    return places_.back();
  }

  const Piece& p_;
  const Piece& q_;
  const Occluders& occluders_;
  PolygonCorners q_reversed_;
  Passings found_;
  std::vector<Places> places_;
};

}  // namespace

Passings find_passings(const Piece& p, const Piece& q, const Occluders& occluders,
                       std::span<const std::uint32_t> candidates) {
  PassingFinder finder(p, q, occluders);
  for (const std::uint32_t k : candidates) {
    finder.find(k);
    if (finder.found().hides_all) break;
  }
  return std::move(finder.found());
}

}  // namespace radbake::radiosity
