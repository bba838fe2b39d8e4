#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/image/write_image.h"
#include "common/base/result.h"
#include "common/scene/scene.h"
#include "server/radiosity/bake/bake.h"

namespace radbake::study {

/// What a fixed setting is varied in.
enum class AccuracyAxis {
  kRays,              ///< rays a texel, all texels gather
  kInterpolatedRays,  ///< rays of the texels that gather, the light between is interpolated
  kSpacing,           ///< texels from one that gathers to the next
  kLightSamples,
  kPatches,
  kFormFactors,
  kSolver,
  kBalanced,  ///< rays and light samples together
};
inline constexpr AccuracyAxis kAllAccuracyAxes[] = {
    AccuracyAxis::kRays,    AccuracyAxis::kInterpolatedRays, AccuracyAxis::kSpacing, AccuracyAxis::kLightSamples,
    AccuracyAxis::kPatches, AccuracyAxis::kFormFactors,      AccuracyAxis::kSolver,  AccuracyAxis::kBalanced};
const char* accuracy_axis_name(AccuracyAxis axis);

/// A bake of one pass.
struct FixedSetting {
  AccuracyAxis axis = AccuracyAxis::kRays;
  std::string value;  ///< of what is varied: "64", "hemicube"
  radiosity::BakeOptions options;
};

/// What is swept.
struct AccuracySweep {
  radiosity::BakeOptions base;  ///< of progressive bakes
  std::vector<FixedSetting> settings;
  std::vector<double> targets;      ///< of progressive bakes, as fractions
  std::vector<double> budgets;      ///< of others, wall seconds
  double bake_limit_seconds = 120;  ///< what takes longer is left out
};

/// Some forty settings about the middle of each range, and progressive bakes: to 10, 5, 2 and 1 %, for 1, 5 and 20 s.
AccuracySweep default_sweep(const radiosity::BakeOptions& base);

/// What the others are measured against: lightmaps of all sheets, one below the other.
struct AccuracyReference {
  image::Pixels map;
  double error = 0;    ///< relative RMSE of its own sampling; 0: not known
  std::string origin;  ///< in words, how it was made
  double cpu_seconds = 0;
  bool is_ours = true;  ///< texels at borders are compared too: both average the same part of them
};

/// How dense a bake is that others are measured against. Shares of what the method allows are left to whoever asks.
struct ReferenceEffort {
  int rays = 8192;
  int light_samples = 4096;
  int max_patches = 65536;
};

/// Bakes a reference: two seeds, all texels gather, patches of a quarter of the usual side, form factors of near pairs
/// by formula (`adaptive`), or by hemicubes above 2000 patches and where light passes surfaces, which formulas do not
/// know.
///
///   reference = (a + b) / 2        its error = rms(a - b) / 2 / mean
///
/// What both have in common is not in this error: what is left of the size of their patches. Errors: as bake_scene().
Result<AccuracyReference> make_reference(const Scene& scene, const radiosity::BakeOptions& base,
                                         const ReferenceEffort& effort);

/// Where a bake stood.
struct AccuracyPoint {
  double cpu_seconds = 0, seconds = 0;
  double difference = 0;  ///< relative RMSE against the reference, as measured
  double error = 0;       ///< sqrt(difference^2 - reference error^2)
  double stated = 0;      ///< the bake's own estimate; 0: it has none
};

struct AccuracyRun {
  std::optional<FixedSetting> setting;  ///< absent: progressive
  double target = 0;                    ///< of a progressive bake, relative RMSE; 0: none
  double budget = 0;                    ///< of a progressive bake, wall seconds; 0: none
  std::vector<AccuracyPoint> points;    ///< one, or one a pass
};

struct AccuracyStudy {
  std::string scene;
  std::uint64_t num_texels = 0, num_compared = 0;
  int threads = 0;
  std::string instruction_set;
  AccuracyReference reference;
  std::vector<AccuracyRun> runs;
  std::vector<std::string> left_out;  ///< settings and why: refused by the bake
};

/// Sheets of a bake one below the other, with a row between them that nothing covers.
image::Pixels stacked_lightmaps(const std::vector<radiosity::Layer>& layers);

/// Bakes a scene by every setting of a sweep and measures each map against the reference.
///
/// CPU seconds are the least of some equal bakes, three where they are short: what else the machine does only adds.
/// `on_bake(done, total, what)` is told before each setting.
/// Errors: as bake_scene() where no setting bakes; kInvalidArgument where the reference has another size.
Result<AccuracyStudy> study_accuracy(const Scene& scene, const AccuracySweep& sweep, AccuracyReference reference,
                                     const std::function<void(std::size_t, std::size_t, const std::string&)>& on_bake);

/// "rays 64, spacing 4, 32 light samples": what is not the server's default.
std::string setting_words(const radiosity::BakeOptions& options);

}  // namespace radbake::study
