#include "server/radiosity/bake/progress_meter.h"

#include <algorithm>

namespace radbake::radiosity {
namespace {

constexpr std::chrono::milliseconds kMinInterval{50};
/// Of the whole, for the stages that trace no rays.
constexpr double kPreparingShare = 0.02;
constexpr double kSolvingShare = 0.03;

const char* stage_name(BakeStage stage) {
  switch (stage) {
    case BakeStage::kPreparing: return "preparing";
    case BakeStage::kFormFactors: return "form_factors";
    case BakeStage::kSolving: return "solving";
    case BakeStage::kGathering: return "gathering";
  }
  return "unknown";
}

double seconds(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

ProgressMeter::ProgressMeter(BakeObserver& observer, const Start& start, double row_rays, double gather_rays)
    : observer_(observer), start_(start.wall), stage_start_(start.wall), stage_cpu_start_(start.cpu_seconds) {
  const double traced = std::max(row_rays + gather_rays, 1.0);
  row_share_ = (1 - kPreparingShare - kSolvingShare) * row_rays / traced;
  gather_share_ = (1 - kPreparingShare - kSolvingShare) * gather_rays / traced;
}

void ProgressMeter::enter(BakeStage stage) {
  if (stage == stage_) return;
  const Clock::time_point now = Clock::now();
  const double cpu = process_cpu_seconds();
  times_.push_back({stage_name(stage_), seconds(now - stage_start_), cpu - stage_cpu_start_});
  stage_start_ = now;
  stage_cpu_start_ = cpu;
  stage_ = stage;
}

void ProgressMeter::report(BakeStage stage, std::uint64_t done, std::uint64_t total, double residual) {
  const std::scoped_lock lock(mutex_);
  const bool is_change = stage != stage_;
  enter(stage);
  const Clock::time_point now = Clock::now();
  if (!is_change && done < total && now - last_report_ < kMinInterval) return;
  last_report_ = now;

  double before = 0, share = kPreparingShare;
  if (stage == BakeStage::kFormFactors) {
    before = kPreparingShare;
    share = row_share_;
  } else if (stage == BakeStage::kSolving) {
    before = kPreparingShare + row_share_;
    share = kSolvingShare;
  } else if (stage == BakeStage::kGathering) {
    before = kPreparingShare + row_share_ + kSolvingShare;
    share = gather_share_;
  }
  const double part = total > 0 ? std::min(1.0, static_cast<double>(done) / static_cast<double>(total)) : 0;
  fraction_ = std::max(fraction_, before + share * part);

  BakeProgress progress;
  progress.stage = stage;
  progress.fraction = fraction_;
  progress.steps_done = done;
  progress.steps_total = total;
  progress.residual = residual;
  constexpr double kEnoughToTell = 0.05;
  if (fraction_ > kEnoughToTell) progress.seconds_left = seconds(now - start_) * (1 - fraction_) / fraction_;
  observer_.on_progress(progress);
}

void ProgressMeter::tile(const Tile& tile) {
  const std::scoped_lock lock(mutex_);
  observer_.on_tile(tile);
}

std::vector<StageTime> ProgressMeter::stage_times() {
  const std::scoped_lock lock(mutex_);
  std::vector<StageTime> times = times_;
  times.push_back({stage_name(stage_), seconds(Clock::now() - stage_start_), process_cpu_seconds() - stage_cpu_start_});
  return times;
}

}  // namespace radbake::radiosity
