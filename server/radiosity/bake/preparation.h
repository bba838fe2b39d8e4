#pragma once

#include <memory>
#include <optional>
#include <stop_token>

#include "common/base/result.h"
#include "server/radiosity/gather/vertex_groups.h"
#include "server/radiosity/lightmap/atlas.h"
#include "server/radiosity/patches/patches.h"
#include "server/radiosity/plan/plan.h"
#include "server/radiosity/survey/survey.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// A scene that is ready to be baked: checked, laid out and cut into patches. Parts refer to each other: kept in place.
struct Preparation {
  SurveyedScene surveyed;
  std::unique_ptr<Visibility> visibility;
  std::optional<Atlas> atlas;          ///< where lightmaps are wanted
  std::optional<VertexGroups> groups;  ///< where light by vertex is wanted
  Patches patches;
  BakePlan plan;
};

/// Errors: as plan_scene().
Result<std::unique_ptr<Preparation>> prepare_scene(const Scene& scene, const BakeOptions& options,
                                                   std::stop_token stop);

}  // namespace radbake::radiosity
