#include <algorithm>
#include <cstdint>
#include <limits>
#include <queue>

#include "server/radiosity/form_factor/analytic_exchange.h"
#include "server/radiosity/form_factor/analytic_quadrature.h"

namespace radbake::radiosity {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// An occluded patch starts from at least so many triangles: the two rules must not agree because both saw nothing. It
// is first cut along its events, up to so many: two rules may agree by chance on a triangle with a kink in it.
constexpr std::size_t kFirstTriangles = 128, kMostTrianglesByEvents = 2048;
// Lines that leave less than this share of a triangle's size on one side do not cut it.
constexpr double kSmallestCut = 1e-6;
// More occluders than this are not paired with each other for events: their lines would be more than the triangles.
constexpr std::size_t kMostPairedOccluders = 12;
// The difference of the rules is the error of the lower one; four times it is stated, for kinks that both miss alike,
// and more where an event is known to cross.
constexpr double kSafety = 4, kSafetyAtEvents = 4 * kSafety;
// Of a mismatch between a triangle and its parts: a smooth integrand's falls by more each time it is cut.
constexpr double kDoubt = 0.25;
constexpr double kRoundingOfPoint = 64 * kEpsilon;

/// What of a patch is visible from points of another, by Lambert's formula.
class VisiblePart {
 public:
  VisiblePart(const Piece& outer, const Piece& inner, std::span<const Piece> occluders)
      : normal_(outer.front.normal), inner_(inner) {
    extent_ = 0;
    for (const Vec3& a : outer.corners) {
      for (const Vec3& b : inner.corners) extent_ = std::max(extent_, length(a - b));
    }
    // PolygonCorners are known to their spacing, points of the patches to that of the scale.
    for (const Piece& occluder : occluders) {
      const double near = std::max({outer.front.near, inner.front.near, occluder.front.near, 8 * kEpsilon});
      occluders_.push_back({occluder, mean_corner(occluder.corners), near});
    }
  }

  double form_factor_from(Vec3 p) {
    parts_.clear();
    parts_.push_back(inner_.corners);
    for (const auto& [occluder, middle, near] : occluders_) {
      const int side = occluder.front.side(p);
      // Seen edge on, an occluder hides nothing.
      if (side == 0) continue;
      pyramid_.clear();
      const std::size_t n = occluder.corners.size();
      for (std::size_t k = 0; k < n; ++k) {
        const Vec3 a = occluder.corners[k] - p, b = occluder.corners[(k + 1) % n] - p;
        const Vec3 c = cross(a, b);
        const double size = length(c);
        if (size == 0) continue;
        const Vec3 inward = dot(c, middle - p) < 0 ? -c : c;
        // The plane turns by the corners' rounding over the distance of the edge's line.
        const double line_distance = size / length(b - a);
        pyramid_.push_back({p, inward / size, near, near / line_distance});
      }
      // A patch that touches the occluder's plane is behind it.
      HalfSpace behind = side > 0 ? occluder.front.reversed() : occluder.front;
      behind.point = behind.point - behind.normal * (2 * (near + behind.per_length * extent_));
      behind.near = 0, behind.per_length = 0;
      pyramid_.push_back(behind);
      remove_convex(parts_, pyramid_);
      if (parts_.empty()) return 0;
    }
    double sum = 0;
    for (const PolygonCorners& part : parts_) sum += lambert(p, part);
    return std::max(0.0, sum);
  }

 private:
  double lambert(Vec3 p, const PolygonCorners& part) const {
    double sum = 0;
    for (std::size_t k = 0; k < part.size(); ++k) {
      const Vec3 a = part[k] - p, b = part[(k + 1) % part.size()] - p, c = cross(a, b);
      const double size = length(c);
      if (size > 0) sum -= std::atan2(size, dot(a, b)) * dot(normal_, c) / size;
    }
    return sum / (2 * M_PI);
  }

  struct Occluder {
    Piece piece;
    Vec3 middle;
    double near = 0;
  };
  Vec3 normal_;
  double extent_;
  const Piece& inner_;
  std::vector<Occluder> occluders_;
  std::vector<PolygonCorners> parts_;
  std::vector<HalfSpace> pyramid_;
};

/// A line in the outer patch's plane: signed distance of (x, y) is nx x + ny y - c.
struct EventLine {
  double nx = 0, ny = 0, c = 0;
  double distance(Vec2 p) const { return nx * p.x + ny * p.y - c; }
};

/// The lines along which the visible part changes its make-up.
class EventLines {
 public:
  EventLines(const Piece& outer, const Piece& inner, std::span<const Piece> occluders) : frame_(outer.front.normal) {
    origin_ = outer.corners[0];
    for (const Vec3& corner : outer.corners) outline_.push_back(to_plane(corner));
    size_ = perimeter(outer.corners);
    for (std::size_t k = 0; k < occluders.size(); ++k) {
      add_edges_and_corners(occluders[k].corners, inner.corners);
      add_edges_and_corners(inner.corners, occluders[k].corners);
      // The occluder's own plane: past it the other side is seen.
      add_plane(occluders[k].front.point, occluders[k].front.normal);
      if (occluders.size() > kMostPairedOccluders) continue;
      for (std::size_t other = 0; other < occluders.size(); ++other) {
        if (other != k) add_edges_and_corners(occluders[k].corners, occluders[other].corners);
      }
    }
  }

  Vec2 to_plane(Vec3 p) const { return {dot(p - origin_, frame_.s), dot(p - origin_, frame_.t)}; }
  const std::vector<EventLine>& lines() const { return lines_; }

 private:
  void add_edges_and_corners(const PolygonCorners& edges, const PolygonCorners& corners) {
    for (std::size_t i = 0; i < edges.size(); ++i) {
      const Vec3 a = edges[i], ab = edges[(i + 1) % edges.size()] - a;
      for (const Vec3& corner : corners) {
        const Vec3 m = cross(ab, corner - a);
        const double size = length(m);
        if (size > kSmallestCut * length(ab) * length(corner - a)) add_plane(a, m / size);
      }
    }
  }

  void add_plane(Vec3 point, Vec3 normal) {
    EventLine line{dot(normal, frame_.s), dot(normal, frame_.t), dot(normal, point - origin_)};
    double size = std::hypot(line.nx, line.ny);
    if (size < kSmallestCut) return;
    if (line.nx < 0 || (line.nx == 0 && line.ny < 0)) size = -size;
    line = {line.nx / size, line.ny / size, line.c / size};
    double lowest = 0, highest = 0;
    for (const Vec2& corner : outline_) {
      lowest = std::min(lowest, line.distance(corner));
      highest = std::max(highest, line.distance(corner));
    }
    if (lowest > -kSmallestCut * size_ || highest < kSmallestCut * size_) return;
    const bool is_known = std::any_of(lines_.begin(), lines_.end(), [&](const EventLine& known) {
      return std::abs(known.nx - line.nx) + std::abs(known.ny - line.ny) < 1e-9 &&
             std::abs(known.c - line.c) < 1e-9 * size_;
    });
    if (!is_known) lines_.push_back(line);
  }

  Frame frame_;
  Vec3 origin_;
  std::vector<Vec2> outline_;
  double size_ = 0;
  std::vector<EventLine> lines_;
};

struct Triangle {
  Vec3 corners[3];
  double area = 0;
  double value = 0, error = 0;
  std::vector<std::uint32_t> lines;  // those that cross it
};

/// The outer integral.
class OuterIntegral {
 public:
  OuterIntegral(const Piece& outer, const Piece& inner, std::span<const Piece> occluders, long most)
      : visible_(outer, inner, occluders), events_(outer, inner, occluders) {
    std::vector<std::uint32_t> all(events_.lines().size());
    for (std::uint32_t k = 0; k < all.size(); ++k) all[k] = k;
    for (std::size_t k = 1; k + 1 < outer.corners.size(); ++k) {
      add(outer.corners[0], outer.corners[k], outer.corners[k + 1], all);
    }
    if (occluders.empty()) return;
    const std::size_t most_by_events = std::min(kMostTrianglesByEvents, static_cast<std::size_t>(most) / 64);
    for (std::size_t k = 0; k < triangles_.size() && triangles_.size() < most_by_events; ++k) {
      while (!triangles_[k].lines.empty() && triangles_.size() < most_by_events) cut(k);
    }
    // Then the largest first: its area stands in for an error that is not known yet.
    while (triangles_.size() < kFirstTriangles) {
      std::size_t largest = 0;
      for (std::size_t k = 1; k < triangles_.size(); ++k) {
        if (triangles_[k].area > triangles_[largest].area) largest = k;
      }
      cut(largest);
    }
  }

  Exchange integrate(double tolerance, long most) {
    const long a_triangle = static_cast<long>(radon_rule().size() + dunavant_rule().size());
    long evaluations = 0;
    double error = 0, value = 0;
    std::priority_queue<Ranked> ranked;
    const auto count = [&](std::size_t k, double least_error) {
      triangles_[k].error = std::max(triangles_[k].error, least_error);
      evaluations += a_triangle;
      error += triangles_[k].error;
      value += triangles_[k].value;
      ranked.push({triangles_[k].error, k});
    };
    for (std::size_t k = 0; k < triangles_.size(); ++k) {
      estimate(triangles_[k]);
      count(k, 0);
    }
    // Relative to the value, smaller differences of the rules are their rounding.
    while (error > std::max(tolerance, kRoundingOfPoint * value) && evaluations < most) {
      const std::size_t worst = ranked.top().index;
      ranked.pop();
      error -= triangles_[worst].error;
      value -= triangles_[worst].value;
      const std::size_t first_new = triangles_.size();
      const double before = triangles_[worst].value;
      cut(worst);
      estimate(triangles_[worst]);
      double after = triangles_[worst].value;
      for (std::size_t k = first_new; k < triangles_.size(); ++k) {
        estimate(triangles_[k]);
        after += triangles_[k].value;
      }
      // Where the parts do not add up to the whole, two rules that agree on a part may both miss a feature.
      const double doubt =
          kSafety * kDoubt * std::abs(after - before) / static_cast<double>(triangles_.size() - first_new + 1);
      count(worst, doubt);
      for (std::size_t k = first_new; k < triangles_.size(); ++k) count(k, doubt);
    }
    // Add up again in the order of the triangles: the running sums have drifted.
    Exchange result{0, 0, evaluations};
    double area = 0;
    for (const Triangle& triangle : triangles_) {
      result.value += triangle.value;
      result.error += triangle.error;
      area += triangle.area;
    }
    if (result.value > 0) result.error += kRoundingOfPoint * area;
    return result;
  }

 private:
  struct Ranked {
    double error;
    std::size_t index;
    bool operator<(const Ranked& other) const {
      return error != other.error ? error < other.error : index > other.index;
    }
  };

  Triangle make(Vec3 a, Vec3 b, Vec3 c, const std::vector<std::uint32_t>& candidates) const {
    Triangle triangle;
    triangle.corners[0] = a, triangle.corners[1] = b, triangle.corners[2] = c;
    triangle.area = length(cross(b - a, c - a)) / 2;
    const Vec2 pa = events_.to_plane(a), pb = events_.to_plane(b), pc = events_.to_plane(c);
    const double size = length(b - a) + length(c - a) + length(c - b);
    for (const std::uint32_t k : candidates) {
      const EventLine& line = events_.lines()[k];
      const double da = line.distance(pa), db = line.distance(pb), dc = line.distance(pc);
      const double lowest = std::min({da, db, dc}), highest = std::max({da, db, dc});
      if (lowest < -kSmallestCut * size && highest > kSmallestCut * size) triangle.lines.push_back(k);
    }
    return triangle;
  }

  void add(Vec3 a, Vec3 b, Vec3 c, const std::vector<std::uint32_t>& candidates) {
    triangles_.push_back(make(a, b, c, candidates));
  }

  void estimate(Triangle& triangle) {
    const auto sum_of = [&](std::span<const TrianglePoint> rule) {
      double sum = 0;
      for (const auto& [a, b, c, weight] : rule) {
        sum += weight *
               visible_.form_factor_from(triangle.corners[0] * a + triangle.corners[1] * b + triangle.corners[2] * c);
      }
      return sum * triangle.area;
    };
    triangle.value = sum_of(dunavant_rule());
    triangle.error =
        (triangle.lines.empty() ? kSafety : kSafetyAtEvents) * std::abs(triangle.value - sum_of(radon_rule()));
  }

  /// Replaces a triangle by its parts: along the event that halves it best, else across its longest edge.
  void cut(std::size_t index) {
    const Triangle whole = triangles_[index];
    const Vec3* x = whole.corners;
    double best_balance = 0, best_i = 0, best_j = 0;
    int best_lone = -1;
    for (const std::uint32_t k : whole.lines) {
      const EventLine& line = events_.lines()[k];
      double d[3];
      for (int i = 0; i < 3; ++i) d[i] = line.distance(events_.to_plane(x[i]));
      // The corner that is alone on its side, and where the line cuts its two edges.
      for (int lone = 0; lone < 3; ++lone) {
        const double d0 = d[lone], d1 = d[(lone + 1) % 3], d2 = d[(lone + 2) % 3];
        if (!(d0 * d1 <= 0 && d0 * d2 <= 0 && d0 != 0)) continue;
        const double i = d0 / (d0 - d1), j = d0 / (d0 - d2), balance = std::min(i * j, 1 - i * j);
        if (balance > best_balance) best_balance = balance, best_lone = lone, best_i = i, best_j = j;
      }
    }
    if (best_lone >= 0) {
      const Vec3 a = x[best_lone], b = x[(best_lone + 1) % 3], c = x[(best_lone + 2) % 3];
      const Vec3 on_ab = a + (b - a) * best_i, on_ac = a + (c - a) * best_j;
      triangles_[index] = make(a, on_ab, on_ac, whole.lines);
      // A line through a corner leaves one triangle on the other side.
      if (best_j >= 1) {
        add(on_ab, b, c, whole.lines);
      } else if (best_i >= 1) {
        add(on_ac, b, c, whole.lines);
      } else {
        add(on_ab, b, c, whole.lines);
        add(on_ab, c, on_ac, whole.lines);
      }
      return;
    }
    int longest = 0;
    for (int i = 1; i < 3; ++i) {
      if (length(x[(i + 1) % 3] - x[i]) > length(x[(longest + 1) % 3] - x[longest])) longest = i;
    }
    const Vec3 a = x[longest], b = x[(longest + 1) % 3], c = x[(longest + 2) % 3], middle = (a + b) / 2;
    triangles_[index] = make(a, middle, c, whole.lines);
    add(middle, b, c, whole.lines);
  }

  VisiblePart visible_;
  EventLines events_;
  std::vector<Triangle> triangles_;
};

}  // namespace

Exchange visible_exchange(const Piece& outer, const Piece& inner, std::span<const Piece> occluders, double tolerance,
                          long most) {
  return OuterIntegral(outer, inner, occluders, most).integrate(tolerance, most);
}

}  // namespace radbake::radiosity
