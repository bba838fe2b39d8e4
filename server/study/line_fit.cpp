#include "server/study/line_fit.h"

#include <cmath>
#include <vector>

#include "common/base/check.h"

namespace radbake::study {

double student_95(int degrees) {
  RADBAKE_CHECK_LE(1, degrees);
  if (degrees == 1) return 12.706;
  if (degrees == 2) return 4.3027;
  if (degrees == 3) return 3.1824;
  const double x = 1.959964;  // of the normal distribution
  const double x3 = x * x * x, x5 = x3 * x * x, x7 = x5 * x * x;
  const double n = degrees;
  return x + (x3 + x) / (4 * n) + (5 * x5 + 16 * x3 + 3 * x) / (96 * n * n) +
         (3 * x7 + 19 * x5 + 17 * x3 - 15 * x) / (384 * n * n * n);
}

Estimate log_log_slope(std::span<const std::array<double, 2>> points) {
  std::vector<std::array<double, 2>> logs;
  double mean_x = 0, mean_y = 0;
  for (const auto& [x, y] : points) {
    if (!(x > 0 && y > 0)) continue;
    logs.push_back({std::log(x), std::log(y)});
    mean_x += logs.back()[0];
    mean_y += logs.back()[1];
  }
  RADBAKE_CHECK_LE(3, static_cast<int>(logs.size()));
  const double n = static_cast<double>(logs.size());
  mean_x /= n;
  mean_y /= n;
  double xx = 0, xy = 0;
  for (const auto& [x, y] : logs) {
    xx += (x - mean_x) * (x - mean_x);
    xy += (x - mean_x) * (y - mean_y);
  }
  RADBAKE_CHECK(xx > 0);
  const double slope = xy / xx;
  double squares = 0;
  for (const auto& [x, y] : logs) {
    const double off = y - mean_y - slope * (x - mean_x);
    squares += off * off;
  }
  return {slope, student_95(static_cast<int>(logs.size()) - 2) * std::sqrt(squares / (n - 2) / xx)};
}

Estimate mean_of(std::span<const double> values) {
  RADBAKE_CHECK_LE(2, static_cast<int>(values.size()));
  const double n = static_cast<double>(values.size());
  double mean = 0, squares = 0;
  for (const double value : values) mean += value / n;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return {mean, student_95(static_cast<int>(values.size()) - 1) * std::sqrt(squares / (n - 1) / n)};
}

}  // namespace radbake::study
