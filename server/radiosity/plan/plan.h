#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/scene.h"
#include "server/radiosity/survey/survey.h"

namespace radbake::radiosity {

/// What a user may ask for. Zero means: choose.
struct BakeOptions {
  int atlas_size = 0;           ///< texels along a side, 64..4096; 0: the smallest power of two that gives texels_per_meter
  double texels_per_meter = 0;  ///< 0: 32
  int rays = 0;                 ///< hemisphere rays a texel; a patch's row gets the same
  int max_patches = 0;
  std::uint64_t seed = 0;
  int threads = 0;  ///< 0: all cores; changes no result
};

/// What a bake will do. Field for field radbake.v1.Plan.
struct BakePlan {
  Survey survey;
  int atlas_size = 0;
  std::uint64_t num_texels = 0;  ///< inside charts
  std::uint64_t num_patches = 0;
  int rays_per_texel = 0;
  int rays_per_row = 0;
  int light_samples_per_texel = 0;
  std::string estimator;
  std::string transport;
  std::string solver;
  double texels_per_meter = 0;  ///< median over the lit triangles
  std::vector<Warning> warnings;
};

}  // namespace radbake::radiosity
