#pragma once

#include <memory>
#include <optional>
#include <stop_token>

#include "common/base/result.h"
#include "server/radiosity/gather/vertex_groups.h"
#include "server/radiosity/lightmap/atlas.h"
#include "server/radiosity/patches/patches.h"
#include "server/radiosity/plan/plan.h"
#include "server/radiosity/survey/surface_opacity.h"
#include "server/radiosity/survey/survey.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// A scene that is ready to be baked: checked, laid out and cut into patches. Parts refer to each other: kept in place.
struct Preparation {
  BakeOptions options;  ///< as asked, without outputs whose effect is off
  SurveyedScene surveyed;
  std::unique_ptr<SurfaceOpacity> opacity;  ///< null: all is opaque
  std::unique_ptr<Visibility> visibility;
  std::unique_ptr<Visibility> unblocked;  ///< where occlusion is not simulated
  std::optional<Atlas> atlas;             ///< where lightmaps are wanted
  std::optional<VertexGroups> groups;     ///< where light by vertex is wanted
  Patches patches;
  std::vector<std::uint8_t> reached_backs;  ///< [patches], of find_reached_backs()
  double patch_edge = 0;                    ///< wanted length of a patch's side, scene units
  BakePlan plan;

  /// 3 where a tinted sheet stops channels by different shares: each then has rows of its own.
  int num_ray_channels() const { return opacity && surveyed.surfaces.has_coloured_tint() ? 3 : 1; }
  /// What direct light and parts of receivers ask for what stands between.
  const Visibility& shadows() const { return unblocked ? *unblocked : *visibility; }
};

/// Errors: as plan_scene().
Result<std::unique_ptr<Preparation>> prepare_scene(const Scene& scene, const BakeOptions& options,
                                                   std::stop_token stop);

}  // namespace radbake::radiosity
