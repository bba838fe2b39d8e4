#include "server/radiosity/bake/radiosity_system.h"

#include <algorithm>
#include <functional>
#include <numbers>
#include <sstream>
#include <string>

#include "common/base/archive.h"
#include "common/base/version.h"
#include "server/radiosity/bake/row_checkpoint.h"
#include "server/radiosity/form_factor/adaptive.h"
#include "server/radiosity/form_factor/analytic_rows.h"
#include "server/radiosity/form_factor/hemicube_rows.h"
#include "server/radiosity/form_factor/hemisphere_rows.h"
#include "server/radiosity/threads/for_each_range.h"
#include "server/radiosity/transport/dense_operator.h"
#include "server/radiosity/transport/sparse_operator.h"
#include "server/radiosity/transport/streamed_operator.h"

namespace radbake::radiosity {

std::unique_ptr<RowEstimator> make_row_estimator(const Preparation& prepared, int rays_per_row, int channel) {
  const Surfaces& surfaces = prepared.surveyed.surfaces;
  const Patches& patches = prepared.patches;
  const Visibility& visibility = prepared.visibility->channel(channel);
  const BakePlan& plan = prepared.plan;
  switch (plan.form_factors) {
    case FormFactors::kAnalytic:
      return std::make_unique<AnalyticEstimator>(surfaces, patches, visibility, AnalyticEstimator::kTolerance,
                                                 plan.transport != Transport::kStreamed);
    case FormFactors::kHemicube: return std::make_unique<HemicubeEstimator>(surfaces, patches, visibility);
    case FormFactors::kAdaptive:
      return std::make_unique<AdaptiveEstimator>(surfaces, patches, visibility, rays_per_row);
    case FormFactors::kAuto:
    case FormFactors::kHemisphere: break;
  }
  return std::make_unique<HemisphereRows>(surfaces, patches, visibility, rays_per_row);
}

namespace {

/// The light on each patch and what it does with it.
void fill_light(const std::vector<TakenRow>& rows, Vec3 sky, RadiositySystem& system) {
  for (const auto& [row, sample, length] : rows) {
    // The sky's part: what of the row escaped sees it.
    const Vec3 from_sky = row.counted > 0 ? sky * (std::numbers::pi * row.escaped / row.counted) : Vec3{};
    const Vec3 direct = sample.direct + from_sky;
    system.problem.source.push_back(sample.glow + scaled_by(sample.reflectance, direct));
    system.problem.reflectance.push_back(sample.reflectance);
    system.glow.push_back(sample.glow);
    system.direct.push_back(direct);
    system.direct_variances.push_back(sample.direct_variance);
    system.num_row_rays += row.traced;
    system.num_light_rays += sample.light_rays;
    system.summary.row_error_max = std::max(system.summary.row_error_max, row.stated_error);
    system.summary.num_rows_clipped += row.clipped > 0;
  }
}

std::uint32_t other_side_of(const Patches& patches, std::uint32_t patch) {
  return patches.is_back(patch) ? patches.front_of(patch) : patches.back_of(patch);
}

bool lets_light_through(const TakenRow& taken) { return max_component(taken.sample.diffuse_transmittance) > 0; }

/// Lets through what arrives on the other side: direct light here, the rest by the solver. Where less of the other side
/// is open to light than of this one, its flux spreads; where more is, what meets a covered place is lost.
/// areas: of the open parts [patches].
void fill_transmission(const Patches& patches, const std::vector<TakenRow>& rows, std::span<const double> areas,
                       RadiositySystem& system) {
  if (std::none_of(rows.begin(), rows.end(), lets_light_through)) return;
  RadiosityProblem& problem = system.problem;
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    const std::uint32_t other = other_side_of(patches, i);
    const bool is_alone = other == kNoPatch || areas[i] <= 0;
    const double share = is_alone ? 0 : std::min(1.0, areas[other] / areas[i]);
    problem.other_side.push_back(other == kNoPatch ? i : other);
    problem.transmittance.push_back(rows[i].sample.diffuse_transmittance * share);
    problem.source[i] += scaled_by(problem.transmittance[i], system.direct[problem.other_side[i]]);
  }
}

/// Both sides of a leaf with holes have one opaque share: the mean of what was sampled on each.
void agree_on_holes(const Patches& patches, std::vector<TakenRow>& rows) {
  for (std::uint32_t i = 0; i < patches.num_cells(); ++i) {
    const std::uint32_t other = other_side_of(patches, i);
    if (other == kNoPatch || !lets_light_through(rows[i]) || !lets_light_through(rows[other])) continue;
    double& front = rows[i].sample.opaque_share;
    double& back = rows[other].sample.opaque_share;
    front = back = (front + back) / 2;
  }
}

/// What the patches send by themselves, where nothing is reflected.
void fill_glow(std::size_t num_patches, RadiositySystem& system) {
  system.glow.resize(num_patches);
  for_each_range(num_patches, 64, [&](std::size_t begin, std::size_t end) {
    PatchScratch scratch = system.sampler->make_scratch();
    for (std::size_t patch = begin; patch < end; ++patch) {
      system.glow[patch] = system.sampler->glow(static_cast<std::uint32_t>(patch), scratch);
    }
  });
}

/// Warns of meshes more than half of whose light meets the backs of single-sided surfaces: reversed normals, or a place
/// inside something else.
void warn_of_backs(const Preparation& prepared, const std::vector<TakenRow>& rows, std::vector<Warning>& warnings) {
  const Surfaces& surfaces = prepared.surveyed.surfaces;
  std::vector<double> areas(surfaces.scene->meshes.size(), 0), absorbed(areas);
  for (std::uint32_t i = 0; i < prepared.patches.num_cells(); ++i) {
    const auto& [row, sample, length] = rows[i];
    const std::uint32_t mesh = surfaces.meshes[prepared.patches.pieces(i).front().triangle];
    const double seen = row.counted > 0 ? sample.visible_share * (1 - row.absorbed / row.counted) : 0;
    const double area = prepared.patches.area(i) * sample.opaque_share;
    areas[mesh] += area;
    absorbed[mesh] += area * (1 - seen);
  }
  constexpr std::size_t kMostNames = 3;
  std::size_t count = 0;
  std::string names;
  for (std::size_t m = 0; m < areas.size(); ++m) {
    if (absorbed[m] <= areas[m] / 2) continue;
    if (++count <= kMostNames) names += (names.empty() ? "'" : ", '") + surfaces.scene->meshes[m].name + "'";
  }
  if (count == 0) return;
  warnings.push_back({"sees_backs", std::to_string(count) + (count == 1 ? " mesh sees" : " meshes see") +
                                        " mostly backs of single-sided surfaces (" + names +
                                        (count > kMostNames ? ", ..." : "") +
                                        "): their normals or those of what they see may be reversed, or they lie "
                                        "inside other objects"});
}

/// Warns of rows by formula whose stated error is large: too many surfaces cross between some patches.
void warn_of_uncertain_rows(const std::vector<TakenRow>& rows, std::vector<Warning>& warnings) {
  constexpr double kLarge = 0.01;
  std::size_t count = 0;
  double largest = 0;
  for (const TakenRow& taken : rows) {
    count += taken.row.stated_error > kLarge;
    largest = std::max(largest, taken.row.stated_error);
  }
  if (count == 0) return;
  std::ostringstream text;
  text << "the form factors of " << count << " of " << rows.size()
       << " patches are uncertain by more than 1 %, by up to " << 100 * largest
       << " % in sum: too many surfaces cross between them for the formula; rays (--form-factors "
       << "hemisphere or adaptive) have no such limit";
  warnings.push_back({"formula_uncertain", text.str()});
}

/// All rows in one piece, areas in square metres. Takes the entries.
EstimatedRows collected(const Patches& patches, double square_metres, std::vector<TakenRow>& rows) {
  EstimatedRows all;
  std::size_t num_entries = 0;
  for (const TakenRow& taken : rows) num_entries += taken.row.entries.size();
  all.entries.reserve(num_entries);
  all.first.assign(1, 0);
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    FormFactorRow& row = rows[i].row;
    for (const FormFactorRow::Entry& entry : row.entries) all.entries.push_back({entry.patch, entry.weight});
    all.first.push_back(all.entries.size());
    all.counted.push_back(row.counted);
    all.escaped.push_back(row.escaped);
    all.absorbed.push_back(row.absorbed);
    const PatchSample& sample = rows[i].sample;
    const double share = sample.visible_share * sample.opaque_share;
    all.areas.push_back(row.counted > 0 ? patches.area(i) * share * square_metres : 0);
    row.entries = {};
  }
  return all;
}

void summarise(const TransportRepair& repair, TransportSummary& summary) {
  summary.num_entries = repair.num_entries;
  summary.raw_reciprocity_rms = repair.raw_reciprocity_rms;
  summary.raw_closure_max = repair.raw_closure_max;
  summary.paired_row_error_rms = repair.paired_row_error_rms;
  summary.repaired_row_error_max = repair.repaired_row_error_max;
  summary.scaling_sweeps = repair.scaling_sweeps;
  summary.escape_share = repair.escape_share;
  summary.absorbed_share = repair.absorbed_share;
}

/// The operator that keeps no entries: `rows` holds the sums of each, the system's sampler makes them again.
std::unique_ptr<TransportOperator> make_streamed(const EstimatedRows& rows, const std::vector<TakenRow>& taken,
                                                 Solver solver, RadiositySystem& system, std::stop_token stop) {
  RowSums sums;
  for (std::uint32_t i = 0; i < rows.size(); ++i) {
    sums.measured.push_back(rows.measured_row_sum(i));
    sums.lengths.push_back(taken[i].length);
    system.summary.num_entries += taken[i].length;
  }
  sums.areas = rows.areas;
  const EstimatedRows::LostShares lost = rows.lost_shares();
  system.summary.escape_share = lost.escaped;
  system.summary.absorbed_share = lost.absorbed;
  const RowSource source = [&sampler = *system.sampler, counted = rows.counted, stop](
                               std::uint32_t patch, std::vector<EstimatedRows::Entry>& entries) {
    entries.clear();
    // What no row has reached has none itself.
    if (counted[patch] == 0 || stop.stop_requested()) return;
    PatchScratch scratch = sampler.make_scratch();
    FormFactorRow row;
    sampler.sample_row(patch, scratch, stop, row);
    for (const FormFactorRow::Entry& entry : row.entries) entries.push_back({entry.patch, entry.weight});
  };
  return std::make_unique<StreamedOperator>(
      std::move(sums), source, reads_columns(solver) ? StreamedSystem::kByColumns : StreamedSystem::kByRows);
}

/// Of all that the rows of a system depend on, for one scene and set of options.
std::uint64_t fingerprint_of(const Preparation& prepared, const SystemSettings& settings, int channel) {
  std::ostringstream text;
  text << kEngineVersion << ' ' << kArchiveLayout << ' ' << prepared.visibility->instruction_set() << ' '
       << prepared.patches.size() << ' ' << prepared.patch_edge << ' ' << settings.seed << ' ' << settings.rays_per_row
       << ' ' << settings.light_samples << ' ' << channel;
  return std::hash<std::string>{}(text.str());
}

}  // namespace

Result<std::unique_ptr<RadiositySystem>> make_radiosity_system(const Preparation& prepared,
                                                               const SystemSettings& settings, int channel,
                                                               const OnRow& on_row, std::stop_token stop) {
  const Surfaces& surfaces = prepared.surveyed.surfaces;
  const Patches& patches = prepared.patches;
  auto system = std::make_unique<RadiositySystem>();
  system->estimator = make_row_estimator(prepared, settings.rays_per_row, channel);
  system->direct_light = std::make_unique<DirectLight>(surfaces, prepared.shadows(), settings.light_samples);
  system->sampler = std::make_unique<PatchSampler>(surfaces, patches, *system->estimator, *system->direct_light,
                                                   settings.seed, channel);
  system->emitted_lumens = system->direct_light->emitted_lumens();
  if (!surfaces.effects.has(Effect::kInterreflection)) {
    fill_glow(patches.size(), *system);
    return system;
  }

  // Estimate the rows, and the light on each patch.
  const bool is_streamed = prepared.plan.transport == Transport::kStreamed;
  std::vector<TakenRow> rows(patches.size());
  // Rows whose entries are not there cannot be gone on from.
  RowCheckpoint checkpoint(is_streamed ? nullptr : settings.checkpoints,
                           settings.checkpoint_prefix + std::to_string(channel) + '/',
                           fingerprint_of(prepared, settings, channel), rows);
  sample_patches(
      *system->sampler, patches.num_cells(), prepared.reached_backs,
      [&](std::uint32_t patch, FormFactorRow& row, const PatchSample& sample) {
        rows[patch].length = static_cast<std::uint32_t>(row.entries.size());
        if (is_streamed) row.entries.clear();
        rows[patch].row = row;  // a copy is no longer than it need be
        rows[patch].sample = sample;
        checkpoint.add(patch);
      },
      on_row, stop,
      [&](std::uint32_t patch) { return checkpoint.is_known(patch) ? &rows[patch].row.entries : nullptr; });
  if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "the bake was cancelled"};
  fill_light(rows, surfaces.sky, *system);
  agree_on_holes(patches, rows);
  warn_of_backs(prepared, rows, system->warnings);
  warn_of_uncertain_rows(rows, system->warnings);

  // Put the operator together.
  EstimatedRows estimated = collected(patches, surfaces.metres_per_unit * surfaces.metres_per_unit, rows);
  fill_transmission(patches, rows, estimated.areas, *system);
  if (is_streamed) {
    system->transport = make_streamed(estimated, rows, prepared.plan.solver, *system, stop);
    return system;
  }
  rows = {};
  auto sparse = std::make_unique<SparseOperator>(estimated, stop,
                                                 settings.tolerance > 0 ? settings.tolerance : SparseOperator::kExact);
  estimated = {};
  if (stop.stop_requested()) return Error{ErrorCode::kCancelled, "the bake was cancelled"};
  summarise(sparse->repair(), system->summary);
  if (prepared.plan.transport == Transport::kDense) {
    system->transport = std::make_unique<DenseOperator>(*sparse);
  } else {
    system->transport = std::move(sparse);
  }
  return system;
}

}  // namespace radbake::radiosity
