#pragma once

#include <array>
#include <span>

namespace radbake::study {

/// A number with its interval of 95 % confidence: value +- half_width.
struct Estimate {
  double value = 0;
  double half_width = 0;
};

/// Slope of log y over log x by least squares; its interval by the spread about the line, with Student's factor.
///
/// Points whose x or y is not above 0 are left out. Precondition: at least 3 are left, not all with the same x.
Estimate log_log_slope(std::span<const std::array<double, 2>> points);

/// Mean of independent values, with Student's factor. Precondition: at least 2.
Estimate mean_of(std::span<const double> values);

/// Student's t for a two-sided chance of 5 %. Errors: below 0.5 % (Cornish & Fisher's series from 4 degrees on, exact
/// before). Precondition: degrees >= 1. Source: Abramowitz & Stegun 26.7.5.
double student_95(int degrees);

}  // namespace radbake::study
