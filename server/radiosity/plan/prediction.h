#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/radiosity/survey/effects.h"

namespace radbake::radiosity {

/// What things cost on a host, CPU seconds each; 0: not known. Field for field radbake.v1.HostCosts.
struct HostCosts {
  double row_ray = 0;     ///< a hemisphere ray of a patch's row
  double texel_ray = 0;   ///< a hemisphere ray of a texel
  double light_ray = 0;   ///< a shadow ray
  double row = 0;         ///< a row beside its rays
  double receiver = 0;    ///< a texel or vertex beside its rays
  double entry_step = 0;  ///< reading one form factor once
  double entry = 0;       ///< putting one form factor into the operator
};

/// Field for field radbake.v1.StagePrediction.
struct StagePrediction {
  std::string stage;
  double cpu_seconds = 0;
  double cpu_seconds_low = 0, cpu_seconds_high = 0;  ///< 95 % of bakes are expected within
  double wall_seconds = 0;
  std::uint64_t memory_bytes = 0;
};

/// Field for field radbake.v1.MeshPrediction.
struct MeshPrediction {
  std::string mesh;
  double cpu_seconds = 0;
  std::uint64_t num_texels = 0, num_patches = 0;
};

struct EffectSeconds {
  Effect effect = Effect::kEmitters;
  double cpu_seconds = 0;  ///< that it costs where it is on, or would cost where it is off
};

/// What a bake is expected to take. Field for field radbake.v1.Prediction. Measured costs are behind it: no part of
/// what equal bakes share.
struct Prediction {
  std::vector<StagePrediction> stages;
  StagePrediction total;
  std::vector<MeshPrediction> costliest;  ///< up to 3
  std::vector<EffectSeconds> effects;
  std::string source;  ///< pilot, stored
  double pilot_seconds = 0;
};

}  // namespace radbake::radiosity
