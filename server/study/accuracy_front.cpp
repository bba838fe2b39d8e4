#include "server/study/accuracy_front.h"

#include <algorithm>
#include <cmath>

namespace radbake::study {

const AccuracyRun* AccuracyFront::cheapest_within(double error) const {
  for (const AccuracyRun* run : runs) {
    if (run->points.back().error <= error) return run;
  }
  return nullptr;
}

std::optional<double> AccuracyFront::error_at(double cpu_seconds) const {
  if (runs.empty() || cpu_seconds < runs.front()->points.back().cpu_seconds) return std::nullopt;
  for (std::size_t k = 0; k + 1 < runs.size(); ++k) {
    const AccuracyPoint &a = runs[k]->points.back(), &b = runs[k + 1]->points.back();
    if (cpu_seconds > b.cpu_seconds || !(b.error > 0)) continue;
    const double share = std::log(cpu_seconds / a.cpu_seconds) / std::log(b.cpu_seconds / a.cpu_seconds);
    return a.error * std::pow(b.error / a.error, share);
  }
  return runs.back()->points.back().error;
}

AccuracyFront front_of(const AccuracyStudy& study) {
  AccuracyFront front;
  for (const AccuracyRun& run : study.runs) {
    if (run.setting) front.runs.push_back(&run);
  }
  const auto last = [](const AccuracyRun* run) { return run->points.back(); };
  std::sort(front.runs.begin(), front.runs.end(), [&](const AccuracyRun* a, const AccuracyRun* b) {
    if (last(a).cpu_seconds != last(b).cpu_seconds) return last(a).cpu_seconds < last(b).cpu_seconds;
    return last(a).error < last(b).error;
  });
  // Keep what is more exact than all that is cheaper.
  std::vector<const AccuracyRun*> kept;
  for (const AccuracyRun* run : front.runs) {
    if (kept.empty() || last(run).error < last(kept.back()).error) kept.push_back(run);
  }
  front.runs = std::move(kept);
  return front;
}

}  // namespace radbake::study
