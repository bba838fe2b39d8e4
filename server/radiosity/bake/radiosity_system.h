#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "server/radiosity/bake/bake.h"
#include "server/radiosity/bake/checkpoints.h"
#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/form_factor/patch_rows.h"
#include "server/radiosity/solve/solve.h"
#include "server/radiosity/transport/operator.h"

namespace radbake::radiosity {

/// The system B' = source + rho F B' of a scene, as its plan says: form factors, how they are kept, and the light on
/// each patch. The scene's preparation outlives it.
struct RadiositySystem {
  std::unique_ptr<TransportOperator> transport;
  RadiosityProblem problem;
  std::vector<Vec3> glow, direct;        ///< [patches] E_in; H^direct with what the sky sends, lx
  std::vector<double> direct_variances;  ///< [patches]
  double emitted_lumens = 0;             ///< of the emitters, mean of the channels
  TransportSummary summary;
  std::uint64_t num_row_rays = 0, num_light_rays = 0;
  std::vector<Warning> warnings;

  /// What a streamed operator goes on using.
  std::unique_ptr<RowEstimator> estimator;
  std::unique_ptr<DirectLight> direct_light;
  std::unique_ptr<PatchSampler> sampler;
};

/// What one replicate of the system is estimated with.
struct SystemSettings {
  std::uint64_t seed = 0;
  int rays_per_row = 0;
  int light_samples = 0;  ///< shadow rays to emitters, a patch
  /// How far off row sums and the solution may be left, relative; 0: as little as can be.
  double tolerance = 0;
  Checkpoints* checkpoints = nullptr;  ///< null: none
  std::string checkpoint_prefix = {};  ///< of the names of its rows
};

/// The estimator of a plan's rows, as a channel of what is see-through meets the scene.
std::unique_ptr<RowEstimator> make_row_estimator(const Preparation& prepared, int rays_per_row, int channel);

/// Estimates the rows of a prepared scene and puts the operator together. `channel`: of what is see-through; 0 where
/// all channels meet the same.
///
/// Without interreflection there are no rows and no operator, only E_in of each patch.
/// on_row as in sample_patches(). A streamed operator stops estimating when `stop` is requested, later on too.
/// Errors: kCancelled.
Result<std::unique_ptr<RadiositySystem>> make_radiosity_system(const Preparation& prepared,
                                                               const SystemSettings& settings, int channel,
                                                               const OnRow& on_row, std::stop_token stop);

}  // namespace radbake::radiosity
