#include "common/base/sequence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace radbake {
namespace {

// The first points of the unscrambled sequence in one dimension are the bit-reversed integers; scrambling keeps nets.
TEST(SobolPoints, PutsOnePointInEachIntervalOfEachDimension) {
  constexpr int kPoints = 256;
  const SobolPoints points(kPoints);
  for (const std::uint64_t seed : {0ull, 1ull, 12345ull}) {
    const auto seeds = SobolPoints::seeds_of(seed);
    for (int dimension = 0; dimension < SobolPoints::kDimensions; ++dimension) {
      std::set<int> intervals;
      for (int i = 0; i < kPoints; ++i) {
        intervals.insert(static_cast<int>(points.coordinate(i, dimension, seeds) * kPoints));
      }
      EXPECT_EQ(intervals.size(), kPoints) << "dimension " << dimension << ", seed " << seed;
    }
  }
}

// Dimensions 0 and 1 are a (0, 2)-sequence: every elementary rectangle of area 1/n holds one of each run of n points.
TEST(SobolPoints, AreANetInTheFirstTwoDimensionsInEveryAlignedRun) {
  constexpr int kPoints = 256, kRun = 64;
  const SobolPoints points(kPoints);
  const auto seeds = SobolPoints::seeds_of(99);
  for (int first = 0; first < kPoints; first += kRun) {
    for (int columns = 1; columns <= kRun; columns *= 2) {
      std::set<std::pair<int, int>> rectangles;
      for (int i = first; i < first + kRun; ++i) {
        rectangles.emplace(static_cast<int>(points.coordinate(i, 0, seeds) * columns),
                           static_cast<int>(points.coordinate(i, 1, seeds) * (kRun / columns)));
      }
      EXPECT_EQ(rectangles.size(), kRun) << "run at " << first << ", " << columns << " columns";
    }
  }
}

// The error of a smooth integral falls faster than the 1/sqrt(n) of independent points.
TEST(SobolPoints, IntegrateASmoothFunctionFasterThanIndependentPoints) {
  constexpr int kPoints = 1024, kSeeds = 32;
  const SobolPoints points(kPoints);
  double squares = 0;
  for (int s = 0; s < kSeeds; ++s) {
    const auto seeds = SobolPoints::seeds_of(seed_of(7, 1, s));
    double sum = 0;
    for (int i = 0; i < kPoints; ++i) {
      const double x = points.coordinate(i, 0, seeds), y = points.coordinate(i, 1, seeds);
      sum += std::sin(3 * x) * y;
    }
    const double exact = (1 - std::cos(3.0)) / 3 * 0.5;
    squares += std::pow(sum / kPoints - exact, 2);
  }
  const double standard_deviation_of_one = 0.31;  // of sin(3x) y over the square, by quadrature
  EXPECT_LT(std::sqrt(squares / kSeeds), 0.05 * standard_deviation_of_one / std::sqrt(kPoints));
}

TEST(SeedOf, TellsRowsAndPurposesApart) {
  std::set<std::uint64_t> seeds;
  for (std::uint64_t purpose = 0; purpose < 8; ++purpose) {
    for (std::uint64_t index = 0; index < 1000; ++index) seeds.insert(seed_of(1, purpose, index));
  }
  EXPECT_EQ(seeds.size(), 8000u);
}

}  // namespace
}  // namespace radbake
