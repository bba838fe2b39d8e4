#pragma once

#include <array>
#include <vector>

namespace radbake::tests {

/// A face of the unit cube: the plane where coordinate `axis` is 0 or 1.
struct CubeFace {
  int axis = 0;
  bool is_high = false;
};
inline constexpr std::array<CubeFace, 6> kCubeFaces = {
    {{1, false}, {1, true}, {0, false}, {0, true}, {2, false}, {2, true}}};

/// The light in a closed unit cube of one reflectance with a square lamp amid its ceiling (y = 1), found without rays:
/// n x n patches a face, form factors in closed form, a direct solve. For comparison with bakes of cube_with_lamp().
///
/// Patches that mirrors and quarter turns about the cube's middle axis map to each other are one unknown.
/// Errors: B is constant on each patch, as in a bake with the same patches.
/// Source: Howell's catalogue: C-13 (Ehlert & Smith 1993) and C-15, parallel and perpendicular rectangles.
class CubeReference {
 public:
  /// Preconditions: n is a multiple of 7, so that the lamp is whole patches.
  explicit CubeReference(int n);

  /// sum_j F_ij of a patch, 1 but for rounding. Patches are counted face by face.
  double row_sum(std::size_t patch) const;

  /// B of all patches. Shapes: [6 n n].
  std::vector<double> radiosity(double reflectance) const;

  /// Form factors from a point of a face, given by all three coordinates, to all patches. Shapes: [6 n n].
  std::vector<double> form_factors_from(CubeFace face, const std::array<double, 3>& point) const;

  std::size_t size() const { return patches_.size(); }

 private:
  struct Patch {
    CubeFace face;
    std::array<double, 3> low, high;  ///< equal along the face's axis
  };
  double form_factor(const Patch& from, const Patch& to) const;

  std::vector<Patch> patches_;
  std::vector<std::size_t> orbit_of_;         ///< [patches]
  std::vector<std::size_t> representatives_;  ///< [orbits] a patch of each
  std::vector<std::vector<double>> factors_;  ///< [orbits][orbits] from a representative to a whole orbit
  std::vector<double> emission_;              ///< [orbits]
};

}  // namespace radbake::tests
