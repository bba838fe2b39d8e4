#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "client/options/bake_options.h"
#include "server/study/form_factor_study.h"

namespace radbake::study {

/// What the program's exit says. Part of the interface: never renumbered.
enum ExitCode : int {
  kDone = 0,
  kNotWritten = 1,  ///< a result, or its plot
  kUsage = 2,
  kBadInput = 3,  ///< cases or a scene that cannot be read
  kFailed = 4,    ///< a bake
};

/// Cases in a file, and what is asked of them.
struct CaseChoices {
  std::string cases;
  double tolerance = 0;
  std::string json;       ///< file to write; empty: none
  std::string estimator;  ///< of form factors
};

/// A scene's file, and the folder for what is found.
struct SceneChoices {
  std::string scene;
  std::string folder;
  double tolerance = 0;  ///< of solvers
  options::BakeChoices bake;
};

/// What `accuracy` measures against.
struct AccuracyChoices {
  SceneChoices scene;
  std::string reference;  ///< EXR; empty: baked
  double reference_scale = 1;
  double reference_error = 0;     ///< relative RMSE of the file
  int reference_rays = 0;         ///< of the baked one; 0: as ReferenceEffort has it
  double bake_limit_seconds = 0;  ///< of a fixed setting; 0: as AccuracySweep has it
};

/// What `view` draws.
struct ViewChoices {
  std::string folder;   ///< of a bake
  std::string picture;  ///< PNG
  std::string camera;   ///< empty: default_camera()
  std::string size = "960x640";
  int samples = 3;
  double exposure = 0;
  std::vector<double> background;  ///< nit; empty: black
};

/// Each runs a command, prints its table on stdout and its errors on stderr.
ExitCode run_form_factors(const CaseChoices& choices);
ExitCode run_enclosures(const CaseChoices& choices);
ExitCode run_rates(const std::string& cases, const std::string& folder);
ExitCode run_convergence(const SceneChoices& choices);
ExitCode run_bake(const SceneChoices& choices);
ExitCode run_accuracy(const AccuracyChoices& choices);
ExitCode run_view(const ViewChoices& choices);

}  // namespace radbake::study
