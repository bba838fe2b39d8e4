#include "common/scene/scene.h"

#include <utility>

namespace radbake {

Mesh placed_in_world(const Mesh& mesh, const Transform& transform) {
  Mesh placed = mesh;
  for (Vec3& position : placed.positions) position = transform.apply_to_point(position);
  for (Vec3& normal : placed.normals) {
    const Vec3 image = transform.apply_to_normal(normal);
    const double size = length(image);
    normal = size > 0 ? image / size : Vec3{};
  }
  // A mirror turns the front to the back; swapping two corners turns it again.
  if (transform.determinant() < 0) {
    for (auto& triangle : placed.triangles) std::swap(triangle[1], triangle[2]);
  }
  return placed;
}

}  // namespace radbake
