#pragma once

#include <span>
#include <vector>

namespace radbake::image {

/// Reduces an image to the mean over each target pixel's area, a row at a time from the top.
/// Sizes need not divide: source pixels on a border count by their share. Sums are in double, in a fixed order.
class BoxReduction {
 public:
  /// Precondition: 1 <= target size <= source size.
  BoxReduction(int source_width, int source_height, int target_width, int target_height, int channels);

  /// Shapes: row [source_width * channels]. Precondition: called source_height times.
  void add_row(std::span<const double> row);
  /// Shapes: [target_height * target_width * channels].
  std::vector<float> finish() const;

 private:
  int source_width_, source_height_, target_width_, target_height_, channels_;
  int next_row_ = 0;
  std::vector<double> sums_;
  std::vector<double> reduced_row_;
};

}  // namespace radbake::image
