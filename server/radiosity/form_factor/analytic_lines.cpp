#include "server/radiosity/form_factor/analytic_lines.h"

#include <algorithm>
#include <array>
#include <limits>
#include <queue>

#include "server/radiosity/form_factor/analytic_quadrature.h"

namespace radbake::radiosity {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// Rounding of a term against the lengths of its edges.
constexpr double kRoundingOfTerm = 8 * kEpsilon;
constexpr int kCoarse = 4, kFine = 7;
// Of a difference between an interval and its halves: two rules that agree on a half may both miss a feature.
constexpr double kDoubt = 0.25;

/// Six times the volume between a line from x along d and an edge: above 0 where the line passes on the inside.
double side_of_line(Vec3 x, Vec3 d, Vec3 edge_start, Vec3 edge_end) {
  return dot(d, cross(edge_start - x, edge_end - edge_start));
}

/// The same to 64 bits, of corners taken as exact: where polygons have been shrunk out of one plane, what is left of
/// the volume is the shrinkage.
struct WideVec3 {
  long double x, y, z;
};
WideVec3 difference(Vec3 a, Vec3 b) {
  const auto minus = [](double p, double q) { return static_cast<long double>(p) - q; };
  return {minus(a.x, b.x), minus(a.y, b.y), minus(a.z, b.z)};
}
WideVec3 normal_through(Vec3 x, Vec3 edge_start, Vec3 edge_end) {
  const WideVec3 a = difference(edge_start, x), b = difference(edge_end, edge_start);
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A condition on lines from a(s) to b(t), bilinear in s and t: its values at t = 0 and t = 1, linear in s.
struct Condition {
  double near0, near1, far0, far1;
  double near(double s) const { return near0 + s * (near1 - near0); }
  double far(double s) const { return far0 + s * (far1 - far0); }
};

/// The lines from one edge to another that meet all conditions.
class EdgePair {
 public:
  EdgePair(Vec3 a0, Vec3 a1, Vec3 b0, Vec3 b1)
      : along_a_(a1 - a0),
        along_b_(b1 - b0),
        a_dot_b_(dot(along_a_, along_b_)),
        bb_(dot(along_b_, along_b_)),
        start_a_(dot(b0 - a0, along_a_)),
        start_b_(dot(b0 - a0, along_b_)),
        aa_(dot(along_a_, along_a_)),
        start_normal_(cross(b0 - a0, along_b_)),
        turn_normal_(cross(along_a_, along_b_)) {}

  /// int a.(I - u u')b dt over the part of b that lines from a(s) may touch.
  double at(double s, std::span<const Condition> conditions) const {
    double low = 0, high = 1;
    for (const Condition& condition : conditions) {
      const double near = condition.near(s), far = condition.far(s);
      if (near < 0 && far <= 0) return 0;
      if (near < 0) low = std::max(low, near / (near - far));
      if (far < 0) high = near > 0 ? std::min(high, near / (near - far)) : 0;
    }
    if (low >= high) return 0;
    // h = (b0 - a(s)) less its part along b; tau = 0 at its foot, in lengths of b.
    const Vec3 normal = start_normal_ - turn_normal_ * s;
    const double hh = dot(normal, normal) / bb_;
    const double foot = (start_b_ - s * a_dot_b_) / bb_;
    const double h_dot_a = start_a_ - s * aa_ - foot * a_dot_b_;
    const double tau0 = foot + low, tau1 = foot + high;
    const double rr0 = hh + tau0 * tau0 * bb_, rr1 = hh + tau1 * tau1 * bb_;
    double sum = 0;
    if (h_dot_a != 0 && rr0 > 0 && rr1 > 0) {
      const double growth = (tau1 - tau0) * (tau1 + tau0) * bb_ / rr0;
      sum -= h_dot_a / 2 * (std::abs(growth) < 0.5 ? std::log1p(growth) : std::log(rr1 / rr0));
    }
    if (a_dot_b_ != 0 && hh > 0) {
      const double h = std::sqrt(hh / bb_);
      sum += a_dot_b_ * h * std::atan2(h * (tau1 - tau0), h * h + tau0 * tau1);
    }
    return sum;
  }

  double size() const { return std::sqrt(aa_ * bb_); }

 private:
  Vec3 along_a_, along_b_;
  double a_dot_b_, bb_, start_a_, start_b_, aa_;
  Vec3 start_normal_, turn_normal_;
};

/// Where on the outer edge the part of the inner one that counts changes its make-up, ascending, with both ends.
void find_cuts(std::span<const Condition> conditions, std::vector<double>& cuts) {
  cuts.assign({0, 1});
  const auto add = [&](double s) {
    if (s > 0 && s < 1) cuts.push_back(s);
  };
  for (std::size_t i = 0; i < conditions.size(); ++i) {
    const Condition& c = conditions[i];
    if (c.near0 * c.near1 < 0) add(c.near0 / (c.near0 - c.near1));
    if (c.far0 * c.far1 < 0) add(c.far0 / (c.far0 - c.far1));
    // Two conditions end at one t where near1 far2 = near2 far1.
    for (std::size_t j = 0; j < i; ++j) {
      const Condition& k = conditions[j];
      const double at0 = c.near0 * k.far0 - k.near0 * c.far0, at1 = c.near1 * k.far1 - k.near1 * c.far1;
      const double middle = (c.near0 + c.near1) * (k.far0 + k.far1) - (k.near0 + k.near1) * (c.far0 + c.far1);
      // at0 + linear s + square s^2, by its values at 0, 1/2 (a quarter of `middle`) and 1.
      const double square = 2 * (at0 + at1) - middle, linear = at1 - at0 - square;
      const double discriminant = linear * linear - 4 * square * at0;
      if (discriminant < 0) continue;
      const double q = -(linear + std::copysign(std::sqrt(discriminant), linear)) / 2;
      if (square != 0) add(q / square);
      if (q != 0) add(at0 / q);
    }
  }
  std::sort(cuts.begin(), cuts.end());
}

class Crossing {
 public:
  explicit Crossing(std::span<const PolygonCorners> chain) : chain_(chain) {
    for (std::size_t i = 0; i < chain.size(); ++i) {
      for (std::size_t j = i + 1; j < chain.size(); ++j) add_pairs(i, j);
    }
  }

  Exchange integrate(double tolerance, long most) {
    const double wanted = 2 * M_PI * tolerance;
    double error = 0;
    std::priority_queue<Ranked> ranked;
    for (std::size_t k = 0; k < intervals_.size(); ++k) {
      estimate(intervals_[k]);
      error += intervals_[k].error;
      if (intervals_[k].error > 0) ranked.push({intervals_[k].error, k});
    }
    const long end = evaluations_ + most;
    while (error > wanted && !ranked.empty() && evaluations_ < end) {
      const std::size_t worst = ranked.top().index;
      ranked.pop();
      Interval first = intervals_[worst], second = first;
      first.end = second.begin = (first.begin + first.end) / 2;
      estimate(first), estimate(second);
      const double doubt = kDoubt / 2 * std::abs(first.value + second.value - intervals_[worst].value);
      first.error = std::max(first.error, doubt), second.error = std::max(second.error, doubt);
      error += first.error + second.error - intervals_[worst].error;
      intervals_[worst] = first;
      intervals_.push_back(second);
      if (first.end > first.begin && second.end > second.begin) {
        ranked.push({first.error, worst});
        ranked.push({second.error, intervals_.size() - 1});
      }
    }
    Exchange result{0, 0, evaluations_};
    for (const Interval& interval : intervals_) {
      result.value -= interval.value;
      result.error += interval.error + kRoundingOfTerm * pairs_[interval.pair].pair.size() * interval.width();
    }
    result.value /= 2 * M_PI, result.error /= 2 * M_PI;
    return result;
  }

 private:
  struct Bounded {
    EdgePair pair;
    std::size_t first_condition = 0, num_conditions = 0;
  };
  struct Interval {
    std::size_t pair = 0;
    double begin = 0, end = 0;
    double value = 0, error = 0;
    double width() const { return end - begin; }
  };
  struct Ranked {
    double error;
    std::size_t index;
    bool operator<(const Ranked& other) const {
      return error != other.error ? error < other.error : index > other.index;
    }
  };

  std::span<const Condition> conditions_of(const Bounded& bounded) const {
    return std::span(conditions_).subspan(bounded.first_condition, bounded.num_conditions);
  }

  /// All pairs of edges of two polygons of the chain.
  void add_pairs(std::size_t i, std::size_t j) {
    const PolygonCorners &a = chain_[i], &b = chain_[j];
    // The sides of all lines from corner to corner.
    std::size_t num_edges = 0;
    for (std::size_t m = 0; m < chain_.size(); ++m) num_edges += m == i || m == j ? 0 : chain_[m].size();
    sides_.clear();
    for (const Vec3& x : a) {
      normals_.clear();
      for (std::size_t m = 0; m < chain_.size(); ++m) {
        if (m == i || m == j) continue;
        const PolygonCorners& c = chain_[m];
        for (std::size_t k = 0; k < c.size(); ++k) {
          normals_.push_back(normal_through(x, c[k], c[k + 1 == c.size() ? 0 : k + 1]));
        }
      }
      for (const Vec3& y : b) {
        const WideVec3 d = difference(y, x);
        for (const WideVec3& n : normals_) sides_.push_back(static_cast<double>(d.x * n.x + d.y * n.y + d.z * n.z));
      }
    }
    const auto sides = [&](std::size_t x, std::size_t y) { return sides_.data() + (x * b.size() + y) * num_edges; };
    for (std::size_t x0 = 0; x0 < a.size(); ++x0) {
      const std::size_t x1 = x0 + 1 == a.size() ? 0 : x0 + 1;
      for (std::size_t y0 = 0; y0 < b.size(); ++y0) {
        const std::size_t y1 = y0 + 1 == b.size() ? 0 : y0 + 1;
        const double *s00 = sides(x0, y0), *s10 = sides(x1, y0), *s01 = sides(x0, y1), *s11 = sides(x1, y1);
        const std::size_t first = conditions_.size();
        bool is_empty = a[x0] == a[x1] || b[y0] == b[y1];
        for (std::size_t k = 0; k < num_edges && !is_empty; ++k) {
          const Condition c{s00[k], s10[k], s01[k], s11[k]};
          const auto [low, high] = std::minmax({c.near0, c.near1, c.far0, c.far1});
          is_empty = high <= 0;
          if (low < 0) conditions_.push_back(c);
        }
        if (is_empty) {
          conditions_.resize(first);
          continue;
        }
        add_intervals({EdgePair(a[x0], a[x1], b[y0], b[y1]), first, conditions_.size() - first});
      }
    }
  }

  void add_intervals(const Bounded& bounded) {
    find_cuts(conditions_of(bounded), cuts_);
    for (std::size_t k = 0; k + 1 < cuts_.size(); ++k) {
      const double begin = cuts_[k], width = cuts_[k + 1] - begin;
      // Where no line counts at one point between two cuts, none does at others.
      const auto is_empty_at = [&](double share) {
        ++evaluations_;
        return bounded.pair.at(begin + width * share, conditions_of(bounded)) == 0;
      };
      if (width > 0 && !(is_empty_at(0.5) && is_empty_at(0.2))) {
        intervals_.push_back({pairs_.size(), begin, cuts_[k + 1]});
      }
    }
    pairs_.push_back(bounded);
  }

  void estimate(Interval& interval) {
    const Bounded& bounded = pairs_[interval.pair];
    const auto sum_of = [&](int n) {
      double sum = 0;
      for (const auto& [node, weight] : gauss_legendre(n)) {
        sum += weight * bounded.pair.at(interval.begin + interval.width() * node, conditions_of(bounded));
      }
      evaluations_ += n;
      return sum * interval.width();
    };
    interval.value = sum_of(kFine);
    interval.error = std::abs(interval.value - sum_of(kCoarse));
  }

  std::span<const PolygonCorners> chain_;
  std::vector<Bounded> pairs_;
  std::vector<Condition> conditions_;
  std::vector<Interval> intervals_;
  std::vector<double> sides_, cuts_;
  std::vector<WideVec3> normals_;
  long evaluations_ = 0;
};

}  // namespace

Exchange crossing_exchange(std::span<const PolygonCorners> chain, double tolerance, long most) {
  return Crossing(chain).integrate(tolerance, most);
}

Passage passage_of(const PolygonCorners& first, const PolygonCorners& last, const PolygonCorners& between) {
  bool is_through = true;
  for (std::size_t k = 0; k < between.size(); ++k) {
    const Vec3 start = between[k], end = between[k + 1 == between.size() ? 0 : k + 1];
    bool any_inside = false, any_outside = false;
    for (const Vec3& x : first) {
      for (const Vec3& y : last) {
        const double side = side_of_line(x, y - x, start, end);
        any_inside = any_inside || side > 0;
        any_outside = any_outside || side < 0;
      }
    }
    if (!any_inside) return Passage::kBeside;
    is_through = is_through && !any_outside;
  }
  return is_through ? Passage::kThrough : Passage::kPartly;
}

PolygonCorners shrunk(const PolygonCorners& corners, double share) {
  const Vec3 middle = mean_corner(corners);
  PolygonCorners result;
  for (const Vec3& corner : corners) result.push_back(corner + (middle - corner) * share);
  return result;
}

}  // namespace radbake::radiosity
