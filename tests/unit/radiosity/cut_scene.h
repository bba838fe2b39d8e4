#pragma once

#include <memory>
#include <utility>

#include "server/radiosity/patches/patches.h"
#include "server/radiosity/survey/survey.h"

namespace radbake::radiosity {

/// A scene cut into patches, with its tree. Kept in place: its parts refer to each other.
struct CutScene {
  Scene scene;
  SurveyedScene surveyed;
  std::unique_ptr<Visibility> visibility;
  Patches patches;

  CutScene(Scene s, double edge_metres, std::size_t max_patches)
      : scene(std::move(s)),
        surveyed(survey_scene(scene).value()),
        visibility(make_embree_visibility(surveyed.surfaces.corners)),
        patches(make_patches(surveyed.surfaces, *visibility,
                             {edge_metres / surveyed.surfaces.metres_per_unit, max_patches})) {}
};

}  // namespace radbake::radiosity
