#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <vector>

#include "common/base/result.h"
#include "server/radiosity/bake/bake.h"
#include "server/radiosity/bake/checkpoints.h"
#include "server/radiosity/bake/patch_light.h"
#include "server/radiosity/bake/preparation.h"
#include "server/radiosity/bake/progress_meter.h"
#include "server/radiosity/error/light_error.h"
#include "server/radiosity/gather/gather.h"
#include "server/radiosity/gather/gather_vertices.h"
#include "server/radiosity/plan/pass_plan.h"

namespace radbake::radiosity {

/// Runs passes over a prepared scene and keeps what they add up to. One pass: replicates of the patches' system, their
/// solutions, and one more pass of lightmaps and light by vertex.
class PassRunner {
 public:
  /// `is_over`, asked from any thread: whether a pass but the first is to end with what it has.
  /// `checkpoints`: null, or where rows are kept.
  PassRunner(Preparation& prepared, ProgressMeter& progress, std::stop_token stop, std::stop_token finish,
             std::function<bool()> is_over, Checkpoints* checkpoints);

  struct Pass {
    int index = 0;
    PassSettings settings;
    double tolerance = 0;  ///< of row sums and solutions, relative; 0: as little as can be
  };
  /// What a pass took: rays for light along hemisphere rays (those of rows among them), and shadow rays of texels.
  struct Rays {
    double gathered = 0, direct = 0;
  };
  /// Adds to report and summary. Empty: the pass was given up before it had changed anything.
  /// Errors: kCancelled; kInternal where a solver did not converge.
  Result<std::optional<Rays>> run(const Pass& pass, BakeReport& report, PassSummary& summary);

  /// Patches half as long a side, and nothing gathered from the larger ones.
  void refine_patches(std::size_t max_patches);

  /// As LightmapGather's; nothing where there are no lightmaps.
  LightmapGather::Interpolation interpolation_above(double limit) const {
    return lightmaps_ ? lightmaps_->interpolation_above(limit) : LightmapGather::Interpolation{};
  }
  void stop_interpolating_above(double limit) {
    if (lightmaps_) lightmaps_->stop_interpolating_above(limit);
  }

  /// Patches of a length a side, where they are not: as an earlier attempt left them.
  void take_patches(double edge, std::size_t max_patches);

  /// What the passes add up to, but for the patches.
  template <typename Archive>
  void keep(Archive& archive) {
    archive(error_bound_);
    if (lightmaps_) lightmaps_->keep(archive);
    if (vertices_) vertices_->keep(archive);
  }

  LightError error() const;
  const std::optional<LightmapGather>& lightmaps() const { return lightmaps_; }
  const std::optional<VertexGather>& vertices() const { return vertices_; }

 private:
  Result<std::vector<PatchLight>> solve_replicates(const Pass& pass, std::uint64_t seed, BakeReport& report,
                                                   PassSummary& summary);
  double darkness_of(const std::vector<PatchLight>& light) const;
  std::vector<Vec3> averaged(const std::vector<Vec3>& radiosity);
  bool gather(const Pass& pass, std::uint64_t seed, const std::vector<PatchLight>& light, GatherCounts& counts,
              PassSummary& summary);

  Preparation& prepared_;
  const BakeOptions& options_;
  const Surfaces& surfaces_;
  ProgressMeter& progress_;
  std::stop_token stop_, finish_;
  std::function<bool()> is_over_;
  Checkpoints* const checkpoints_;
  std::optional<LightmapGather> lightmaps_;
  std::optional<VertexGather> vertices_;
  std::vector<std::uint32_t> twice_as_large_;  ///< [patches]
  double error_bound_ = 0;                     ///< of the last pass's solutions, lx
};

}  // namespace radbake::radiosity
