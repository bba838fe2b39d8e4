#include "common/geometry/transform.h"

#include <gtest/gtest.h>

#include <numbers>

namespace radbake {
namespace {

constexpr double kRounding = 1e-14;

void expect_near(Vec3 a, Vec3 b) { EXPECT_LT(length(a - b), kRounding) << a.x << " " << a.y << " " << a.z; }

TEST(Transform, AppliesScaleThenRotationThenTranslation) {
  // A quarter turn about z takes x to y.
  const double half = std::numbers::pi / 4;
  const Transform t = transform_from_trs({10, 0, 0}, {0, 0, std::sin(half), std::cos(half)}, {2, 3, 4});
  expect_near(t.apply_to_point({1, 0, 0}), {10, 2, 0});
  expect_near(t.apply_to_point({0, 1, 0}), {7, 0, 0});
  EXPECT_NEAR(t.determinant(), 24, kRounding);
}

TEST(Transform, ProductAppliesTheRightOneFirst) {
  const Transform move = transform_from_trs({1, 2, 3}, {0, 0, 0, 1}, {1, 1, 1});
  const Transform grow = transform_from_trs({0, 0, 0}, {0, 0, 0, 1}, {2, 2, 2});
  expect_near((move * grow).apply_to_point({1, 1, 1}), {3, 4, 5});
  expect_near((grow * move).apply_to_point({1, 1, 1}), {4, 6, 8});
}

TEST(Transform, KeepsNormalsOrthogonalUnderNonUniformScale) {
  const Transform t = transform_from_trs({0, 0, 0}, {0, 0, 0, 1}, {1, 10, 1});
  const Vec3 tangent{1, -1, 0}, normal{1, 1, 0};
  EXPECT_NEAR(dot(t.apply_to_vector(tangent), t.apply_to_normal(normal)), 0, kRounding);
}

TEST(Transform, TurnsNormalsLikeTheInverseTransposeUnderAMirror) {
  const Transform mirror = transform_from_trs({0, 0, 0}, {0, 0, 0, 1}, {-1, 1, 1});
  expect_near(mirror.apply_to_normal({1, 0, 0}), {-1, 0, 0});
  expect_near(mirror.apply_to_normal({0, 1, 0}), {0, 1, 0});
}

TEST(Transform, ReadsMatricesColumnByColumn) {
  const Transform t = transform_from_matrix({1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 10, 0, -1, -2, -3, 1});
  expect_near(t.apply_to_point({1, 0, 0}), {0, 0, 0});
  expect_near(t.apply_to_point({0, 1, 0}), {3, 3, 3});
}

}  // namespace
}  // namespace radbake
