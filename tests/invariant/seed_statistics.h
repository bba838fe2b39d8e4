#pragma once

#include <cstddef>
#include <vector>

#include "server/radiosity/bake/bake.h"

namespace radbake::tests {

/// Seeds of a test that compares with standard errors.
inline constexpr int kSeeds = 8;

/// A number known from kSeeds bakes.
struct Seeded {
  double mean = 0;
  double standard_error = 0;
};
Seeded seeded(const std::vector<double>& values);

/// A texel of a quad that RoomBuilder laid out, with its values from bakes that differ in their seed.
struct SeededTexel {
  std::size_t mesh = 0;
  double s0 = 0, s1 = 0, t0 = 0, t1 = 0;  ///< its footprint in shares of the quad's sides, within 0..1
  std::vector<double> values;             ///< [kSeeds] mean of the channels, lx
  std::vector<double> errors;             ///< [kSeeds] standard error that the bake states, first channel, lx
};

/// Irradiance of a texel of manufactured_room(), lx: mean of the closed form over its footprint.
double manufactured_irradiance(const Scene& room, const SeededTexel& texel);

struct SeededBakes {
  std::vector<SeededTexel> texels;
  std::vector<double> mean_irradiances;        ///< [kSeeds] the reports' own
  std::vector<radiosity::BakeReport> reports;  ///< [kSeeds]
};

/// Bakes with kSeeds seeds and collects the covered texels.
SeededBakes bake_with_seeds(const Scene& scene, radiosity::BakeOptions options);

/// Three standard errors of a mean of kSeeds values: what 0.27 % of means exceed (Student, 7 degrees of freedom).
inline constexpr double kThreeSigmaOfEight = 4.53;

/// How far the means of texels lie from what they should be, in their own standard errors.
struct Distances {
  double share_above_3 = 0;   ///< 0.020 if noise is all there is: Student, 7 degrees of freedom
  double largest_pooled = 0;  ///< in standard errors pooled over the texels
  double pooled_standard_error = 0;
};
/// Shapes: values [texels][kSeeds], expected and allowed [texels]. `allowed`: known errors that are no noise, taken off
/// first.
Distances distances(const std::vector<std::vector<double>>& values, const std::vector<double>& expected,
                    double allowed);

}  // namespace radbake::tests
