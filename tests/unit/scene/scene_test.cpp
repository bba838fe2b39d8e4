#include "common/scene/scene.h"

#include <gtest/gtest.h>

namespace radbake {
namespace {

Vec3 face_normal(const Mesh& mesh) {
  const auto& t = mesh.triangles[0];
  return normalized(cross(mesh.positions[t[1]] - mesh.positions[t[0]], mesh.positions[t[2]] - mesh.positions[t[0]]));
}

TEST(PlacedInWorld, KeepsFrontAndNormalTogetherUnderAMirror) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {0, 1, 0}, {0, 0, 1}};  // faces +x
  mesh.normals = {{1, 0, 0}, {1, 0, 0}, {1, 0, 0}};
  mesh.triangles = {{0, 1, 2}};
  for (const Vec3 scale : {Vec3{-1, 1, 1}, Vec3{1, -2, 1}, Vec3{-1, -1, -1}, Vec3{3, 2, 1}}) {
    const Mesh placed = placed_in_world(mesh, transform_from_trs({5, 5, 5}, {0, 0, 0, 1}, scale));
    EXPECT_GT(dot(face_normal(placed), placed.normals[0]), 0.99) << scale.x << " " << scale.y << " " << scale.z;
  }
}

}  // namespace
}  // namespace radbake
