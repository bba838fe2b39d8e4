#include "server/radiosity/error/light_error.h"

#include <algorithm>
#include <cmath>

#include "server/radiosity/threads/for_each_range.h"

namespace radbake::radiosity {
namespace {

/// 97.5 % quantile of Student's t, three degrees of freedom.
constexpr double kStudent3 = 3.182;
constexpr int kReplicates = 4;

double squared(double x) { return x * x; }

/// Means over the 3 x 3 neighbours that are valid, `rounds` times: a chart keeps to itself, since charts stand apart.
/// Shapes: values [rows * width * channels].
void pool(const std::vector<TexelFacts>& facts, std::size_t width, int channels, int rounds,
          std::vector<float>& values) {
  const std::size_t rows = facts.size() / width;
  const auto num_channels = static_cast<std::size_t>(channels);
  std::vector<float> pooled(values.size());
  for (int round = 0; round < rounds; ++round) {
    for_each_range(rows, 8, [&](std::size_t begin, std::size_t end) {
      for (std::size_t y = begin; y < end; ++y) {
        for (std::size_t x = 0; x < width; ++x) {
          const std::size_t at = y * width + x;
          if (facts[at].state != TexelState::kValid) continue;
          std::array<float, 3> sum{};
          int num = 0;
          for (std::size_t ny = y > 0 ? y - 1 : 0; ny <= std::min(y + 1, rows - 1); ++ny) {
            for (std::size_t nx = x > 0 ? x - 1 : 0; nx <= std::min(x + 1, width - 1); ++nx) {
              const std::size_t n = ny * width + nx;
              if (facts[n].state != TexelState::kValid) continue;
              for (std::size_t c = 0; c < num_channels; ++c) sum[c] += values[n * num_channels + c];
              ++num;
            }
          }
          for (std::size_t c = 0; c < num_channels; ++c) {
            pooled[at * num_channels + c] = sum[c] / static_cast<float>(num);
          }
        }
      }
    });
    values.swap(pooled);
  }
}

/// Squares of the discretisation error by cell, means over neighbouring cells, no longer negative. lx^2.
std::vector<float> discretisation_squares(const LightmapGather& gather) {
  const LightEstimate& estimate = gather.estimate();
  const std::size_t across = gather.cells_across(), down = estimate.num_cells() / across;
  std::vector<float> squares(estimate.num_cells());
  for (std::size_t cy = 0; cy < down; ++cy) {
    for (std::size_t cx = 0; cx < across; ++cx) {
      double sum = 0;
      int num = 0;
      for (std::size_t ny = cy > 0 ? cy - 1 : 0; ny <= std::min(cy + 1, down - 1); ++ny) {
        for (std::size_t nx = cx > 0 ? cx - 1 : 0; nx <= std::min(cx + 1, across - 1); ++nx) {
          const std::size_t n = ny * across + nx;
          if (!gather.has_light(n)) continue;
          sum += squared(kPatchShare) * estimate.patch_square(n) + estimate.interpolation_square(n);
          ++num;
        }
      }
      squares[cy * across + cx] = num > 0 ? static_cast<float>(std::max(0.0, sum / num)) : 0.0f;
    }
  }
  return squares;
}

}  // namespace

LightError estimate_error(const LightEstimate& estimate, const std::function<bool(std::size_t)>& counts,
                          const std::function<std::size_t(std::size_t)>& cell_of, double algebraic_bound,
                          double spread) {
  double light = 0, direct = 0, gathered = 0, discrete = 0, deviations = 0;
  LightError out;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    if (!counts(i)) continue;
    ++out.num_receivers;
    light += mean_component(estimate.irradiance(i));
    direct += mean_component(estimate.direct_variance(i));
    gathered += mean_component(estimate.gathered_variance(i));
    deviations += std::sqrt(mean_component(estimate.direct_variance(i)) * estimate.direct_weight(i));
    const std::size_t cell = cell_of(i);
    discrete += squared(kPatchShare) * estimate.patch_square(cell) + estimate.interpolation_square(cell);
  }
  if (out.num_receivers == 0 || !(light > 0)) return out;
  const auto num = static_cast<double>(out.num_receivers);
  out.mean_irradiance = light / num;
  const auto relative = [&](double sum) { return std::sqrt(std::max(0.0, sum / num)) / out.mean_irradiance; };
  out.direct_sampling = relative(direct);
  out.gathered_sampling = relative(gathered);
  out.sampling = relative(direct + gathered);
  // The root of a variance from four values is small by this in the mean.
  constexpr double kRootOfFour = 0.9213;
  out.direct_deviation = deviations / num / kRootOfFour / out.mean_irradiance;
  out.discretisation = relative(discrete);
  out.algebraic = algebraic_bound / out.mean_irradiance;
  const double fixed = squared(out.algebraic);
  out.relative_rmse = std::sqrt(squared(out.sampling) + squared(out.discretisation) + fixed);
  // What the replicates decide together, they do not see: what part of a texel counts. Measured, their spread is within
  // this share of what bakes are off by (tests/bench/bench_targets.py).
  constexpr double kUnseen = 0.05;
  // Direct light is independent from texel to texel: only the gathered part's square varies by much.
  const double half = kStudent3 * std::sqrt(1 + 1.0 / kReplicates) * spread;
  const double low = squared(out.direct_sampling) + squared(out.gathered_sampling) * std::max(0.0, 1 - half);
  const double high = squared(out.direct_sampling) + squared(out.gathered_sampling) * (1 + half);
  out.low = std::sqrt(squared(1 - kUnseen) * low + squared(out.discretisation / 2));
  out.high = std::sqrt(squared(1 + kUnseen) * high + squared(2 * out.discretisation) + fixed);
  return out;
}

LightError estimate_error(const LightmapGather& gather, double algebraic_bound) {
  const std::vector<TexelFacts>& facts = gather.facts();
  return estimate_error(
      gather.estimate(), [&](std::size_t i) { return facts[i].counts(); },
      [&](std::size_t i) { return gather.cell_of(i); }, algebraic_bound, gather.relative_spread());
}

std::vector<float> standard_errors(const LightmapGather& gather) {
  // How far variances are pooled: direct light's change from texel to texel at the border of a shadow, what is
  // interpolated between nodes has few independent values.
  constexpr int kDirectRounds = 1, kGatheredRounds = 4;
  constexpr double kRounding = 0x1p-20;  // of single precision, over a few operations
  const LightEstimate& estimate = gather.estimate();
  const std::vector<TexelFacts>& facts = gather.facts();
  const auto width = static_cast<std::size_t>(gather.atlas().width());
  std::vector<float> direct(3 * facts.size()), gathered(direct);
  for (std::size_t i = 0; i < facts.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      direct[3 * i + static_cast<std::size_t>(c)] = static_cast<float>(estimate.direct_variance(i)[c]);
      gathered[3 * i + static_cast<std::size_t>(c)] = static_cast<float>(estimate.gathered_variance(i)[c]);
    }
  }
  pool(facts, width, 3, kDirectRounds, direct);
  pool(facts, width, 3, kGatheredRounds, gathered);
  const std::vector<float> discrete = discretisation_squares(gather);
  std::vector<float> out(4 * facts.size());
  for (std::size_t i = 0; i < facts.size(); ++i) {
    if (facts[i].state != TexelState::kValid) continue;
    const Vec3 irradiance = estimate.irradiance(i);
    for (int c = 0; c < 3; ++c) {
      const std::size_t k = 3 * i + static_cast<std::size_t>(c);
      const double square = static_cast<double>(direct[k]) + gathered[k] + discrete[gather.cell_of(i)] +
                            squared(kRounding * irradiance[c]);
      out[4 * i + static_cast<std::size_t>(c)] = static_cast<float>(std::sqrt(square));
    }
    out[4 * i + 3] = facts[i].counts() ? facts[i].coverage : 0.0f;
  }
  return out;
}

WorstPlace find_worst(const LightmapGather& gather, const std::vector<float>& errors, double mean_irradiance) {
  const std::vector<TexelFacts>& facts = gather.facts();
  const auto square_of = [&](std::size_t i) {
    return (squared(errors[4 * i]) + squared(errors[4 * i + 1]) + squared(errors[4 * i + 2])) / 3;
  };
  std::vector<float> squares;
  for (std::size_t i = 0; i < facts.size(); ++i) {
    if (facts[i].counts()) squares.push_back(static_cast<float>(square_of(i)));
  }
  WorstPlace worst;
  if (squares.empty() || !(mean_irradiance > 0)) return worst;
  const auto rank = static_cast<std::ptrdiff_t>(squares.size() - 1 - squares.size() / 100);
  std::nth_element(squares.begin(), squares.begin() + rank, squares.end());
  const float least = squares[static_cast<std::size_t>(rank)];

  // The part of the map with the largest sum of them, and the worst texel there.
  constexpr std::size_t kPart = 32;
  const auto width = static_cast<std::size_t>(gather.atlas().width());
  const std::size_t parts_across = (width + kPart - 1) / kPart;
  std::vector<double> sums((facts.size() / width / kPart + 1) * parts_across, 0);
  const auto part_of = [&](std::size_t i) { return i / width / kPart * parts_across + i % width / kPart; };
  double sum = 0;
  std::size_t num = 0;
  for (std::size_t i = 0; i < facts.size(); ++i) {
    if (!facts[i].counts() || static_cast<float>(square_of(i)) < least) continue;
    sum += square_of(i);
    sums[part_of(i)] += square_of(i);
    ++num;
  }
  worst.error = std::sqrt(sum / static_cast<double>(num)) / mean_irradiance;
  const auto part = static_cast<std::size_t>(std::max_element(sums.begin(), sums.end()) - sums.begin());
  double largest = -1;
  for (std::size_t i = 0; i < facts.size(); ++i) {
    if (!facts[i].counts() || part_of(i) != part || square_of(i) <= largest) continue;
    largest = square_of(i);
    worst.texel = i;
  }
  return worst;
}

std::vector<std::uint8_t> light_levels(const LightmapGather& gather, int mean_samples, int most_samples) {
  const LightEstimate& estimate = gather.estimate();
  const std::vector<TexelFacts>& facts = gather.facts();
  std::vector<float> deviations(facts.size());
  for (std::size_t i = 0; i < facts.size(); ++i) {
    if (facts[i].state != TexelState::kValid) continue;
    deviations[i] = static_cast<float>(mean_component(estimate.direct_variance(i)) * estimate.direct_weight(i));
  }
  pool(facts, static_cast<std::size_t>(gather.atlas().width()), 1, 1, deviations);
  double sum = 0;
  std::size_t num = 0;
  for (std::size_t i = 0; i < facts.size(); ++i) {
    deviations[i] = facts[i].state == TexelState::kValid ? std::sqrt(deviations[i]) : 0.0f;
    sum += deviations[i];
    num += facts[i].state == TexelState::kValid;
  }
  const double mean = num > 0 ? sum / static_cast<double>(num) : 0;
  const double each = static_cast<double>(mean_samples) / kReplicates;
  const double most = std::log2(std::max(1.0, static_cast<double>(most_samples) / kReplicates));
  std::vector<std::uint8_t> levels(facts.size(),
                                   static_cast<std::uint8_t>(std::lround(std::log2(std::max(1.0, each)))));
  // Levels are whole numbers, none below 0: the factor that makes their mean right is found by trying.
  double factor = 1;
  constexpr int kTries = 4;
  for (int attempt = 0; attempt < kTries && mean > 0; ++attempt) {
    double total = 0;
    for (std::size_t i = 0; i < facts.size(); ++i) {
      if (facts[i].state != TexelState::kValid) continue;
      const double wanted = factor * each * deviations[i] / mean;
      levels[i] = static_cast<std::uint8_t>(std::lround(std::clamp(std::log2(std::max(wanted, 1.0)), 0.0, most)));
      total += std::exp2(levels[i]);
    }
    factor *= each * static_cast<double>(num) / total;
  }
  return levels;
}

}  // namespace radbake::radiosity
