#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "server/radiosity/form_factor/analytic.h"
#include "server/radiosity/form_factor/analytic_exchange.h"

namespace radbake::radiosity {
namespace {

// Below this a stated error cannot be judged: rounding of the reference.
constexpr double kReference = 1e-12;
constexpr double kUlp = 0x1p-52;
// Visible parts are seen from points: kinks between three edges are not cut, and about 1 in 100 of these cases is off
// by more than its two rules state, by 2e-5 at most among 250.
constexpr double kMissedByPoints = 1e-4;

using Random = std::mt19937_64;

double between(Random& random, double low, double high) { return std::uniform_real_distribution(low, high)(random); }
Vec3 in_box(Random& random, Vec3 low, Vec3 high) {
  return {between(random, low.x, high.x), between(random, low.y, high.y), between(random, low.z, high.z)};
}

/// A rotation and a scaling about the origin.
struct Turn {
  Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  Vec3 of(Vec3 p) const { return x * p.x + y * p.y + z * p.z; }
};
Turn random_turn(Random& random) {
  std::normal_distribution<double> normal;
  const Frame frame(normalized({normal(random), normal(random), normal(random)}));
  const double angle = between(random, 0, 2 * M_PI), scale = std::pow(10, between(random, -3, 3));
  return {(frame.s * std::cos(angle) + frame.t * std::sin(angle)) * scale,
          (frame.t * std::cos(angle) - frame.s * std::sin(angle)) * scale, frame.n * scale};
}

/// A convex polygon about a middle, in the plane of two directions.
PolygonCorners random_polygon(Random& random, Vec3 middle, Vec3 s, Vec3 t) {
  const int n = 3 + static_cast<int>(random() % 4);
  std::vector<double> angles;
  for (int k = 0; k < n; ++k) angles.push_back(2 * M_PI * (k + between(random, -0.3, 0.3)) / n);
  PolygonCorners corners;
  for (const double angle : angles) corners.push_back(middle + s * std::cos(angle) + t * std::sin(angle));
  return corners;
}

struct Scenery {
  PolygonCorners from, to;
  std::vector<PolygonCorners> occluders;
};

void add_box(Random& random, std::vector<PolygonCorners>& occluders) {
  const Vec3 low = in_box(random, {-0.6, -0.6, 0.1}, {0.3, 0.3, 0.5});
  const Vec3 size = in_box(random, {0.1, 0.1, 0.1}, {0.6, 0.6, 0.4});
  const Vec3 x{size.x, 0, 0}, y{0, size.y, 0}, z{0, 0, size.z};
  const auto add = [&](Vec3 o, Vec3 s, Vec3 t) { occluders.push_back({o, o + s, o + s + t, o + t}); };
  add(low, x, y), add(low + z, y, x), add(low, y, z), add(low + x, z, y), add(low, z, x), add(low + y, x, z);
}

/// Two patches that face each other more or less, at times touch, and what may stand between them.
Scenery random_scenery(Random& random) {
  Scenery result;
  result.from = random_polygon(random, {0, 0, 0}, {between(random, 0.2, 1), 0, 0}, {0, between(random, 0.2, 1), 0});
  if (random() % 3 == 0) {
    // A wall at the side, down to the other's plane.
    const double x = between(random, 0.2, 1.2);
    result.to = {{x, -0.7, 0}, {x, -0.7, 1}, {x, 0.7, 1}, {x, 0.7, 0}};
  } else {
    const Vec3 tilt = in_box(random, {-0.4, -0.4, -0.4}, {0.4, 0.4, 0.4});
    result.to = random_polygon(random, in_box(random, {-0.5, -0.5, 0.8}, {0.5, 0.5, 2}), Vec3{0, 0.8, 0} + tilt,
                               Vec3{0.8, 0, 0} - tilt);
  }
  const auto num_occluders = random() % 4;
  for (std::uint64_t k = 0; k < num_occluders; ++k) {
    switch (random() % 5) {
      case 0: add_box(random, result.occluders); break;
      case 1: {
        // A fin that stands on the first patch's plane.
        const Vec3 foot = in_box(random, {-0.6, -0.6, 0}, {0.6, 0.6, 0}), side = in_box(random, {-1, -1, 0}, {1, 1, 0});
        const Vec3 up{0, 0, between(random, 0.1, 0.7)};
        result.occluders.push_back({foot, foot + side, foot + side + up, foot + up});
        break;
      }
      case 2: {
        // Two triangles that share an edge, folded.
        const auto point = [&] { return in_box(random, {-0.7, -0.7, 0.1}, {0.7, 0.7, 0.9}); };
        const Vec3 a = point(), b = point();
        result.occluders.push_back({a, b, point()});
        result.occluders.push_back({b, a, point()});
        break;
      }
      case 3: {
        // A plate in line with an edge of the first patch.
        const Vec3 a = result.from[0], b = result.from[1], up{0, 0, between(random, 0.2, 0.6)};
        result.occluders.push_back({a + up * 0.5, b + up * 0.5, b + up, a + up});
        break;
      }
      default:
        result.occluders.push_back(random_polygon(random, in_box(random, {-0.4, -0.4, 0.1}, {0.4, 0.4, 0.7}),
                                                  in_box(random, {-0.5, -0.5, -0.2}, {0.5, 0.5, 0.2}),
                                                  in_box(random, {-0.5, -0.5, -0.2}, {0.5, 0.5, 0.2})));
    }
  }
  return result;
}

bool make_piece(const PolygonCorners& corners, Piece& piece) {
  const auto front = plane_of(corners, kUlp, "a polygon");
  if (!front.ok()) return false;
  piece = {corners, *front};
  return true;
}

/// Another way to the same number: Lambert's formula of what is visible, over the first patch.
Exchange by_visible_part(const Scenery& scenery, double tolerance) {
  Piece from, to;
  std::vector<Piece> occluders;
  if (!make_piece(scenery.from, from) || !make_piece(scenery.to, to)) return {0, INFINITY, 0};
  for (const PolygonCorners& corners : scenery.occluders) {
    Piece occluder;
    if (make_piece(corners, occluder)) occluders.push_back(occluder);
  }
  Piece p{{}, from.front}, q{{}, to.front};
  clip_convex(from.corners, to.front, p.corners);
  clip_convex(to.corners, from.front, q.corners);
  if (p.corners.empty() || q.corners.empty()) return {};
  Exchange exchange = visible_exchange(p, q, occluders, tolerance * polygon_area(from.corners), 60'000);
  exchange.value /= polygon_area(from.corners);
  exchange.error /= polygon_area(from.corners);
  return exchange;
}

struct Tally {
  int num_occluded = 0, num_hidden = 0, num_compared = 0, num_unmet = 0;
};

void expect_honest(std::uint64_t seed, Tally& tally) {
  Random random(seed);
  const Scenery scenery = random_scenery(random);
  const double tolerance = seed % 3 == 0 ? 1e-6 : seed % 3 == 1 ? 1e-4 : 1e-7;
  const auto plain = polygon_form_factor(scenery.from, scenery.to, scenery.occluders, tolerance);
  if (!plain.ok()) return;  // a sliver without a plane, which is refused by name
  // Where many occluders cross each other, the error may be above what was asked: it is stated.
  const bool is_met = plain->stated_error <= 10 * tolerance;
  ASSERT_TRUE(is_met || scenery.occluders.size() >= 6) << seed;
  tally.num_unmet += !is_met;
  tally.num_occluded += plain->method == AnalyticMethod::kOccluded;
  tally.num_hidden += plain->form_factor == 0;

  // The other method, which knows nothing of lines or bodies.
  if (seed % 4 == 0) {
    const Exchange other = by_visible_part(scenery, 1e-6);
    if (other.error < kMissedByPoints) {
      ASSERT_NEAR(plain->form_factor, other.value, plain->stated_error + kMissedByPoints) << seed;
      ++tally.num_compared;
    }
  }

  // Turned and scaled, and from the other side: another frame, other cuts, other rounding.
  const Turn turn = random_turn(random);
  Scenery turned = scenery;
  for (PolygonCorners* polygon : {&turned.from, &turned.to}) {
    for (Vec3& corner : *polygon) corner = turn.of(corner);
  }
  for (PolygonCorners& polygon : turned.occluders) {
    for (Vec3& corner : polygon) corner = turn.of(corner);
    if (random() % 2 == 0) std::reverse(polygon.begin(), polygon.end());
  }
  std::shuffle(turned.occluders.begin(), turned.occluders.end(), random);
  const auto there = polygon_form_factor(turned.from, turned.to, turned.occluders, tolerance);
  const auto back = polygon_form_factor(turned.to, turned.from, turned.occluders, tolerance);
  ASSERT_TRUE(there.ok() && back.ok()) << seed;
  ASSERT_NEAR(there->form_factor, plain->form_factor, there->stated_error + plain->stated_error + kReference) << seed;
  const double ratio = polygon_area(turned.to) / polygon_area(turned.from);
  ASSERT_NEAR(there->form_factor, ratio * back->form_factor,
              there->stated_error + ratio * back->stated_error + kReference)
      << seed;
}

// The seeds are fixed: the test passes or fails for good. Errors are bounds, so no case may fail by chance.
TEST(PolygonFuzz, StatesNoErrorBelowTheTrueOneBehindRandomOccluders) {
  constexpr std::uint64_t kCases = 40;
  Tally tally;
  for (std::uint64_t seed = 1; seed <= kCases && !HasFatalFailure(); ++seed) expect_honest(seed, tally);
  EXPECT_GT(tally.num_occluded, 20);
  EXPECT_GT(tally.num_occluded - tally.num_hidden, 15);
  EXPECT_GE(tally.num_compared, 8);
  EXPECT_LE(tally.num_unmet, 2);
}

// Run by --gtest_also_run_disabled_tests: minutes.
TEST(PolygonFuzz, DISABLED_StatesNoErrorBelowTheTrueOneBehindManyRandomOccluders) {
  constexpr std::uint64_t kCases = 1000;
  Tally tally;
  for (std::uint64_t seed = 1001; seed <= 1000 + kCases && !HasFatalFailure(); ++seed) expect_honest(seed, tally);
  EXPECT_GT(tally.num_compared, 150);
}

}  // namespace
}  // namespace radbake::radiosity
