#include <algorithm>
#include <limits>

#include "server/radiosity/form_factor/analytic_exchange.h"
#include "server/radiosity/form_factor/analytic_quadrature.h"

namespace radbake::radiosity {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// Rounding of a term against its size: a dozen operations, half an ulp each.
constexpr double kRoundingOfTerm = 6 * kEpsilon;
// Where two rules differ by less, more points only add rounding.
constexpr double kConverged = 4 * kEpsilon;
constexpr int kFinestLevel = 7;
// Relative difference of two orders at which the kernel ends: the error of the lower one. That of the higher one, which
// is kept, is smaller by what an order gains, a factor of ten or more.
constexpr double kKernelError = 1e-10;

struct Edge {
  Vec3 a, b, u;
  double length = 0;
};

std::vector<Edge> edges_of(const PolygonCorners& corners) {
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 a = corners[i], b = corners[(i + 1) % corners.size()];
    const double l = length(b - a);
    if (l > 0) edges.push_back({a, b, (b - a) / l, l});
  }
  return edges;
}

double log_primitive(double t, double squared) { return squared > 0 ? t * (std::log(squared) / 2 - 1) : 0; }

/// int over the edge of ln |x - p|.
double log_integral(Vec3 p, const Edge& edge) {
  const Vec3 ra = edge.a - p, rb = edge.b - p, middle = (ra + rb) / 2;
  // From further than two lengths the closed form cancels, and 10 points leave 8^-20.
  if (dot(middle, middle) > 4 * edge.length * edge.length) {
    double sum = 0;
    for (const auto& [node, weight] : gauss_legendre(10)) {
      const Vec3 r = ra + edge.u * (node * edge.length);
      sum += weight * std::log(dot(r, r));
    }
    return sum * edge.length / 2;
  }
  const double ta = dot(ra, edge.u), tb = dot(rb, edge.u);
  const double aa = dot(ra, ra), bb = dot(rb, rb);
  const double d = length(cross(aa < bb ? ra : rb, edge.u));
  return log_primitive(tb, bb) - log_primitive(ta, aa) + d * (std::atan2(tb, d) - std::atan2(ta, d));
}

/// One pair of edges: the inner integral in closed form, seen from points of the outer edge.
class EdgePair {
 public:
  EdgePair(const Edge& outer, const Edge& inner) : outer_(outer), inner_(inner) {}

  Exchange integrate() {
    Exchange whole = gauss(0, outer_.length);
    if (whole.error <= kConverged * outer_.length * inner_.length) return with_evaluations(whole);
    Exchange sum;
    double left = 0;
    for (const double right : closest_points()) {
      Exchange part = gauss(left, right);
      if (part.error > kConverged * outer_.length * inner_.length) part = tanh_sinh(left, right);
      sum.value += part.value;
      sum.error += part.error;
      left = right;
    }
    return with_evaluations(sum);
  }

 private:
  double at(double s) {
    ++evaluations_;
    return log_integral(outer_.a + outer_.u * s, inner_);
  }

  Exchange with_evaluations(Exchange exchange) const {
    exchange.evaluations = evaluations_;
    return exchange;
  }

  Exchange gauss(double left, double right) {
    double coarse = 0, fine = 0;
    for (const auto& [node, weight] : gauss_legendre(8)) coarse += weight * at(left + (right - left) * node);
    for (const auto& [node, weight] : gauss_legendre(16)) fine += weight * at(left + (right - left) * node);
    return {fine * (right - left), std::abs(fine - coarse) * (right - left), 0};
  }

  /// x = 1/(1 + exp(pi sinh t)): halves the step until two levels agree.
  Exchange tanh_sinh(double left, double right) {
    constexpr double kLastT = 3.2;  // there the weight is below 1e-15
    const double width = right - left;
    double sum = at((left + right) / 2) * M_PI / 4, before = 0, step = 1;
    Exchange result;
    for (int level = 0; level <= kFinestLevel; ++level) {
      // Add the points that the level before does not have.
      const double first = level == 0 ? step : step / 2, stride = step;
      if (level > 0) step /= 2;
      for (double t = first; t <= kLastT; t += stride) {
        const double share = 1 / (1 + std::exp(M_PI * std::sinh(t)));
        const double weight = M_PI * std::cosh(t) * share * (1 - share);
        sum += weight * (at(left + width * share) + at(right - width * share));
      }
      result = {sum * step * width, std::abs(sum * step - before) * width, 0};
      if (level >= 3 && result.error <= kConverged * outer_.length * inner_.length) break;
      before = sum * step;
    }
    return result;
  }

  /// Where on the outer edge the ends and the line of the inner one are nearest, and the outer edge's end.
  std::vector<double> closest_points() const {
    const double cosine = dot(outer_.u, inner_.u);
    const Vec3 from_inner = outer_.a - inner_.a;
    std::vector<double> candidates = {dot(inner_.a - outer_.a, outer_.u), dot(inner_.b - outer_.a, outer_.u)};
    const double sine_squared = 1 - cosine * cosine;
    if (sine_squared > kEpsilon) {
      candidates.push_back((cosine * dot(from_inner, inner_.u) - dot(from_inner, outer_.u)) / sine_squared);
    }
    std::vector<double> points;
    for (const double s : candidates) {
      if (s > kEpsilon * outer_.length && s < outer_.length * (1 - kEpsilon)) points.push_back(s);
    }
    points.push_back(outer_.length);
    std::sort(points.begin(), points.end());
    return points;
  }

  const Edge& outer_;
  const Edge& inner_;
  long evaluations_ = 0;
};

struct WeightedPoint {
  Vec3 position;
  double area = 0;
};

/// Gauss rules on a piece: a product on a parallelogram, else a conical product on each triangle of a fan.
std::vector<WeightedPoint> area_points(const Piece& piece, int n) {
  std::vector<WeightedPoint> points;
  const PolygonCorners& x = piece.corners;
  const auto rule = gauss_legendre(n);
  if (x.size() == 4 && x[0] - x[1] == x[3] - x[2]) {
    const Vec3 s = x[1] - x[0], t = x[3] - x[0];
    const double area = length(cross(s, t));
    for (const auto& [u, weight_u] : rule) {
      for (const auto& [v, weight_v] : rule) points.push_back({x[0] + s * u + t * v, weight_u * weight_v * area});
    }
    return points;
  }
  for (std::size_t k = 1; k + 1 < x.size(); ++k) {
    const Vec3 ab = x[k] - x[0], ac = x[k + 1] - x[0];
    const double twice_area = length(cross(ab, ac));
    for (const auto& [u, weight_u] : rule) {
      for (const auto& [v, weight_v] : rule) {
        points.push_back({x[0] + ab * (u * (1 - v)) + ac * (u * v), weight_u * weight_v * u * twice_area});
      }
    }
  }
  return points;
}

}  // namespace

Exchange contour_exchange(const Piece& p, const Piece& q) {
  const std::vector<Edge> outer = edges_of(p.corners), inner = edges_of(q.corners);
  Exchange sum;
  double sizes = 0;
  for (const Edge& e : outer) {
    for (const Edge& f : inner) {
      const double cosine = dot(e.u, f.u);
      if (cosine == 0) continue;
      const Exchange pair = EdgePair(e, f).integrate();
      sum.value += cosine * pair.value;
      sum.error += std::abs(cosine) * pair.error;
      sum.evaluations += pair.evaluations;
      sizes += std::abs(cosine * pair.value) + std::abs(cosine) * e.length * f.length;
    }
  }
  const double factor = 1 / (2 * M_PI);
  return {sum.value * factor, (sum.error + kRoundingOfTerm * sizes) * factor, sum.evaluations};
}

bool is_far(const Piece& p, const Piece& q) {
  const Vec3 a = mean_corner(p.corners), b = mean_corner(q.corners);
  return length(a - b) >= 3 * (radius_about(a, p.corners) + radius_about(b, q.corners));
}

Exchange kernel_exchange(const Piece& p, const Piece& q) {
  Exchange result;
  double before = 0;
  for (const int n : {2, 3, 4, 5, 6, 7, 8, 10, 12}) {
    const std::vector<WeightedPoint> points_p = area_points(p, n), points_q = area_points(q, n);
    double sum = 0;
    for (const WeightedPoint& x : points_p) {
      double row = 0;
      for (const WeightedPoint& y : points_q) {
        const Vec3 r = y.position - x.position;
        const double squared = dot(r, r);
        row -= y.area * dot(p.front.normal, r) * dot(q.front.normal, r) / (squared * squared);
      }
      sum += x.area * row;
    }
    result.value = sum / M_PI;
    result.error = std::abs(result.value - before) + 16 * kEpsilon * std::abs(result.value);
    result.evaluations += static_cast<long>(points_p.size() * points_q.size());
    before = result.value;
    if (n > 2 && result.error <= kKernelError * std::abs(result.value)) break;
  }
  return result;
}

}  // namespace radbake::radiosity
