#pragma once

#include <array>
#include <optional>
#include <vector>

#include "server/study/accuracy_study.h"

namespace radbake::study {

/// The fixed settings that no other beats in both, from cheap to exact.
struct AccuracyFront {
  std::vector<const AccuracyRun*> runs;

  /// The cheapest run whose error is no larger; null: none.
  const AccuracyRun* cheapest_within(double error) const;

  /// The error that a fixed setting has for as many CPU seconds: between two of the front along log error over log
  /// seconds, after the last its own. Absent: cheaper than all.
  std::optional<double> error_at(double cpu_seconds) const;
};

/// Pareto front of the fixed settings of a study, which outlives it.
AccuracyFront front_of(const AccuracyStudy& study);

}  // namespace radbake::study
