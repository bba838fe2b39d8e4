#include "server/radiosity/form_factor/adaptive.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace radbake::radiosity {
namespace {

struct AdaptiveScratch final : RowScratch {
  HemisphereEstimator::Scratch rays;
  RowSample sample;
  PatchExchanges::Scratch exchanges;
  std::vector<std::pair<std::uint32_t, double>> by_formula;  ///< ascending by patch
};

PatchExtent extent_of(const Surfaces& surfaces, const Patches& patches, std::uint32_t front) {
  PatchExtent extent;
  extent.area = patches.area(front);
  double before = 0;
  for (const Patches::Piece& piece : patches.pieces(front)) {
    for (const Vec2& uv : piece.corners) {
      const double share = (piece.area_up_to - before) / (3 * extent.area);
      extent.middle += surfaces.position({piece.triangle, uv.x, uv.y}) * share;
    }
    before = piece.area_up_to;
  }
  for (const Patches::Piece& piece : patches.pieces(front)) {
    for (const Vec2& uv : piece.corners) {
      extent.radius = std::max(extent.radius, length(surfaces.position({piece.triangle, uv.x, uv.y}) - extent.middle));
    }
  }
  return extent;
}

/// Sorted arrivals counted, those among `by_formula` left out.
double count_rest(std::vector<std::uint32_t>& arrivals, const std::vector<std::pair<std::uint32_t, double>>& by_formula,
                  std::vector<FormFactorRow::Entry>& entries) {
  std::sort(arrivals.begin(), arrivals.end());
  entries.clear();
  auto known = by_formula.begin();
  double count = 0;
  for (const std::uint32_t patch : arrivals) {
    while (known != by_formula.end() && known->first < patch) ++known;
    if (known != by_formula.end() && known->first == patch) continue;
    if (entries.empty() || entries.back().patch != patch) entries.push_back({patch, 0});
    ++entries.back().weight;
    ++count;
  }
  return count;
}

}  // namespace

bool is_near_or_large(const PatchExtent& a, const PatchExtent& b) {
  const double near = kNearEdges * std::numbers::sqrt2 * std::max(a.radius, b.radius);
  const Vec3 between = b.middle - a.middle;
  const double squared = dot(between, between);
  return squared < near * near || std::max(a.area, b.area) > kLargeShare * std::numbers::pi * squared;
}

AdaptiveEstimator::AdaptiveEstimator(const Surfaces& surfaces, const Patches& patches, const Visibility& visibility,
                                     int rays, double tolerance)
    : rays_(surfaces, patches, visibility, rays), exchanges_(surfaces, patches, visibility, tolerance, false) {
  for (std::uint32_t front = 0; front < patches.num_cells(); ++front) {
    extents_.push_back(extent_of(surfaces, patches, front));
  }
}

std::unique_ptr<RowScratch> AdaptiveEstimator::make_scratch() const { return std::make_unique<AdaptiveScratch>(); }

void AdaptiveEstimator::estimate(std::uint32_t patch, std::span<const Site> sites, std::uint64_t seed,
                                 RowScratch& scratch, const std::stop_token& stop, FormFactorRow& row,
                                 std::vector<std::uint8_t>& is_buried) const {
  auto& [rays, sample, exchanges, by_formula] = static_cast<AdaptiveScratch&>(scratch);
  rays_.sample_row(sites, seed, rays, sample);
  is_buried = sample.is_buried;
  row.counted = sample.counted;
  row.escaped = sample.escaped;
  row.absorbed = sample.absorbed;
  row.traced = sample.traced;
  row.clipped = row.stated_error = 0;

  // By formula: what is near or large, unless part of the patch lies in other geometry.
  const Patches& patches = exchanges_.patches();
  by_formula.clear();
  double known = 0;
  for (std::uint32_t j = 0; j < patches.size() && sample.visible_share == 1; ++j) {
    if (stop.stop_requested()) return;
    if (!is_near_or_large(extents_[patches.front_of(patch)], extents_[patches.front_of(j)])) continue;
    const double form_factor = exchanges_.between(patch, j, exchanges).value / patches.area(patch);
    by_formula.push_back({j, form_factor});
    known += form_factor;
  }

  // The rays that met other patches or none share the rest.
  double num_rest = count_rest(sample.arrivals, by_formula, row.entries) + sample.escaped + sample.absorbed;
  const double rest = num_rest > 0 ? std::max(0.0, 1 - known) * row.counted / num_rest : 0;
  row.clipped = std::max(0.0, known - 1) * row.counted;
  if (rest == 0) row.entries.clear();
  for (FormFactorRow::Entry& entry : row.entries) entry.weight = static_cast<float>(entry.weight * rest);
  row.escaped *= rest;
  row.absorbed *= rest;
  const double scale = (rest == 0 && known > 0 ? 1 / known : 1) * row.counted;
  for (const auto& [j, form_factor] : by_formula) {
    const float weight = static_cast<float>(form_factor * scale);
    if (weight > 0) row.entries.push_back({j, weight});
  }
  std::sort(row.entries.begin(), row.entries.end(), [](const auto& a, const auto& b) { return a.patch < b.patch; });
}

}  // namespace radbake::radiosity
