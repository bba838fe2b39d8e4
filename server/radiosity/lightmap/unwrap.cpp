#include "server/radiosity/lightmap/unwrap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

#include "server/radiosity/lightmap/clusters.h"

namespace radbake::radiosity {
namespace {

const double kMaxHalfAngle = std::acos(1 / (kMaxStretch * kMaxStretch));
/// Light changes at a sharper edge: charts end there.
constexpr double kMaxFold = 40 * std::numbers::pi / 180;
/// Triangles that share less of the smaller one meet by rounding only.
constexpr double kOverlapTolerance = 1e-9;

/// Corners of the convex hull, counter-clockwise. Source: Andrew 1979 (monotone chain).
std::vector<Vec2> convex_hull(std::vector<Vec2> points) {
  std::sort(points.begin(), points.end(), [](Vec2 a, Vec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  std::vector<Vec2> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const std::size_t first = hull.size();
    for (const Vec2 p : points) {
      while (hull.size() >= first + 2 && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0) {
        hull.pop_back();
      }
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

struct Box {
  Vec2 low, high;
  double area() const { return (high.x - low.x) * (high.y - low.y); }
};

/// The box of points along two orthogonal unit vectors.
Box box_along(const std::vector<Vec2>& points, Vec2 s, Vec2 t) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Box box{{kFar, kFar}, {-kFar, -kFar}};
  for (const Vec2 p : points) {
    const Vec2 q{dot(s, p), dot(t, p)};
    box.low = {std::min(box.low.x, q.x), std::min(box.low.y, q.y)};
    box.high = {std::max(box.high.x, q.x), std::max(box.high.y, q.y)};
  }
  return box;
}

/// Fills in the projection of a chart: its axes, box and stretch.
void lay_flat(const Surfaces& surfaces, Vec3 axis, Chart& chart) {
  double least_cosine = 1;
  std::vector<Vec2> points;
  const Frame frame(axis);
  for (const std::uint32_t t : chart.triangles) {
    least_cosine = std::min(least_cosine, dot(surfaces.normals[t], axis));
    for (const Vec3 p : surfaces.corners[t]) points.push_back({dot(frame.s, p), dot(frame.t, p)});
  }
  // The smallest box has a side along an edge of the hull. Source: Freeman & Shapira 1975.
  const std::vector<Vec2> hull = convex_hull(std::move(points));
  Vec2 best_s{1, 0};
  double best_area = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < hull.size(); ++k) {
    const Vec2 edge = hull[(k + 1) % hull.size()] - hull[k];
    const double size = std::sqrt(dot(edge, edge));
    if (size == 0) continue;
    const Vec2 s = edge * (1 / size);
    // A clear gain only: rounding must not choose between the two ways to turn a rectangle.
    const double area = box_along(hull, s, {s.y, -s.x}).area();
    if (area < best_area * (1 - 1e-9)) {
      best_area = area;
      best_s = s;
    }
  }
  // The second axis points down when the front is looked at, as rows do.
  Vec2 best_t{best_s.y, -best_s.x};
  Box box = box_along(hull, best_s, best_t);
  if (box.high.y - box.low.y > box.high.x - box.low.x) {
    best_s = std::exchange(best_t, best_s * -1);
    box = box_along(hull, best_s, best_t);
  }
  const double scale = 1 / std::sqrt(std::max(least_cosine, 0.1));
  chart.u = (frame.s * best_s.x + frame.t * best_s.y) * scale;
  chart.v = (frame.s * best_t.x + frame.t * best_t.y) * scale;
  chart.low = box.low * scale;
  chart.size = (box.high - box.low) * scale;
  chart.stretch = std::max(scale, 1 / (scale * least_cosine));
}

/// Takes the triangles that lie on others out of the chart, in its order, and returns them.
std::vector<std::uint32_t> take_overlapping(const Surfaces& surfaces, Chart& chart) {
  std::vector<PlaneTriangle> flat;
  for (const std::uint32_t t : chart.triangles) flat.push_back(chart.corners(surfaces, t));
  PlaneGrid grid(flat);
  std::vector<std::uint32_t> kept, taken;
  for (std::uint32_t k = 0; k < flat.size(); ++k) {
    bool is_free = true;
    grid.for_each_near(flat[k], [&](std::uint32_t other) {
      const double smaller = std::min(std::fabs(twice_area(flat[k])), std::fabs(twice_area(flat[other]))) / 2;
      is_free = shared_area(flat[k], flat[other]) <= kOverlapTolerance * smaller;
      return is_free;
    });
    (is_free ? kept : taken).push_back(chart.triangles[k]);
    if (is_free) grid.insert(k, flat[k]);
  }
  chart.triangles = std::move(kept);
  return taken;
}

/// A box that grows.
struct GrowingBox {
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  Vec2 low{kFar, kFar}, high{-kFar, -kFar};

  void add(Vec2 p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  double padded_area(double margin) const { return (high.x - low.x + 2 * margin) * (high.y - low.y + 2 * margin); }
};

/// A line across a chart: triangles whose centroid lies beyond it make the second part.
struct ChartCut {
  int axis = 0;
  double at = 0;
  bool is_beyond(const PlaneTriangle& c) const {
    const Vec2 sum = c[0] + c[1] + c[2];
    return (axis == 0 ? sum.x : sum.y) > 3 * at;
  }
};

/// The cut that leaves the smallest boxes, if it saves enough.
std::optional<ChartCut> best_cut(const std::vector<PlaneTriangle>& flat, Vec2 size, double margin) {
  constexpr double kWorthwhile = 0.93;
  double best_area = kWorthwhile * (size.x + 2 * margin) * (size.y + 2 * margin);
  std::optional<ChartCut> best;
  for (const int axis : {0, 1}) {
    for (const double share : {0.15, 0.25, 1.0 / 3, 0.5, 2.0 / 3, 0.75, 0.85}) {
      const ChartCut cut{axis, share * (axis == 0 ? size.x : size.y)};
      GrowingBox parts[2];
      bool is_used[2] = {false, false};
      for (const PlaneTriangle& triangle : flat) {
        const bool is_beyond = cut.is_beyond(triangle);
        is_used[is_beyond] = true;
        for (const Vec2 corner : triangle) parts[is_beyond].add(corner);
      }
      if (!is_used[0] || !is_used[1]) continue;
      const double area = parts[0].padded_area(margin) + parts[1].padded_area(margin);
      if (area >= best_area) continue;
      best_area = area;
      best = cut;
    }
  }
  return best;
}

/// Cuts a chart as long as that saves room, and adds the parts to the charts.
void add_parts(const Surfaces& surfaces, Vec3 axis, double margin, Chart chart, std::vector<Chart>& charts) {
  std::vector<Chart> waiting;
  waiting.push_back(std::move(chart));
  while (!waiting.empty()) {
    Chart next = std::move(waiting.back());
    waiting.pop_back();
    std::vector<PlaneTriangle> flat;
    for (const std::uint32_t t : next.triangles) flat.push_back(next.corners(surfaces, t));
    const std::optional<ChartCut> cut = best_cut(flat, next.size, margin);
    if (!cut) {
      charts.push_back(std::move(next));
      continue;
    }
    Chart parts[2];
    for (std::size_t k = 0; k < flat.size(); ++k) {
      parts[cut->is_beyond(flat[k])].triangles.push_back(next.triangles[k]);
    }
    for (Chart& part : parts) {
      lay_flat(surfaces, axis, part);
      waiting.push_back(std::move(part));
    }
  }
}

}  // namespace

std::vector<Chart> unwrap(const Surfaces& surfaces, std::uint32_t begin, std::uint32_t end, double margin) {
  std::vector<Chart> charts;
  for (Cluster& cluster : cluster_triangles(surfaces, begin, end, kMaxHalfAngle, kMaxFold)) {
    // What lies on the chart becomes the next chart, until nothing does; the first triangle always stays.
    std::vector<std::uint32_t> rest = std::move(cluster.triangles);
    while (!rest.empty()) {
      Chart chart;
      chart.triangles = std::move(rest);
      lay_flat(surfaces, cluster.axis, chart);
      rest = take_overlapping(surfaces, chart);
      if (!rest.empty()) lay_flat(surfaces, cluster.axis, chart);
      add_parts(surfaces, cluster.axis, margin, std::move(chart), charts);
    }
  }
  return charts;
}

}  // namespace radbake::radiosity
