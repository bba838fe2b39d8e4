#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace radbake::radiosity {

/// What one pass over the whole map spends, all replicates together.
struct PassSettings {
  int rays_per_row = 0;
  int patch_light_samples = 0;  ///< shadow rays to emitters, a patch
  int rays_per_texel = 0;       ///< of texels that gather alone
  int rays_per_node = 0;        ///< of texels that others are interpolated from
  int light_samples = 0;        ///< shadow rays to emitters, a texel; where they adapt, their mean
  double gathered_weight = 0;   ///< against other passes

  bool operator==(const PassSettings&) const = default;
};

/// How large a pass is against the first of its kind; enough to run it again.
struct PassScale {
  double gathered = 1, direct = 1;
  /// Patches half as long a side as before; gathered light starts anew, what earlier passes gathered is dropped.
  bool refines_patches = false;
  /// Texels that are off by more than this because they are interpolated gather alone from now on, share of the mean
  /// irradiance; 0: none but those that did.
  double interpolation_limit = 0;

  bool operator==(const PassScale&) const = default;
};

/// Where the error stands after a pass, as shares of the mean irradiance, and what it took.
struct PassResults {
  double error = 0;  ///< estimated relative RMSE, all parts
  double direct_sampling = 0, gathered_sampling = 0, discretisation = 0, algebraic = 0;
  double direct_deviation = 0;                    ///< of one shadow sample, mean over texels that adapt; 0: they do not
  double direct_effort = 0, gathered_effort = 0;  ///< scales of all passes so far, added up
  double direct_rays = 0, gathered_rays = 0;      ///< of all passes so far, added up
  int num_passes = 0;
  double last_direct_scale = 0, last_gathered_scale = 0;
  double last_seconds = 0;   ///< wall, of the last pass
  double fixed_seconds = 0;  ///< of it, what a pass of any size takes
  double seconds_left = -1;  ///< of a time budget; negative: there is none
  bool can_refine_patches = false;
  /// Of `discretisation`, what goes where the texels that are off by more than `interpolation_limit` gather alone, and
  /// how many more do; 0: too few to matter.
  double refinable_interpolation = 0, interpolation_limit = 0;
  std::uint64_t num_refinable_texels = 0, num_texels = 0;  ///< of all that count
};

/// A pass of a scale: 1 is the first pass, the coarsest that tells its own error. `patch_growth`: patches now over
/// those of the first pass. What a texel gathers is a mean over all patches that it sees, so that their rows share the
/// rays that fewer had.
PassSettings pass_of(const PassScale& scale, double patch_growth = 1);

struct NextPass {
  PassScale scale;
  double predicted_error = 0;
  /// Of the work that is left to reach the target (or to fill the budget), this pass's share.
  double share_of_rest = 1;
  double rest = 0;                ///< that work, in shadow rays
  bool can_reach_target = false;  ///< the patches' size and interpolation leave room for sampling
  double fixed_error = 0;         ///< what no number of rays goes below
};

/// Why there is no other pass. Empty: what was asked holds.
struct NoPass {
  std::string limited_by;
};

/// The next pass towards a target, as cheap as the errors so far say: sampling errors fall with the square root of the
/// effort, and the direct and the gathered part get what buys the most (the least cost c_d N_d + c_g N_g at which
/// S_d / N_d + S_g / N_g is what the other errors leave of the target). It aims at 0.8 x the target and is done at 0.9.
/// Where the patches' size leads the error, or interpolation, the pass has patches half as long, or more texels that
/// gather alone: towards a target where it takes fewer rays by far then or is not reached else, within a budget where
/// more can be gathered in the time left than is dropped. Each pass takes at most three times what all before it took;
/// within a budget, the last one fills what is left. Time decides only how large a pass is and whether there is one.
/// `no_pass` says why there is none. Preconditions: max_error > 0 or results.seconds_left >= 0.
std::optional<NextPass> plan_next_pass(const PassResults& results, double max_error, NoPass& no_pass);

}  // namespace radbake::radiosity
