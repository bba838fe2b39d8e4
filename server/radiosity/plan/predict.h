#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/radiosity/plan/prediction.h"
#include "server/radiosity/plan/transport_choice.h"

namespace radbake::radiosity {

/// What a bake has to do and to hold, counted or, of rays that go on from where others ended, tried out.
struct BakeWork {
  double preparing_seconds = 0;  ///< CPU, as measured

  double num_rows = 0;  ///< of one channel; 0: nothing is reflected
  double rays_per_row = 0, light_rays_per_row = 0;
  double entries_per_row = 0;  ///< as estimated, before both directions are paired
  double sweeps = 0;           ///< that the solver takes, or steps that cost as much
  Transport transport = Transport::kSparse;

  double num_receivers = 0;  ///< texels and groups of vertices
  double rays_per_receiver = 0, light_rays_per_receiver = 0;

  int num_ray_channels = 1;     ///< times that rows and receivers are traced
  int num_solved_channels = 3;  ///< that one solve carries

  double scene_bytes = 0;  ///< meshes and textures as they came
  double num_triangles = 0, num_patches = 0;
  double num_pixels = 0;        ///< of all lightmaps of one layer
  double num_layers = 1;        ///< the lightmap of all light among them
  double num_vertex_bytes = 0;  ///< of light by vertex
  int threads = 1;
};

/// How far a sample's mean may be off, as a standard error over the mean.
struct CostSpread {
  double row = 0, receiver = 0;
};

/// Costs where a host has none of its own, and what is the same everywhere; measured, see plan/docs/costs.md.
inline constexpr HostCosts kUsualCosts = {.row_ray = 0.45e-6,
                                          .texel_ray = 0.45e-6,
                                          .light_ray = 0.4e-6,
                                          .row = 0,
                                          .receiver = 0,
                                          .entry_step = 6e-9,
                                          .entry = 0.35e-6};

/// A solve of one channel, over one of three: what is read is the same, what is added is a third. Measured too.
inline constexpr double kOneChannelShare = 0.6;

/// CPU seconds, wall seconds and memory of each stage and of the whole. A pure function.
///
///   form_factors   c n (row + r row_ray + l light_ray + e entry)       c: ray channels, n: rows, e: entries of a row
///   solving        c s n 2e entry_step,  streamed: s times the rows    s: sweeps, with a third for one channel
///   gathering      c m (receiver + r texel_ray + l light_ray) + pixels and layers
///   wall = CPU / (threads x efficiency) where threads share the work
///
/// The interval is 2 standard errors of the costs, and what the model itself was seen to be off by.
std::vector<StagePrediction> predict_stages(const BakeWork& work, const HostCosts& costs, const CostSpread& spread);

/// The sum of stages: memory is that of the stage that needs most.
StagePrediction total_of(const std::vector<StagePrediction>& stages);

/// Sweeps of Gauss-Seidel until the bound is met, where light keeps `passed_on` (mean reflectance times the share that
/// meets surfaces) at each reflection; other solvers are about as dear.
double expected_sweeps(double passed_on, double tolerance);

}  // namespace radbake::radiosity
