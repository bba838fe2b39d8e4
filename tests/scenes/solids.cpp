#include "tests/scenes/solids.h"

#include <cmath>
#include <numbers>
#include <random>

namespace radbake::tests {
namespace {

/// A surface of revolution about y through points (radius, height), from below upwards on the outside.
Mesh revolved(const std::string& name, const std::vector<Vec2>& profile, int segments) {
  Mesh mesh;
  mesh.name = name;
  for (std::size_t i = 0; i < profile.size(); ++i) {
    const Vec2 before = profile[i > 0 ? i - 1 : i], after = profile[i + 1 < profile.size() ? i + 1 : i];
    const Vec2 along = after - before;
    for (int s = 0; s <= segments; ++s) {
      const double angle = 2 * std::numbers::pi * s / segments;
      // The last column lies exactly on the first.
      const double c = s == segments ? 1 : std::cos(angle), d = s == segments ? 0 : std::sin(angle);
      mesh.positions.push_back({profile[i].x * c, profile[i].y, -profile[i].x * d});
      mesh.normals.push_back(normalized(Vec3{along.y * c, -along.x, -along.y * d}));
    }
  }
  const auto vertex = [&](std::size_t ring, int s) {
    return static_cast<std::uint32_t>(ring * static_cast<std::size_t>(segments + 1)) + static_cast<std::uint32_t>(s);
  };
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    for (int s = 0; s < segments; ++s) {
      if (profile[i].x > 0) mesh.triangles.push_back({vertex(i, s), vertex(i, s + 1), vertex(i + 1, s)});
      if (profile[i + 1].x > 0) mesh.triangles.push_back({vertex(i, s + 1), vertex(i + 1, s + 1), vertex(i + 1, s)});
    }
  }
  return mesh;
}

Mesh make_box(const std::string& name, Vec3 low, Vec3 high, bool faces_in) {
  Mesh mesh;
  mesh.name = name;
  for (int axis = 0; axis < 3; ++axis) {
    for (const bool is_high : {false, true}) {
      const int s = (axis + 1) % 3, t = (axis + 2) % 3;
      const auto first = static_cast<std::uint32_t>(mesh.positions.size());
      for (int k = 0; k < 4; ++k) {
        Vec3 p;
        p[axis] = is_high ? high[axis] : low[axis];
        p[s] = k == 1 || k == 2 ? high[s] : low[s];
        p[t] = k >= 2 ? high[t] : low[t];
        mesh.positions.push_back(p);
      }
      if (is_high != faces_in) {
        mesh.triangles.push_back({first, first + 1, first + 2});
        mesh.triangles.push_back({first, first + 2, first + 3});
      } else {
        mesh.triangles.push_back({first, first + 2, first + 1});
        mesh.triangles.push_back({first, first + 3, first + 2});
      }
    }
  }
  return mesh;
}

}  // namespace

Mesh make_sphere(int rings) {
  std::vector<Vec2> profile;
  for (int i = 0; i <= rings; ++i) {
    const double angle = std::numbers::pi * i / rings;
    const bool is_pole = i == 0 || i == rings;
    profile.push_back({is_pole ? 0 : std::sin(angle), -std::cos(angle)});
  }
  return revolved("sphere", profile, 2 * rings);
}

Mesh make_vase(int segments) {
  const std::vector<Vec2> profile = {{0, 0},       {0.25, 0},    {0.25, 0.04}, {0.12, 0.1},  {0.1, 0.18},
                                     {0.22, 0.32}, {0.35, 0.5},  {0.38, 0.62}, {0.33, 0.78}, {0.2, 0.92},
                                     {0.13, 1.05}, {0.16, 1.2},  {0.14, 1.2},  {0.11, 1.05}, {0.17, 0.92},
                                     {0.3, 0.78},  {0.34, 0.62}, {0.3, 0.5},   {0.15, 0.34}, {0, 0.3}};
  return revolved("vase", profile, segments);
}

Scene make_furnished_hall() {
  Scene scene;
  scene.materials.emplace_back();
  scene.meshes.push_back(make_box("hall", {0, 0, 0}, {20, 6, 15}, true));
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> share(0, 1);
  while (scene.meshes.size() < 200) {
    const Vec3 size{0.2 + share(random), 0.2 + 1.5 * share(random), 0.2 + share(random)};
    const Vec3 low{(20 - size.x) * share(random), 0, (15 - size.z) * share(random)};
    scene.meshes.push_back(make_box("box" + std::to_string(scene.meshes.size()), low, low + size, false));
  }
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) scene.meshes[i].object = static_cast<int>(i);
  scene.sky = {1, 1, 1};
  return scene;
}

Scene twisted_box(double radians) {
  Scene scene;
  Material& glowing = scene.materials.emplace_back();
  glowing.reflectance = {0.5, 0.5, 0.5};
  glowing.emissive = Vec3{1, 1, 1} / std::numbers::pi;
  std::vector<Vec3> bottom, top;
  for (int k = 0; k < 4; ++k) {
    const double angle = std::numbers::pi / 2 * k, radius = std::sqrt(0.5);
    bottom.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
    top.push_back({radius * std::cos(angle + radians), radius * std::sin(angle + radians), 1});
  }
  const auto add = [&](const std::string& name, std::vector<Vec3> positions) {
    Mesh& mesh = scene.meshes.emplace_back();
    mesh.name = name;
    mesh.object = static_cast<int>(scene.meshes.size()) - 1;
    mesh.positions = std::move(positions);
    mesh.triangles = {{1, 2, 3}, {3, 0, 1}};
  };
  add("bottom", {bottom[0], bottom[1], bottom[2], bottom[3]});
  add("top", {top[3], top[2], top[1], top[0]});
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t next = (k + 1) % 4;
    add("side" + std::to_string(k), {bottom[next], bottom[k], top[k], top[next]});
  }
  return scene;
}

}  // namespace radbake::tests
