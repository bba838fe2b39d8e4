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

double to_seconds(std::chrono::steady_clock::duration d) { return std::chrono::duration<double>(d).count(); }

}  // namespace

ProgressMeter::ProgressMeter(BakeObserver& observer, const Start& start, double asked_error)
    : observer_(observer), start_(start), stage_start_(start.wall), stage_cpu_start_(start.cpu_seconds) {
  progress_.asked_error = asked_error;
  for (std::size_t k = 0; k < times_.size(); ++k) times_[k].stage = stage_name(static_cast<BakeStage>(k));
}

void ProgressMeter::begin_pass(int pass, double share_of_rest, double row_rays, double gather_rays) {
  const std::scoped_lock lock(mutex_);
  progress_.pass = pass;
  pass_begin_ = pass == 0 ? kPreparingShare : progress_.fraction;
  pass_end_ = pass_begin_ + (1 - pass_begin_) * share_of_rest;
  const double traced = std::max(row_rays + gather_rays, 1.0);
  row_share_ = (1 - kSolvingShare) * row_rays / traced;
  gather_share_ = (1 - kSolvingShare) * gather_rays / traced;
}

void ProgressMeter::recall_rows(double share) {
  const std::scoped_lock lock(mutex_);
  recalled_ += (pass_end_ - pass_begin_) * row_share_ * share;
}

void ProgressMeter::end_pass(double relative_error, double low, double high) {
  const std::scoped_lock lock(mutex_);
  progress_.relative_error = relative_error;
  progress_.relative_error_low = low;
  progress_.relative_error_high = high;
  observer_.on_progress(progress_);
}

void ProgressMeter::enter(BakeStage stage) {
  if (stage == stage_) return;
  const Clock::time_point now = Clock::now();
  const double cpu = process_cpu_seconds();
  StageTime& time = times_[static_cast<std::size_t>(stage_)];
  time.seconds += to_seconds(now - stage_start_);
  time.cpu_seconds += cpu - stage_cpu_start_;
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

  double before = 0, share = row_share_;
  if (stage == BakeStage::kSolving) {
    before = row_share_;
    share = kSolvingShare;
  } else if (stage == BakeStage::kGathering) {
    before = row_share_ + kSolvingShare;
    share = gather_share_;
  }
  const double part = total > 0 ? std::min(1.0, static_cast<double>(done) / static_cast<double>(total)) : 0;
  const double fraction = pass_begin_ + (pass_end_ - pass_begin_) * (before + share * part);
  progress_.fraction = std::max(progress_.fraction, fraction);
  progress_.stage = progress_.pass > 0 ? BakeStage::kGathering : stage;
  progress_.steps_done = done;
  progress_.steps_total = total;
  progress_.residual = residual;
  constexpr double kEnoughToTell = 0.05;
  const double worked = progress_.fraction - recalled_;
  if (worked > kEnoughToTell) {
    progress_.seconds_left = to_seconds(now - start_.wall) * (1 - progress_.fraction) / worked;
  }
  observer_.on_progress(progress_);
}

void ProgressMeter::tile(const Tile& tile) {
  const std::scoped_lock lock(mutex_);
  observer_.on_tile(tile);
}

std::vector<StageTime> ProgressMeter::stage_times() {
  const std::scoped_lock lock(mutex_);
  std::array<StageTime, 4> times = times_;
  StageTime& running = times[static_cast<std::size_t>(stage_)];
  running.seconds += to_seconds(Clock::now() - stage_start_);
  running.cpu_seconds += process_cpu_seconds() - stage_cpu_start_;
  return {times.begin(), times.end()};
}

double ProgressMeter::seconds() const { return to_seconds(Clock::now() - start_.wall); }

}  // namespace radbake::radiosity
