#include "tests/invariant/seed_maps.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/base/check.h"
#include "tests/invariant/bake_support.h"
#include "tests/invariant/seed_statistics.h"

namespace radbake::tests {
namespace {

/// Mean and variance of each value over the seeds.
struct Moments {
  std::vector<double> means, variances;

  explicit Moments(const SeedMaps& maps) : means(maps.values[0].size(), 0), variances(means) {
    for (std::size_t k = 0; k < means.size(); ++k) {
      std::vector<double> values;
      for (const std::vector<float>& map : maps.values) values.push_back(map[k]);
      const Seeded known = seeded(values);
      means[k] = known.mean;
      variances[k] = known.standard_error * known.standard_error * static_cast<double>(values.size());
    }
  }
};

/// Texels that every map covers.
std::vector<bool> covered_in(const SeedMaps& maps) {
  std::vector<bool> is_covered(maps.values[0].size() / 4, true);
  for (const std::vector<float>& map : maps.values) {
    for (std::size_t k = 0; k < is_covered.size(); ++k) is_covered[k] = is_covered[k] && map[4 * k + 3] > 0;
  }
  return is_covered;
}

}  // namespace

SeedMaps maps_of_seeds(const Scene& scene, radiosity::BakeOptions options, int num_seeds) {
  SeedMaps maps;
  for (int seed = 1; seed <= num_seeds; ++seed) {
    options.seed = static_cast<std::uint64_t>(seed);
    const radiosity::BakeOutcome outcome = baked(scene, options);
    const radiosity::Layer& layer = outcome.layers.at(0);
    maps.width = layer.width;
    maps.height = layer.height;
    maps.values.push_back(layer.values);
  }
  return maps;
}

double largest_change(const SeedMaps& a, const SeedMaps& b) {
  RADBAKE_CHECK_EQ(a.values.size(), b.values.size());
  double largest = 0;
  for (std::size_t seed = 0; seed < a.values.size(); ++seed) {
    RADBAKE_CHECK_EQ(a.values[seed].size(), b.values[seed].size());
    for (std::size_t k = 0; k < a.values[seed].size(); ++k) {
      largest = std::max<double>(largest, std::fabs(a.values[seed][k] - b.values[seed][k]));
    }
  }
  return largest;
}

double largest_difference(const SeedMaps& a, const SeedMaps& b) {
  RADBAKE_CHECK_EQ(a.width, b.width);
  RADBAKE_CHECK_EQ(a.height, b.height);
  RADBAKE_CHECK_EQ(a.values.size(), b.values.size());
  const auto num_seeds = static_cast<double>(a.values.size());
  const Moments of_a(a), of_b(b);
  std::vector<bool> is_covered = covered_in(a);
  const std::vector<bool> in_b = covered_in(b);
  for (std::size_t k = 0; k < in_b.size(); ++k) is_covered[k] = is_covered[k] && in_b[k];

  double largest = 0;
  const auto at = [&](int x, int y) { return static_cast<std::size_t>(y) * static_cast<std::size_t>(a.width) + x; };
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      if (!is_covered[at(x, y)]) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        double variance = 0, count = 0;
        for (int ny = std::max(0, y - 1); ny <= std::min(a.height - 1, y + 1); ++ny) {
          for (int nx = std::max(0, x - 1); nx <= std::min(a.width - 1, x + 1); ++nx) {
            if (!is_covered[at(nx, ny)]) continue;
            const std::size_t k = 4 * at(nx, ny) + c;
            variance += of_a.variances[k] + of_b.variances[k];
            ++count;
          }
        }
        const std::size_t k = 4 * at(x, y) + c;
        const double rounding =
            std::numeric_limits<float>::epsilon() * std::max(std::fabs(of_a.means[k]), std::fabs(of_b.means[k]));
        const double error = std::sqrt(variance / count / num_seeds + rounding * rounding);
        const double difference = std::fabs(of_a.means[k] - of_b.means[k]);
        if (difference > 0) largest = std::max(largest, difference / error);
      }
    }
  }
  return largest;
}

}  // namespace radbake::tests
