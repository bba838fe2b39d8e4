#include "server/radiosity/form_factor/analytic_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/base/check.h"

namespace radbake::radiosity {
namespace {

// Up to so many occluders are all looked at: that is faster than asking the tree.
constexpr std::size_t kFewOccluders = 12;
// Of what is visible past occluders that hide each other: some ten milliseconds, so that a row can be stopped.
constexpr long kMostEvaluations = 20'000;

struct AnalyticScratch final : RowScratch {
  PatchExchanges::Scratch exchanges;
};

std::size_t place_of_pair(std::size_t i, std::size_t j) { return j * (j + 1) / 2 + i; }

}  // namespace

PatchExchanges::PatchExchanges(const Surfaces& surfaces, const Patches& patches, const Visibility& visibility,
                               double tolerance, bool keeps_all)
    : patches_(patches), visibility_(visibility), polygons_(surfaces, patches), tolerance_(tolerance) {
  RADBAKE_CHECK_LT(0.0, tolerance);
  all_occluders_.resize(polygons_.occluders().pieces().size());
  std::iota(all_occluders_.begin(), all_occluders_.end(), 0);
  if (!keeps_all) return;
  values_ = std::vector<std::atomic<double>>(place_of_pair(0, patches.size()));
  errors_ = std::vector<std::atomic<float>>(values_.size());
  for (std::atomic<double>& value : values_) value.store(std::nan(""), std::memory_order_relaxed);
}

PatchExchanges::Value PatchExchanges::between(std::uint32_t i, std::uint32_t j, Scratch& scratch) const {
  if (i > j) std::swap(i, j);
  const std::size_t place = place_of_pair(i, j);
  if (!values_.empty()) {
    const double known = values_[place].load(std::memory_order_acquire);
    if (!std::isnan(known)) return {known, errors_[place].load(std::memory_order_relaxed)};
  }
  const double tolerance = tolerance_ * std::min(patches_.area(i), patches_.area(j));
  Value value = sum(polygons_of(i), polygons_of(j), i == j, tolerance, scratch);
  // As it will be read: the error rounded up to float.
  value.error = std::nextafter(static_cast<float>(value.error), std::numeric_limits<float>::infinity());
  if (!values_.empty()) {
    errors_[place].store(static_cast<float>(value.error), std::memory_order_relaxed);
    values_[place].store(value.value, std::memory_order_release);
  }
  return value;
}

PatchExchanges::Value PatchExchanges::onto_back(std::uint32_t i, std::uint32_t j, Scratch& scratch) const {
  const double tolerance = tolerance_ * std::min(patches_.area(i), patches_.area(j));
  return sum(polygons_of(i), polygons_.back_of(j), false, tolerance, scratch);
}

PatchExchanges::Value PatchExchanges::sum(std::span<const Piece> from, std::span<const Piece> to, bool is_one_patch,
                                          double tolerance, Scratch& scratch) const {
  const auto num_pairs = static_cast<double>(from.size() * to.size());
  Value total;
  for (const Piece& p : from) {
    for (const Piece& q : to) {
      if (is_one_patch && &p == &q) continue;
      const auto is_in_front = [](const HalfSpace& plane, const PolygonCorners& corners) {
        return std::any_of(corners.begin(), corners.end(), [&](Vec3 corner) { return plane.side(corner) > 0; });
      };
      if (!is_in_front(p.front, q.corners) || !is_in_front(q.front, p.corners)) continue;
      std::span<const std::uint32_t> candidates = all_occluders_;
      if (candidates.size() > kFewOccluders) {
        find_candidates(p, q, scratch);
        candidates = scratch.candidates;
      }
      const PairExchange one =
          pair_exchange(p, q, polygons_.occluders(), candidates, tolerance / num_pairs, kMostEvaluations);
      total.value += one.value;
      total.error += one.error;
    }
  }
  return total;
}

/// Occluders in a box about the convex hull of two pieces, along the line between their middles.
void PatchExchanges::find_candidates(const Piece& p, const Piece& q, Scratch& scratch) const {
  const auto slack = [](const Piece& piece) { return 4 * piece.front.near; };
  Shaft& shaft = scratch.shaft;
  shaft.begin = mean_corner(p.corners), shaft.end = mean_corner(q.corners);
  shaft.radius = std::max(radius_about(shaft.begin, p.corners), radius_about(shaft.end, q.corners));
  shaft.half_spaces = {{p.front.normal, dot(p.front.normal, p.front.point) - slack(p)},
                       {q.front.normal, dot(q.front.normal, q.front.point) - slack(q)}};
  const Vec3 axis = shaft.end - shaft.begin;
  if (dot(axis, axis) > 0) {
    const Frame frame(normalized(axis));
    for (const Vec3 side : {frame.s, -frame.s, frame.t, -frame.t}) {
      double least = std::numeric_limits<double>::infinity();
      for (const Piece* piece : {&p, &q}) {
        for (const Vec3& corner : piece->corners) least = std::min(least, dot(side, corner));
      }
      shaft.half_spaces.push_back({side, least - slack(p) - slack(q)});
    }
  }
  visibility_.triangles_in(shaft, scratch.triangles);
  scratch.candidates.clear();
  for (const std::uint32_t t : scratch.triangles) {
    if (polygons_.occluder_of(t) != kNoBody) scratch.candidates.push_back(polygons_.occluder_of(t));
  }
  std::sort(scratch.candidates.begin(), scratch.candidates.end());
  scratch.candidates.erase(std::unique(scratch.candidates.begin(), scratch.candidates.end()), scratch.candidates.end());
}

std::unique_ptr<RowScratch> AnalyticEstimator::make_scratch() const { return std::make_unique<AnalyticScratch>(); }

void AnalyticEstimator::estimate(std::uint32_t patch, std::span<const Site> sites, std::uint64_t, RowScratch& scratch,
                                 const std::stop_token& stop, FormFactorRow& row,
                                 std::vector<std::uint8_t>& is_buried) const {
  PatchExchanges::Scratch& buffers = static_cast<AnalyticScratch&>(scratch).exchanges;
  const Patches& patches = exchanges_.patches();
  const double area = patches.area(patch);
  std::vector<FormFactorRow::Entry> entries = std::move(row.entries);
  entries.clear();
  row = {};

  // Everything that the patch faces, then the backs that no patch stands for.
  double sum = 0, absorbed = 0, error = 0;
  for (std::uint32_t j = 0; j < patches.size(); ++j) {
    if (stop.stop_requested()) return;
    const PatchExchanges::Value exchange = exchanges_.between(patch, j, buffers);
    error += exchange.error / area;
    if (!(exchange.value > 0)) continue;
    const float weight = static_cast<float>(exchange.value / area * kEqualRays);
    if (weight > 0) entries.push_back({j, weight});
    sum += exchange.value / area;
  }
  for (std::uint32_t j = 0; j < patches.num_cells(); ++j) {
    if (stop.stop_requested()) return;
    if (patches.back_of(j) != kNoPatch) continue;
    const PatchExchanges::Value exchange = exchanges_.onto_back(patch, j, buffers);
    error += exchange.error / area;
    absorbed += exchange.value / area;
  }
  is_buried.assign(sites.size(), absorbed > 0.5);
  if (absorbed > 0.5) return;
  const double missing = 1 - sum - absorbed;
  row.entries = std::move(entries);
  row.counted = kEqualRays;
  row.absorbed = absorbed * kEqualRays;
  row.escaped = missing > error ? missing * kEqualRays : 0;
  row.stated_error = error;
}

}  // namespace radbake::radiosity
