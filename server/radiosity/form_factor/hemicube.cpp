#include "server/radiosity/form_factor/hemicube.h"

#include <cmath>
#include <numbers>

#include "common/base/check.h"

namespace radbake::radiosity {
namespace {

/// Form factor to the rectangle [0, x] x [0, y] of the plane z = 1; odd in both.
double top_corner(double x, double y) {
  const double u = std::sqrt(1 + x * x), v = std::sqrt(1 + y * y);
  return (x / u * std::atan(y / u) + y / v * std::atan(x / v)) / (2 * std::numbers::pi);
}

/// Form factor to the rectangle [0, y] x [0, z] of a plane at distance 1 that holds the normal; odd in y.
double side_corner(double y, double z) {
  const double w = std::sqrt(1 + z * z);
  return (std::atan(y) - std::atan(y / w) / w) / (2 * std::numbers::pi);
}

template <typename Corner>
double second_difference(const Corner& corner, double a0, double a1, double b0, double b1) {
  return corner(a1, b1) - corner(a0, b1) - corner(a1, b0) + corner(a0, b0);
}

}  // namespace

Hemicube::Hemicube(int resolution) : resolution_(resolution) {
  RADBAKE_CHECK_LE(2, resolution);
  RADBAKE_CHECK_EQ(resolution % 2, 0);
  const auto r = static_cast<std::size_t>(resolution);
  pixels_.reserve(3 * r * r);
  const auto edge = [resolution](int k) { return 2.0 * k / resolution - 1; };

  // The top face, row by row.
  for (int j = 0; j < resolution; ++j) {
    for (int i = 0; i < resolution; ++i) {
      const double x = (edge(i) + edge(i + 1)) / 2, y = (edge(j) + edge(j + 1)) / 2;
      pixels_.push_back(
          {normalized({x, y, 1}), second_difference(top_corner, edge(i), edge(i + 1), edge(j), edge(j + 1))});
    }
  }
  // The side faces: the one at x = 1, turned by quarters.
  for (int side = 0; side < 4; ++side) {
    for (int j = resolution / 2; j < resolution; ++j) {
      for (int i = 0; i < resolution; ++i) {
        const double y = (edge(i) + edge(i + 1)) / 2, z = (edge(j) + edge(j + 1)) / 2;
        const Vec3 turned[] = {{1, y, z}, {-y, 1, z}, {-1, -y, z}, {y, -1, z}};
        pixels_.push_back(
            {normalized(turned[side]), second_difference(side_corner, edge(i), edge(i + 1), edge(j), edge(j + 1))});
      }
    }
  }
}

void Hemicube::cast(const Visibility& visibility, std::array<float, 3> origin, Vec3 normal, double turn,
                    std::vector<Ray>& rays, std::vector<Hit>& hits) const {
  Frame frame(normal);
  const Vec3 s = frame.s * std::cos(turn) + frame.t * std::sin(turn);
  frame.t = frame.t * std::cos(turn) - frame.s * std::sin(turn);
  frame.s = s;
  rays.clear();
  for (const Pixel& pixel : pixels_) {
    const Vec3 d = frame.to_world(pixel.direction);
    rays.push_back({origin, {static_cast<float>(d.x), static_cast<float>(d.y), static_cast<float>(d.z)}});
  }
  hits.resize(rays.size());
  visibility.trace(rays, hits);
}

}  // namespace radbake::radiosity
