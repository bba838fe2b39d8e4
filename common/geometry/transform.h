#pragma once

#include <array>

#include "common/geometry/vector.h"

namespace radbake {

/// Affine map of space: x -> linear x + translation. Columns of the linear part are the images of the axes.
struct Transform {
  std::array<Vec3, 3> columns = {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
  Vec3 translation;

  Vec3 apply_to_point(Vec3 p) const { return apply_to_vector(p) + translation; }
  Vec3 apply_to_vector(Vec3 v) const { return columns[0] * v.x + columns[1] * v.y + columns[2] * v.z; }
  /// Normal of a transformed surface, not normalised: cofactor matrix times n, so mirrored maps keep the side
  /// that the (flipped) winding shows.
  Vec3 apply_to_normal(Vec3 n) const;
  double determinant() const { return dot(columns[0], cross(columns[1], columns[2])); }
};

/// First b, then a.
Transform operator*(const Transform& a, const Transform& b);

/// From a glTF node's translation, rotation quaternion (x, y, z, w; normalised here) and scale.
/// Precondition: the quaternion is finite and not zero.
Transform transform_from_trs(Vec3 translation, const std::array<double, 4>& rotation, Vec3 scale);

/// From a glTF node's 16 numbers, column by column.
Transform transform_from_matrix(const std::array<double, 16>& matrix);

}  // namespace radbake
