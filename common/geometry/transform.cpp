#include "common/geometry/transform.h"

namespace radbake {

Vec3 Transform::apply_to_normal(Vec3 n) const {
  const double sign = determinant() < 0 ? -1.0 : 1.0;
  const Vec3 image =
      cross(columns[1], columns[2]) * n.x + cross(columns[2], columns[0]) * n.y + cross(columns[0], columns[1]) * n.z;
  return image * sign;
}

Transform operator*(const Transform& a, const Transform& b) {
  Transform product;
  for (int i = 0; i < 3; ++i) product.columns[i] = a.apply_to_vector(b.columns[i]);
  product.translation = a.apply_to_point(b.translation);
  return product;
}

Transform transform_from_trs(Vec3 translation, const std::array<double, 4>& rotation, Vec3 scale) {
  double x = rotation[0], y = rotation[1], z = rotation[2], w = rotation[3];
  const double norm = std::sqrt(x * x + y * y + z * z + w * w);
  x /= norm, y /= norm, z /= norm, w /= norm;
  Transform result;
  result.columns[0] = Vec3{1 - 2 * (y * y + z * z), 2 * (x * y + z * w), 2 * (x * z - y * w)} * scale.x;
  result.columns[1] = Vec3{2 * (x * y - z * w), 1 - 2 * (x * x + z * z), 2 * (y * z + x * w)} * scale.y;
  result.columns[2] = Vec3{2 * (x * z + y * w), 2 * (y * z - x * w), 1 - 2 * (x * x + y * y)} * scale.z;
  result.translation = translation;
  return result;
}

Transform transform_from_matrix(const std::array<double, 16>& m) {
  Transform result;
  for (std::size_t i = 0; i < 3; ++i) result.columns[i] = {m[4 * i], m[4 * i + 1], m[4 * i + 2]};
  result.translation = {m[12], m[13], m[14]};
  return result;
}

}  // namespace radbake
