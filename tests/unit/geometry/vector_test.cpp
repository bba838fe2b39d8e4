#include "common/geometry/vector.h"

#include <gtest/gtest.h>

namespace radbake {
namespace {

constexpr double kRounding = 1e-15;

TEST(Frame, IsRightHandedAndOrthonormalForAnyNormal) {
  for (const Vec3 n :
       {Vec3{0, 0, 1}, Vec3{0, 0, -1}, Vec3{1, 0, 0}, normalized({1, -2, 3}), normalized({-1, 1e-9, -1})}) {
    const Frame frame(n);
    EXPECT_NEAR(dot(frame.s, frame.t), 0, kRounding);
    EXPECT_NEAR(dot(frame.s, n), 0, kRounding);
    EXPECT_NEAR(length(frame.t), 1, kRounding);
    EXPECT_NEAR(dot(cross(frame.s, frame.t), n), 1, kRounding);
  }
}

}  // namespace
}  // namespace radbake
