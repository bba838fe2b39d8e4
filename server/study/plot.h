#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/result.h"

namespace radbake::study {

/// A curve of a plot. Without points it is not drawn, and the colours of those after it stay as they are.
struct Curve {
  std::string title;                          ///< in the legend
  std::vector<std::array<double, 2>> points;  ///< x, y; those not above 0 are left out, as axes are logarithmic
  bool is_reference = false;                  ///< thin and dashed, without points
  bool has_points = true;
  bool has_line = true;
  bool is_dashed = false;
};

/// Curves over one pair of axes.
struct Panel {
  std::string title, x_label, y_label;
  std::vector<Curve> curves;
  bool is_x_logarithmic = true;
  double smallest_y = 0;        ///< lower end of the axis; 0: as the curves need
  double largest_x = 0;         ///< right end of the axis; 0: as the curves need
  bool has_close_tics = false;  ///< 1, 2, 5 of each decade, and axes no longer than the curves: of two decades or so
};

/// Panels side by side.
struct Plot {
  std::vector<Panel> panels;
};

/// Draws DIR/NAME.svg and DIR/NAME.png by gnuplot, from DIR/NAME.gnuplot, which is left there.
///
/// y is logarithmic. Legends are below the panels.
/// Errors: kFailedPrecondition that names the package where there is no gnuplot; kInternal with what it says, or with
///         the file that cannot be written.
Result<void> draw(const Plot& plot, const std::filesystem::path& folder, const std::string& name,
                  const std::string& gnuplot = "gnuplot");

}  // namespace radbake::study
