#include "common/scene/light_profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace radbake {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFloat = 1e-6;  // intensities are of single precision

LightProfile profile(std::vector<double> vertical, std::vector<double> horizontal, std::vector<float> candela) {
  return {std::move(vertical), std::move(horizontal), std::move(candela)};
}

/// In a direction given by its angles.
double intensity(const LightProfile& of, double vertical, double horizontal) {
  const double v = vertical * kPi / 180, h = horizontal * kPi / 180;
  return of.intensity(std::cos(v), std::sin(v) * std::cos(h), std::sin(v) * std::sin(h));
}

TEST(LightProfile, OfASphereSendsFourPi) {
  EXPECT_NEAR(profile({0, 90, 180}, {0}, {10, 10, 10}).lumens(), 40 * kPi, 40 * kPi * kFloat);
  EXPECT_NEAR(profile({0, 180}, {0, 90, 360}, {10, 10, 10, 10, 10, 10}).lumens(), 40 * kPi, 40 * kPi * kFloat);
  EXPECT_NEAR(profile({0, 90}, {0}, {10, 10}).lumens(), 20 * kPi, 20 * kPi * kFloat);
}

// I = I0 cos: pi I0. Between angles of 2.5 degrees the cosine is linear within 2.4e-4.
TEST(LightProfile, OfALambertianSurfaceSendsPi) {
  std::vector<double> vertical;
  std::vector<float> candela;
  for (int k = 0; k <= 36; ++k) {
    vertical.push_back(2.5 * k);
    candela.push_back(static_cast<float>(std::cos(vertical.back() * kPi / 180)));
  }
  EXPECT_NEAR(profile(vertical, {0}, candela).lumens(), kPi, kPi * 2.4e-4);
}

TEST(LightProfile, IsBilinearBetweenItsAngles) {
  const LightProfile own = profile({0, 90}, {0, 90, 180, 270, 360}, {4, 8, 4, 16, 4, 32, 4, 64, 4, 8});
  EXPECT_NEAR(intensity(own, 0, 0), 4, kFloat);
  EXPECT_NEAR(intensity(own, 90, 0), 8, kFloat * 8);
  EXPECT_NEAR(intensity(own, 90, 45), 12, kFloat * 12);
  EXPECT_NEAR(intensity(own, 45, 90), 10, kFloat * 10);
  EXPECT_NEAR(intensity(own, 45, 225), (4 + 48) / 2.0, kFloat * 26);
  EXPECT_NEAR(intensity(own, 90, 359.99999), 8, 1e-4);
  EXPECT_EQ(intensity(own, 91, 0), 0);
}

TEST(LightProfile, MirrorsWhatWasNotMeasured) {
  const LightProfile half = profile({0, 90}, {0, 180}, {0, 10, 0, 20});
  EXPECT_NEAR(intensity(half, 90, 90), 15, kFloat * 15);
  EXPECT_NEAR(intensity(half, 90, 270), 15, kFloat * 15);
  const LightProfile quarter = profile({0, 90}, {0, 90}, {0, 10, 0, 20});
  for (const double horizontal : {30.0, 150.0, 210.0, 330.0}) {
    EXPECT_NEAR(intensity(quarter, 90, horizontal), 10 + 10 / 3.0, 1e-5) << horizontal;
  }
  EXPECT_NEAR(quarter.lumens(), half.lumens(), half.lumens() * kFloat);
}

TEST(LightProfile, IsRefusedWithItsFault) {
  const auto fault = [](const LightProfile& of) {
    return check_profile(of).ok() ? "" : check_profile(of).error().message;
  };
  EXPECT_EQ(fault(profile({0, 90}, {0}, {1, 2})), "");
  EXPECT_NE(fault(profile({}, {0}, {})).find("0 vertical angles"), std::string::npos);
  EXPECT_NE(fault(profile({0, 190}, {0}, {1, 2})).find("vertical angle 190"), std::string::npos);
  EXPECT_NE(fault(profile({90, 0}, {0}, {1, 2})).find("0 comes after 90"), std::string::npos);
  EXPECT_NE(fault(profile({0, 90}, {0, 120}, {1, 2, 3, 4})).find("from 0 to 120"), std::string::npos);
  EXPECT_NE(fault(profile({0, 90}, {0}, {1})).find("1 intensities for 2"), std::string::npos);
  std::vector<double> vertical, horizontal;
  for (int k = 0; k <= 180; ++k) vertical.push_back(k);
  for (int k = 0; k <= 361; ++k) horizontal.push_back(360 * k / 361.0);
  EXPECT_NE(fault(profile(vertical, horizontal, std::vector<float>(181 * 362)))
                .find("181 vertical x 362 horizontal angles: at most 65341"),
            std::string::npos);
  EXPECT_NE(fault(profile({0, 90}, {0}, {1, -2})).find("intensity -2"), std::string::npos);
  EXPECT_NE(fault(profile({0, 90}, {0}, {1, NAN})).find("intensity nan"), std::string::npos);
}

}  // namespace
}  // namespace radbake
