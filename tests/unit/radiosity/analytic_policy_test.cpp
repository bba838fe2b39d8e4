#include <gtest/gtest.h>

#include <cmath>

#include "server/radiosity/form_factor/analytic.h"

namespace radbake::radiosity {
namespace {

const PolygonCorners kFloor = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
const PolygonCorners kCeiling = {{0, 1, 1}, {1, 1, 1}, {1, 0, 1}, {0, 0, 1}};

/// A rectangle at a height, x and y from low to high.
PolygonCorners plate(double x0, double x1, double y0, double y1, double z) {
  return {{x0, y0, z}, {x1, y0, z}, {x1, y1, z}, {x0, y1, z}};
}

double form_factor(const PolygonCorners& from, const PolygonCorners& to,
                   const std::vector<PolygonCorners>& occluders = {}) {
  const auto result = polygon_form_factor(from, to, occluders, 1e-6);
  EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
  return result.ok() ? result->form_factor : NAN;
}

void expect_refused(const PolygonCorners& from, const PolygonCorners& to, const std::vector<PolygonCorners>& occluders,
                    const std::string& words) {
  const auto result = polygon_form_factor(from, to, occluders, 1e-4);
  ASSERT_FALSE(result.ok()) << words;
  EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
  EXPECT_NE(result.error().message.find(words), std::string::npos) << result.error().message;
}

TEST(PolygonPolicy, NamesWhatIsWrongWithAPolygon) {
  expect_refused({{0, 0, 0}, {1, 0, 0}}, kCeiling, {}, "the patch that sends has 2 corners");
  expect_refused(kFloor, {{0, 0, 1}, {1, NAN, 1}, {1, 1, 1}}, {},
                 "the patch that receives has a corner that is not finite");
  expect_refused(kFloor, kCeiling, {kFloor, {{0, 0, 0.5}, {1, 0, 0.5}, {2, 0, 0.5}}}, "occluder 1 has no area");
  expect_refused(kFloor, {{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {}, "the patch that receives has no area");
  expect_refused({{0, 0, 0}, {1, 0, 0}, {1, 1, 0.001}, {0, 1, 0}}, kCeiling, {}, "the patch that sends is not planar");
  expect_refused({{0, 0, 0}, {3, 3, 0}, {3, 0, 0}, {0, 2, 0}}, kCeiling, {}, "the patch that sends");
}

TEST(PolygonPolicy, RefusesAToleranceThatIsNotAboveZero) {
  for (const double tolerance : {0.0, -1e-4, static_cast<double>(NAN), static_cast<double>(INFINITY)}) {
    EXPECT_FALSE(polygon_form_factor(kFloor, kCeiling, {}, tolerance).ok()) << tolerance;
  }
}

TEST(PolygonPolicy, TakesCornersThatAreOffTheirPlaneByRounding) {
  // 2 ulp of a coordinate of 1 off a plane at half height.
  PolygonCorners ceiling = kCeiling;
  ceiling[0].z += 2 * 0x1p-52;
  EXPECT_NEAR(form_factor(kFloor, ceiling), form_factor(kFloor, kCeiling), 1e-14);
  ceiling[0].z += 200 * 0x1p-52;
  EXPECT_FALSE(polygon_form_factor(kFloor, ceiling, {}, 1e-4).ok());
}

TEST(PolygonPolicy, RefusesPatchesThatCoincideFaceToFace) {
  expect_refused(kFloor, {kFloor.rbegin(), kFloor.rend()}, {}, "coincide");
  const PolygonCorners part = plate(0.5, 1.5, 0.5, 1.5, 0);
  expect_refused(kFloor, {part.rbegin(), part.rend()}, {}, "coincide");
}

TEST(PolygonPolicy, GivesZeroToCoplanarPatchesThatDoNotOverlapFaceToFace) {
  const PolygonCorners beside = plate(1, 2, 0, 1, 0);
  EXPECT_EQ(form_factor(kFloor, beside), 0);
  EXPECT_EQ(form_factor(kFloor, {beside.rbegin(), beside.rend()}), 0);
  EXPECT_EQ(form_factor(kFloor, kFloor), 0);
}

TEST(PolygonPolicy, GivesZeroToBacks) {
  EXPECT_EQ(form_factor(kFloor, {kCeiling.rbegin(), kCeiling.rend()}), 0);
  EXPECT_EQ(form_factor({kFloor.rbegin(), kFloor.rend()}, kCeiling), 0);
}

TEST(PolygonPolicy, GivesExactlyZeroBehindACover) {
  EXPECT_EQ(form_factor(kFloor, kCeiling, {plate(0, 1, 0, 1, 0.5)}), 0);
  EXPECT_EQ(form_factor(kFloor, kCeiling, {plate(-1, 2, -1, 2, 0.25)}), 0);
  // Of four plates that meet without overlap.
  EXPECT_EQ(form_factor(kFloor, kCeiling,
                        {plate(0, 0.3, 0, 0.6, 0.5), plate(0.3, 1, 0, 0.6, 0.5), plate(0, 0.3, 0.6, 1, 0.5),
                         plate(0.3, 1, 0.6, 1, 0.5)}),
            0);
}

TEST(PolygonPolicy, IgnoresOccludersOutsideTheShaft) {
  const double open = form_factor(kFloor, kCeiling);
  EXPECT_EQ(form_factor(kFloor, kCeiling, {plate(0, 1, 0, 1, 1.5)}), open);                        // behind
  EXPECT_EQ(form_factor(kFloor, kCeiling, {plate(0, 1, 0, 1, -0.5)}), open);                       // below
  EXPECT_EQ(form_factor(kFloor, kCeiling, {plate(1, 2, 0, 1, 0.5)}), open);                        // touches a side
  EXPECT_EQ(form_factor(kFloor, kCeiling, {{{1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {1, 0, 1}}}), open);  // lies in a side
  EXPECT_EQ(form_factor(kFloor, kCeiling, {{{2, -1, 0}, {0, -1, 2}, {2, -3, 2}}}), open);          // beside
}

// The policy for an occluder in a patch's plane: it lies on the front and covers, the limit as it comes from the other
// patch. From behind the limit would be the open pair.
TEST(PolygonPolicy, CoversAPatchWithAnOccluderInItsPlane) {
  const double open = form_factor(kFloor, kCeiling);
  const double contact = form_factor(kFloor, kCeiling, {plate(0, 0.25, 0, 1, 1)});
  EXPECT_NEAR(contact, 0.1533021026416905, 1e-12);  // C-13: what is left of the ceiling
  EXPECT_NEAR(contact, form_factor(kFloor, {{0.25, 1, 1}, {1, 1, 1}, {1, 0, 1}, {0.25, 0, 1}}), 1e-14);
  // It is the limit from the emitter's side: the difference is of first order in the distance.
  for (const double gap : {1e-4, 1e-6, 1e-8}) {
    EXPECT_NEAR(form_factor(kFloor, kCeiling, {plate(0, 0.25, 0, 1, 1 - gap)}), contact, gap + 1e-6);
    EXPECT_EQ(form_factor(kFloor, kCeiling, {plate(0, 0.25, 0, 1, 1 + gap)}), open);
  }
  // On the sender alike: the area of the whole sender stays the measure.
  EXPECT_NEAR(form_factor(kFloor, kCeiling, {plate(0, 0.25, 0, 1, 0)}), contact, 1e-14);
  EXPECT_EQ(form_factor(kFloor, kCeiling, {plate(0, 1, 0, 1, 1)}), 0);
}

TEST(PolygonPolicy, NeverLeaksThroughASeamHoweverTheWallIsCut) {
  const double whole = form_factor(kFloor, kCeiling, {plate(0.25, 0.75, 0.25, 0.75, 0.5)});
  const Vec3 middle{0.43, 0.61, 0.5};
  const PolygonCorners outline = plate(0.25, 0.75, 0.25, 0.75, 0.5);
  std::vector<PolygonCorners> fan;
  for (std::size_t k = 0; k < 4; ++k) fan.push_back({outline[k], outline[(k + 1) % 4], middle});
  EXPECT_NEAR(form_factor(kFloor, kCeiling, fan), whole, 2e-6);
}

TEST(PolygonPolicy, HidesTheOverlapOfOccludersInOnePlaneOnce) {
  const double whole = form_factor(kFloor, kCeiling, {plate(0, 0.8, 0, 0.9, 0.5)});
  EXPECT_NEAR(form_factor(kFloor, kCeiling, {plate(0, 0.6, 0, 0.9, 0.5), plate(0.3, 0.8, 0, 0.9, 0.5)}), whole, 2e-6);
  EXPECT_NEAR(form_factor(kFloor, kCeiling, {plate(0, 0.8, 0, 0.9, 0.5), plate(0, 0.8, 0, 0.9, 0.5)}), whole, 2e-6);
}

TEST(PolygonPolicy, SeesNothingFromThePartOfAPatchThatIsInABox) {
  const auto box = [](double low, double high) {
    const Vec3 o{0.2, 0.3, low}, x{0.4, 0, 0}, y{0, 0.5, 0}, z{0, 0, high - low};
    const auto face = [](Vec3 a, Vec3 s, Vec3 t) { return PolygonCorners{a, a + s, a + s + t, a + t}; };
    return std::vector<PolygonCorners>{face(o, y, x),     face(o + z, x, y), face(o, z, y),
                                       face(o + x, y, z), face(o, x, z),     face(o + y, z, x)};
  };
  const double standing = form_factor(kFloor, kCeiling, box(0, 0.4));
  EXPECT_NEAR(form_factor(kFloor, kCeiling, box(-0.3, 0.4)), standing, 2e-6);
  EXPECT_NEAR(form_factor(kCeiling, kFloor, box(-0.3, 0.4)), standing, 2e-6);
  EXPECT_LT(standing, 0.8 * form_factor(kFloor, kCeiling));
  // All of the patch in the box: nothing leaves it.
  EXPECT_EQ(form_factor(plate(0.3, 0.5, 0.4, 0.7, 0), kCeiling, box(-0.3, 0.4)), 0);
}

TEST(PolygonPolicy, TakesAnOccluderThatIsNotConvex) {
  const PolygonCorners angle = {{0, 0, 0.4},     {0.8, 0, 0.4},   {0.8, 0.3, 0.4},
                                {0.3, 0.3, 0.4}, {0.3, 0.9, 0.4}, {0, 0.9, 0.4}};
  EXPECT_NEAR(form_factor(kFloor, kCeiling, {angle}),
              form_factor(kFloor, kCeiling, {plate(0, 0.8, 0, 0.3, 0.4), plate(0, 0.3, 0.3, 0.9, 0.4)}), 2e-6);
}

}  // namespace
}  // namespace radbake::radiosity
