#include "tests/scenes/cube_rooms.h"

#include <cmath>
#include <functional>
#include <numbers>

#include "common/base/check.h"
#include "tests/scenes/rooms.h"

namespace radbake::tests {

double wall_to_floor(double along, double height) {
  const auto to_one_side = [height](double b) {
    if (b <= 0) return 0.0;
    const double X = 1 / b, Y = height / b, s = std::hypot(X, Y);
    return (std::atan2(1.0, Y) - Y / s * std::atan(1 / s)) / (2 * std::numbers::pi);
  };
  return to_one_side(along) + to_one_side(1 - along);
}

double ceiling_to_floor(double x, double z) {
  const auto corner = [](double a, double b) {
    const double s = std::sqrt(1 + a * a), t = std::sqrt(1 + b * b);
    return (a / s * std::atan(b / s) + b / t * std::atan(a / t)) / (2 * std::numbers::pi);
  };
  return corner(x, z) + corner(1 - x, z) + corner(x, 1 - z) + corner(1 - x, 1 - z);
}

Scene manufactured_room(double reflectance, int texture_size) {
  RADBAKE_CHECK(reflectance <= 0.6);
  RoomBuilder builder(3);
  const Vec3 white = Vec3{1, 1, 1};
  const int floor = builder.add_material("floor", white * reflectance, white * (1.5 - reflectance));
  const int ceiling = builder.add_material("ceiling", white * reflectance, white);
  const int wall = builder.add_material("wall", white * reflectance, white);
  const Vec3 x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};
  // Walls run with s along them and t upwards; (s, t) of the ceiling is (x, z).
  builder.add_quad("floor", {0, 0, 0}, z, x, floor);
  builder.add_quad("ceiling", y, x, z, ceiling);
  builder.add_quad("wall", {0, 0, 0}, x, y, wall);
  builder.add_quad("wall", x, z, y, wall);
  builder.add_quad("wall", x + z, -x, y, wall);
  builder.add_quad("wall", z, -z, y, wall);
  Scene scene = builder.scene();
  for (Mesh& mesh : scene.meshes) mesh.texcoord0 = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

  const auto add_texture = [&](int material, const std::function<double(double, double)>& to_floor) {
    TexturePlane texture{"exitance", texture_size, texture_size, 3, Wrap::kClamp, Wrap::kClamp, {}};
    for (int row = 0; row < texture_size; ++row) {
      for (int column = 0; column < texture_size; ++column) {
        const double share = to_floor((column + 0.5) / texture_size, (row + 0.5) / texture_size);
        texture.values.insert(texture.values.end(), 3, static_cast<float>(1 - reflectance * (1 + share / 2)));
      }
    }
    scene.materials[static_cast<std::size_t>(material)].emissive_texture =
        TextureReference{static_cast<int>(scene.textures.size()), 0};
    scene.textures.push_back(std::move(texture));
  };
  add_texture(ceiling, ceiling_to_floor);
  add_texture(wall, wall_to_floor);
  return scene;
}

Scene cube_with_lamp(double reflectance) {
  RoomBuilder builder(4);
  const Vec3 white{1, 1, 1};
  const int grey = builder.add_material("grey", white * reflectance);
  const int lamp = builder.add_material("lamp", white * reflectance, white * kLampExitance);
  builder.add_box("room", {0, 0, 0}, {1, 1, 1}, grey, true);
  const double cuts[] = {0, kLampLow, kLampHigh, 1};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const bool is_lamp = i == 1 && j == 1;
      builder.add_quad(is_lamp ? "lamp" : "ceiling", {cuts[i], 1, cuts[j]}, {cuts[i + 1] - cuts[i], 0, 0},
                       {0, 0, cuts[j + 1] - cuts[j]}, is_lamp ? lamp : grey);
    }
  }
  Scene scene = builder.scene();
  scene.meshes.erase(scene.meshes.begin() + 1);  // the box's own top
  return scene;
}

}  // namespace radbake::tests
