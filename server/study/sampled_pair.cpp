#include "server/study/sampled_pair.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "server/radiosity/threads/for_each_range.h"

namespace radbake::study {
namespace {

using radiosity::Hemicube;
using radiosity::Hit;
using radiosity::Ray;

enum Purpose : std::uint64_t { kRays = 1, kHemicubes = 2 };

constexpr int kReplicates = 16;
/// Student's t of 15 degrees of freedom, two-sided 1e-4.
constexpr double kStudent = 5.239;
/// ln(1e4): a chance of 1e-4 that so many rays are expected and none comes.
constexpr double kUnseen = 9.21;
constexpr int kRaysOfBatch = 1024;

/// Fills in the replicates on the threads; each is a function of its index.
std::array<double, kReplicates> replicated(const std::function<double(std::uint64_t)>& replicate) {
  std::array<double, kReplicates> values{};
  radiosity::for_each_range(kReplicates, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) values[k] = replicate(k);
  });
  return values;
}

SampledFormFactor with_spread(const std::array<double, kReplicates>& values, std::int64_t rays) {
  double mean = 0, squares = 0;
  for (const double value : values) mean += value / kReplicates;
  for (const double value : values) squares += (value - mean) * (value - mean) / (kReplicates - 1);
  return {mean, kStudent * std::sqrt(squares / kReplicates) + kUnseen / static_cast<double>(rays), rays};
}

}  // namespace

std::int64_t count_arrivals(const PolygonPair& pair, const SobolPoints& points, int first, int end,
                            std::uint64_t seed) {
  const auto seeds = SobolPoints::seeds_of(seed);
  const Frame frame(pair.normal());
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  std::int64_t arrivals = 0;
  for (int batch = first; batch < end; batch += kRaysOfBatch) {
    rays.clear();
    for (int i = batch; i < std::min(end, batch + kRaysOfBatch); ++i) {
      // Malley: uniform on the disk, lifted to the hemisphere.
      const double radius = std::sqrt(points.coordinate(i, 0, seeds));
      const double angle = 2 * std::numbers::pi * points.coordinate(i, 1, seeds);
      const Vec3 direction = frame.to_world(
          {radius * std::cos(angle), radius * std::sin(angle), std::sqrt(std::max(0.0, 1 - radius * radius))});
      const Vec3 origin = pair.site(points.coordinate(i, 2, seeds), points.coordinate(i, 3, seeds));
      rays.push_back({to_float(origin), to_float(direction)});
    }
    hits.resize(rays.size());
    pair.visibility().trace(rays, hits);
    for (std::size_t k = 0; k < rays.size(); ++k) arrivals += pair.shows_target(hits[k], rays[k]);
  }
  return arrivals;
}

double hemicube_form_factor(const PolygonPair& pair, const Hemicube& hemicube, Vec3 site, double turn) {
  std::vector<Ray> rays;
  std::vector<Hit> hits;
  hemicube.cast(pair.visibility(), to_float(site), pair.normal(), turn, rays, hits);
  double sum = 0;
  for (std::size_t k = 0; k < rays.size(); ++k) {
    if (pair.shows_target(hits[k], rays[k])) sum += hemicube.pixels()[k].form_factor;
  }
  return sum;
}

double hemicube_form_factor(const PolygonPair& pair, const Hemicube& hemicube, const SobolPoints& points, int sites,
                            std::uint64_t seed) {
  const auto seeds = SobolPoints::seeds_of(seed);
  double sum = 0;
  for (int i = 0; i < sites; ++i) {
    const Vec3 site = pair.site(points.coordinate(i, 0, seeds), points.coordinate(i, 1, seeds));
    sum += hemicube_form_factor(pair, hemicube, site, points.coordinate(i, 2, seeds) * std::numbers::pi / 2);
  }
  return sum / sites;
}

SampledFormFactor sampled_by_rays(const PolygonPair& pair, const SobolPoints& points, double tolerance) {
  std::array<std::int64_t, kReplicates> arrivals{};
  int done = 0;
  for (int end = 1 << 10;; end *= 4) {
    const auto shares = replicated([&](std::uint64_t k) {
      arrivals[k] += count_arrivals(pair, points, done, end, seed_of(0, kRays, k));
      return static_cast<double>(arrivals[k]) / end;
    });
    done = end;
    const SampledFormFactor found = with_spread(shares, std::int64_t{kReplicates} * end);
    if (found.stated_error <= tolerance || 4 * end > points.size()) return found;
  }
}

SampledFormFactor sampled_by_hemicubes(const PolygonPair& pair, const SobolPoints& points, double tolerance) {
  SampledFormFactor coarser;
  for (int resolution = 8;; resolution *= 2) {
    const Hemicube hemicube(resolution);
    const int sites = resolution * resolution / kReplicates;
    const auto shares = replicated([&](std::uint64_t k) {
      const std::uint64_t seed = seed_of(static_cast<std::uint64_t>(resolution), kHemicubes, k);
      return hemicube_form_factor(pair, hemicube, points, sites, seed);
    });
    const auto rays = static_cast<std::int64_t>(hemicube.pixels().size()) * sites * kReplicates;
    SampledFormFactor found = with_spread(shares, rays);
    if (resolution > 8) {
      found.stated_error += std::fabs(found.form_factor - coarser.form_factor);
      if (found.stated_error <= tolerance || 4 * sites > points.size()) return found;
    }
    coarser = found;
  }
}

}  // namespace radbake::study
