#include "server/radiosity/plan/pass_plan.h"

#include <algorithm>
#include <cmath>

namespace radbake::radiosity {
namespace {

/// The pass of scale 1.
constexpr double kRaysPerRow = 32, kPatchLightSamples = 16, kRaysPerTexel = 32, kRaysPerNode = 128, kLightSamples = 16;
constexpr double kMostRays = 65536;
constexpr double kReplicates = 4;

constexpr double kAim = 0.8, kDone = 0.9;
/// A ray that finds the nearest surface and the patch there, its share of rows and solver with it, takes this many
/// shadow rays' time.
constexpr double kRayCost = 4;
/// Passes add at most this many times what was spent, so that the map improves as one looks on.
constexpr double kGrowth = 3;
constexpr int kMostPasses = 64;
/// Of the time left, what a pass may be predicted to take.
constexpr double kSafeShare = 0.9;
/// What a ray of a later pass takes, over one of the first.
constexpr double kLaterSeconds = 0.7;
/// A pass that adds less than this share to what was spent is not worth its fixed costs.
constexpr double kLeastGrowth = 0.1;

int whole(double wanted, double least, double multiple) {
  const double rounded = std::round(std::clamp(wanted, least, kMostRays) / multiple) * multiple;
  return static_cast<int>(rounded);
}

double squared(double x) { return x * x; }

/// What the patches' size and the interpolation that stays are off by.
double patch_square(const PassResults& results) {
  return std::max(0.0, squared(results.discretisation) - squared(results.refinable_interpolation));
}

/// The next pass, with the patches as they are or half as long a side.
std::optional<NextPass> plan_pass(const PassResults& results, double max_error, bool refines, NoPass& no_pass) {
  const bool has_budget = results.seconds_left >= 0;
  no_pass.limited_by.clear();
  const double direct = squared(results.direct_sampling), gathered = squared(results.gathered_sampling);
  // Halved, patches are off by half as much, or less.
  const double fixed = patch_square(results) / (refines ? 4 : 1) + squared(results.algebraic);
  if (results.num_passes >= kMostPasses || (direct + gathered == 0 && !refines)) {
    no_pass.limited_by = direct + gathered == 0 ? "discretisation" : "passes";
    return std::nullopt;
  }

  // What sampling may leave. Where the other parts take all, it is brought to half of them: less would be hard to see.
  double allowed = 0;
  bool can_reach_target = false;
  if (max_error > 0) {
    allowed = squared(kAim * max_error) - fixed;
    const double floor = fixed / 4;
    can_reach_target = allowed >= floor;
    if (allowed < floor) {
      if (!refines && direct + gathered <= 2 * floor) {
        no_pass.limited_by = "discretisation";
        return std::nullopt;
      }
      allowed = floor;
    }
  } else {
    allowed = (direct + gathered) / 4;  // halved by each pass, as long as there is time
  }

  // Efforts with the least cost.
  const double direct_cost = results.direct_rays / results.direct_effort;
  const double past_gathered_cost = kRayCost * results.gathered_rays / results.gathered_effort;
  const double gathered_cost =
      past_gathered_cost + kRayCost * kRaysPerTexel * static_cast<double>(results.num_refinable_texels);
  // Where texels share samples out by their deviations s, mean(s)^2 / n is left of n samples each (Neyman 1934). That
  // is known of passes that have done so: the first has not.
  double direct_part = direct * results.direct_effort;
  if (results.direct_deviation > 0 && results.num_passes == 1) {
    direct_part = std::min(direct_part, squared(results.direct_deviation) / kLightSamples);
  }
  const double gathered_part = gathered * results.gathered_effort;
  const double root = std::sqrt(direct_part * direct_cost) + std::sqrt(gathered_part * gathered_cost);
  double direct_effort = direct_cost > 0 ? std::sqrt(direct_part / direct_cost) * root / allowed : 0;
  const double gathered_kept = refines ? 0 : results.gathered_effort;
  double gathered_effort = gathered_cost > 0 ? std::sqrt(gathered_part / gathered_cost) * root / allowed : 0;
  // Where one part has more than it needs, the other reaches the target alone.
  if (direct_effort < results.direct_effort && allowed > direct) {
    direct_effort = results.direct_effort;
    gathered_effort = gathered_part / (allowed - direct);
  } else if (!refines && gathered_effort < results.gathered_effort && allowed > gathered) {
    gathered_effort = results.gathered_effort;
    direct_effort = direct_part / (allowed - gathered);
  }
  const double direct_rest = std::max(0.0, direct_effort - results.direct_effort);
  const double gathered_rest = std::max(0.0, gathered_effort - gathered_kept);
  // Texels that begin to gather alone have this pass only, and a quarter of a node's rays.
  double afresh = 0;
  if (results.num_refinable_texels > 0) {
    const double part = static_cast<double>(results.num_refinable_texels) / static_cast<double>(results.num_texels);
    afresh = 2 * part * (kRaysPerNode / kRaysPerTexel) * gathered_part / allowed;
  }
  const double rest = direct_rest * direct_cost + std::max(gathered_rest, afresh) * gathered_cost;

  // This pass's share of it.
  const double spent = results.direct_effort * direct_cost + results.gathered_effort * past_gathered_cost;
  double share = std::min(1.0, kGrowth * spent / std::max(rest, 1e-300));
  double seconds_share = 1;
  if (has_budget) {
    const double last_cost = results.last_direct_scale * direct_cost + results.last_gathered_scale * past_gathered_cost;
    // The first pass takes longer by the ray: it is small, and finds all memory cold.
    const double later = results.num_passes == 1 ? kLaterSeconds : 1;
    const double variable = later * (results.last_seconds - results.fixed_seconds) / std::max(last_cost, 1e-300);
    const double seconds = variable * share * rest;
    const double most = std::max(0.0, kSafeShare * results.seconds_left - results.fixed_seconds);
    if (seconds > most) share *= most / seconds;
    // A last pass takes the rest where another of its size would not fit.
    if (share * rest < kLeastGrowth * spent) {
      no_pass.limited_by = "time";
      return std::nullopt;
    }
    seconds_share =
        std::min(1.0, (results.fixed_seconds + variable * share * rest) / std::max(results.seconds_left, 1e-9));
  }
  NextPass next;
  // Where the errors say that there is hardly anything left to do and yet it is not done, they have been too low.
  const double least = has_budget ? 0 : kLeastGrowth;
  afresh = std::min(afresh, kGrowth * results.gathered_effort);
  next.scale = {std::max({share * gathered_rest, least * gathered_kept, afresh, 0.25}),
                std::max({share * direct_rest, least * results.direct_effort, 0.25}), refines,
                results.interpolation_limit};
  const double direct_after = direct_part / (results.direct_effort + next.scale.direct);
  const double gathered_after = gathered_part / (gathered_kept + next.scale.gathered);
  next.predicted_error = std::sqrt(direct_after + gathered_after + fixed);
  next.share_of_rest = has_budget ? seconds_share : share;
  next.rest = rest;
  next.fixed_error = std::sqrt(fixed);
  next.can_reach_target = can_reach_target;
  return next;
}

/// Whether to do more than gather more rays in the same way. Within a budget, errors after the pass are compared:
/// smaller patches drop what was gathered. Towards a target it is the work left, where both ways lead there.
bool is_worth_it(const NextPass& plan, const std::optional<NextPass>& than, double error, bool has_budget) {
  constexpr double kLessError = 0.7;
  // Rows of more patches and texels that gather alone take longer, and what they gain is known to a factor.
  constexpr double kLessWork = 1 / 1.5;
  if (has_budget) return plan.predicted_error < (than ? kLessError * than->predicted_error : error);
  if (!than || plan.can_reach_target != than->can_reach_target) return !than || plan.can_reach_target;
  return plan.can_reach_target ? plan.rest < kLessWork * than->rest : plan.fixed_error < kLessError * than->fixed_error;
}

}  // namespace

PassSettings pass_of(const PassScale& scale, double patch_growth) {
  // Each replicate of a row has enough rays to tell what is buried.
  constexpr double kLeastRays = 8 * kReplicates;
  PassSettings pass;
  pass.rays_per_row = whole(kRaysPerRow * scale.gathered / patch_growth, kLeastRays, kReplicates);
  pass.patch_light_samples =
      whole(kPatchLightSamples * scale.gathered / patch_growth, 4 * kReplicates, 4 * kReplicates);
  pass.rays_per_texel = whole(kRaysPerTexel * scale.gathered, kLeastRays, kReplicates);
  pass.rays_per_node = whole(kRaysPerNode * scale.gathered, kLeastRays, kReplicates);
  pass.light_samples = whole(kLightSamples * scale.direct, kReplicates, kReplicates);
  pass.gathered_weight = scale.gathered;
  return pass;
}

std::optional<NextPass> plan_next_pass(const PassResults& results, double max_error, NoPass& no_pass) {
  no_pass.limited_by.clear();
  if (max_error > 0 && results.error <= kDone * max_error) return std::nullopt;
  PassResults interpolated = results;
  interpolated.refinable_interpolation = interpolated.interpolation_limit = 0;
  interpolated.num_refinable_texels = 0;
  auto best = plan_pass(interpolated, max_error, false, no_pass);

  // What else could be done, in the order of what it costs: each has to be worth it.
  const double leads = max_error > 0 ? squared(kAim * max_error) / 2
                                     : squared(results.direct_sampling) + squared(results.gathered_sampling);
  const bool has_budget = results.seconds_left >= 0;
  const auto consider = [&](const PassResults& own, bool refines) {
    NoPass unused;
    const auto plan = plan_pass(own, max_error, refines, unused);
    if (plan && is_worth_it(*plan, best, results.error, has_budget)) best = plan;
  };
  const bool can_refine = results.can_refine_patches;
  if (results.num_refinable_texels > 0) consider(results, false);
  if (can_refine && patch_square(interpolated) > leads) consider(interpolated, true);
  if (can_refine && results.num_refinable_texels > 0 && patch_square(results) > leads) consider(results, true);
  if (best) no_pass.limited_by.clear();
  return best;
}

}  // namespace radbake::radiosity
