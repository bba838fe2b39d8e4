// What lies under a sheet whose back is seen: dark, as far as it is, and not buried.
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <utility>
#include <vector>

#include "tests/invariant/bake_support.h"
#include "tests/record_figure.h"
#include "tests/scenes/rooms.h"

namespace radbake::radiosity {
namespace {

constexpr int kCells = 4, kAtlas = 96;

/// A closed room of 4 x 2 x 4 m, lit from amid its ceiling, with a table top of 1.6 x 1.6 m over its floor, the first
/// quad. Backs of single-sided surfaces are black: a black quad just below makes no difference.
Scene room_with_table(double height, bool has_black_bottom) {
  tests::RoomBuilder builder(kCells);
  const int grey = builder.add_material("grey", {0.6, 0.6, 0.6});
  const int black = builder.add_material("black", {0, 0, 0});
  const int lamp = builder.add_material("lamp", {0, 0, 0}, {2000, 2000, 2000});
  builder.add_box("walls", {0, 0, 0}, {4, 2, 4}, grey, true);
  builder.add_quad("lamp", {1.5, 1.99, 1.5}, {1, 0, 0}, {0, 0, 1}, lamp);
  builder.add_quad("table", {1.2, height, 1.2}, {0, 0, 1.6}, {1.6, 0, 0}, grey);
  if (has_black_bottom) builder.add_quad("bottom", {1.2, height - 0.002, 1.2}, {1.6, 0, 0}, {0, 0, 1.6}, black);
  return builder.scene();
}

TEST(FloorUnderATable, IsAsDarkAsUnderABlackBottom) {
  for (const auto& [height, rays] : {std::pair(0.1, 64), {0.4, 64}, {0.1, 2048}, {0.4, 2048}, {0.9, 2048}}) {
    const BakeOptions options{.atlas_size = kAtlas, .rays = rays};
    const auto sheet = tests::baked(room_with_table(height, false), options);
    const auto closed = tests::baked(room_with_table(height, true), options);
    const std::vector<float>&values = sheet.layers.at(0).values, &expected = closed.layers.at(0).values;
    double squares = 0, sum = 0, worst = 0;
    int number = 0;
    for (int y = 0; y < kAtlas / kCells; ++y) {
      for (int x = 0; x < kAtlas / kCells; ++x) {
        const std::size_t at = 4 * (static_cast<std::size_t>(y) * kAtlas + static_cast<std::size_t>(x));
        if (expected[at + 3] == 0) continue;
        EXPECT_GT(values[at + 3], 0) << "filled at " << x << ' ' << y;
        const double difference = static_cast<double>(values[at]) - static_cast<double>(expected[at]);
        squares += difference * difference;
        sum += static_cast<double>(expected[at]);
        worst = std::max(worst, std::fabs(difference));
        ++number;
      }
    }
    ASSERT_GT(number, 300);
    const double mean = sum / number, rmse = std::sqrt(squares / number) / mean;
    // Their rays are the same, but their patches under the table are not: at most as far apart as two estimates, whose
    // standard errors are about 2 % of the mean with 64 rays, and go with the root of their number.
    const double two_estimates = 0.03 * std::sqrt(64.0 / rays);
    constexpr double kWorstOfAll = 8;  // of the RMSE: under a low table few rays get out
    EXPECT_LT(rmse, two_estimates) << height << ' ' << rays;
    EXPECT_LT(worst / mean, kWorstOfAll * two_estimates) << height << ' ' << rays;
    tests::record_figure("rmse_under_table", rmse);
    std::cout << "table at " << height << " m, " << rays << " rays: RMSE " << 100 * rmse << " %, worst "
              << 100 * worst / mean << " % of the mean\n";
  }
}

}  // namespace
}  // namespace radbake::radiosity
