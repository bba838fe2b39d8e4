#pragma once

#include <vector>

#include "server/radiosity/bake/bake.h"

namespace radbake::tests {

/// The first lightmap of bakes that differ in their seed alone: 1, 2, ...
struct SeedMaps {
  int width = 0, height = 0;
  std::vector<std::vector<float>> values;  ///< [seeds][height * width * 4]: R, G, B, coverage
};

/// Fails the test where a bake fails.
SeedMaps maps_of_seeds(const Scene& scene, radiosity::BakeOptions options, int num_seeds);

/// The largest |a - b| of all values of equal seeds.
double largest_change(const SeedMaps& a, const SeedMaps& b);

/// The largest difference of a covered texel's means, in its standard error, over texels and channels.
///
///   |mean a - mean b| / sqrt((s_a^2 + s_b^2) / seeds + rounding^2)
///
/// s^2: the variance over seeds, pooled over the texel and those of its eight neighbours that are covered, so that it
/// is known from up to 63 degrees of freedom each. Rounding: of float32, so that maps without noise can be compared.
/// Preconditions: one layout (checked). Values of texels that either leaves uncovered are not compared.
double largest_difference(const SeedMaps& a, const SeedMaps& b);

}  // namespace radbake::tests
