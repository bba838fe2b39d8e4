#pragma once

#include <vector>

#include "common/geometry/vector.h"
#include "common/scene/scene.h"

namespace radbake::radiosity {

/// A sky of every direction, constant over each texel of an equirectangular image, in two parts: what is dim, which
/// cosine-distributed rays that escape find well, and what is small and bright, which is sampled by its power.
///
///   L = L_dim + L_bright,  L_dim = L min(1, kBright Lmean / max(L_r, L_g, L_b))
///
/// Units:  luminance in nit; directions are unit vectors of the world, those in which one looks.
/// Source: Pharr, Jakob & Humphreys 2023, 12.5 (piecewise-constant image infinite lights).
class Environment {
 public:
  /// Which part is drawn by sample().
  enum class Part { kAll, kBright };

  /// Texels brighter than this many times the mean over the sphere are bright.
  static constexpr double kBright = 4;

  /// The image outlives this.
  Environment(const TexturePlane& image, Part part);

  /// A direction with its share of luminance, which part asks for, and density (per steradian; 0: nothing to draw).
  struct Sample {
    Vec3 direction;
    Vec3 luminance;
    double density = 0;
  };
  /// For uniform (x, y) in the unit square: a texel by its power, and a place in it uniform in solid angle.
  Sample sample(double x, double y) const;

  /// Whether sample() has anything to draw.
  bool is_empty() const { return !(total_ > 0); }

  Vec3 luminance(Vec3 direction) const;
  Vec3 dim_luminance(Vec3 direction) const { return dim(luminance(direction)); }

 private:
  Vec3 texel(std::size_t row, std::size_t column) const;
  Vec3 dim(Vec3 luminance) const;
  Vec3 sampled(Vec3 luminance) const { return part_ == Part::kAll ? luminance : luminance - dim(luminance); }

  const TexturePlane& image_;
  Part part_;
  double limit_ = 0;                  ///< of what is dim, nit
  double total_ = 0;                  ///< power of all texels
  std::vector<double> up_to_row_;     ///< [height] power of the rows so far
  std::vector<double> up_to_column_;  ///< [height * width] power of the row so far
};

}  // namespace radbake::radiosity
