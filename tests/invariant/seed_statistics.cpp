#include "tests/invariant/seed_statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/invariant/bake_support.h"
#include "tests/scenes/cube_rooms.h"

namespace radbake::tests {

Seeded seeded(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  Seeded result;
  for (const double v : values) result.mean += v / n;
  double squares = 0;
  for (const double v : values) squares += (v - result.mean) * (v - result.mean);
  result.standard_error = std::sqrt(squares / (n - 1) / n);
  return result;
}

double manufactured_irradiance(const Scene& scene, const SeededTexel& texel) {
  const std::string& name = scene.meshes[texel.mesh].name;
  if (name == "floor") return 1;
  constexpr int kPoints = 8;
  double sum = 0;
  for (int i = 0; i < kPoints; ++i) {
    for (int j = 0; j < kPoints; ++j) {
      const double s = texel.s0 + (texel.s1 - texel.s0) * (i + 0.5) / kPoints;
      const double t = texel.t0 + (texel.t1 - texel.t0) * (j + 0.5) / kPoints;
      sum += 1 + (name == "wall" ? wall_to_floor(s, t) : ceiling_to_floor(s, t)) / 2;
    }
  }
  return sum / (kPoints * kPoints);
}

SeededBakes bake_with_seeds(const Scene& scene, radiosity::BakeOptions options) {
  SeededBakes bakes;
  for (int seed = 0; seed < kSeeds; ++seed) {
    options.seed = static_cast<std::uint64_t>(seed + 1);
    radiosity::BakeOutcome outcome = baked(scene, options);
    const radiosity::Layer& map = outcome.layers.at(0);
    std::size_t at = 0;
    for (std::size_t m = 0; m < scene.meshes.size(); ++m) {
      const Vec2 low = scene.meshes[m].texcoord1[0], size = scene.meshes[m].texcoord1[2] - low;
      for_each_covered_texel(map, [&](int x, int y, Vec3 rgb) {
        const double s0 = (static_cast<double>(x) / map.width - low.x) / size.x, ds = 1 / (map.width * size.x);
        const double t0 = (static_cast<double>(y) / map.height - low.y) / size.y, dt = 1 / (map.height * size.y);
        // Of texels on a border, those with a good part inside.
        constexpr double kPart = 0.25;
        if (s0 < -(1 - kPart) * ds || s0 > 1 - kPart * ds || t0 < -(1 - kPart) * dt || t0 > 1 - kPart * dt) return;
        if (seed == 0) {
          bakes.texels.push_back(
              {m, std::max(0.0, s0), std::min(1.0, s0 + ds), std::max(0.0, t0), std::min(1.0, t0 + dt), {}, {}});
        }
        bakes.texels.at(at).values.push_back(mean_component(rgb));
        const auto texel =
            static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) + static_cast<std::size_t>(x);
        bakes.texels.at(at++).errors.push_back(outcome.layers.back().values[4 * texel]);
      });
    }
    EXPECT_EQ(at, bakes.texels.size());
    bakes.mean_irradiances.push_back(outcome.report.energy.mean_irradiance);
    bakes.reports.push_back(std::move(outcome.report));
  }
  return bakes;
}

Distances distances(const std::vector<std::vector<double>>& values, const std::vector<double>& expected,
                    double allowed) {
  Distances result;
  const auto n = static_cast<double>(values.size());
  double variance = 0, largest = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Seeded known = seeded(values[i]);
    const double off = std::max(0.0, std::fabs(known.mean - expected[i]) - allowed);
    variance += known.standard_error * known.standard_error / n;
    largest = std::max(largest, off);
    result.share_above_3 += (off > 3 * known.standard_error ? 1 : 0) / n;
  }
  result.pooled_standard_error = std::sqrt(variance);
  result.largest_pooled = largest / result.pooled_standard_error;
  return result;
}

}  // namespace radbake::tests
