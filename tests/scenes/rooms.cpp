#include "tests/scenes/rooms.h"

#include <numbers>

#include "common/base/check.h"

namespace radbake::tests {
namespace {

constexpr Vec3 kRoomLow{0, 0, 0}, kRoomHigh{4, 3, 5};
constexpr Vec3 kBlockLow{1, 0.5, 2}, kBlockHigh{2, 1.5, 3.5};
constexpr double kPanelEdge = 0.5;

double box_area(Vec3 low, Vec3 high) {
  const Vec3 d = high - low;
  return 2 * (d.x * d.y + d.y * d.z + d.z * d.x);
}

}  // namespace

int RoomBuilder::add_material(const std::string& name, Vec3 reflectance, Vec3 exitance_lx, bool is_double_sided) {
  Material material;
  material.name = name;
  material.reflectance = reflectance;
  material.emissive = exitance_lx / std::numbers::pi;
  material.is_double_sided = is_double_sided;
  scene_.materials.push_back(material);
  return static_cast<int>(scene_.materials.size()) - 1;
}

void RoomBuilder::add_quad(const std::string& name, Vec3 origin, Vec3 s, Vec3 t, int material) {
  RADBAKE_CHECK_LT(next_cell_, cells_ * cells_);
  constexpr double kMargin = 0.1;  // of a cell, on each side
  const double cell = 1.0 / cells_;
  const Vec2 low{(next_cell_ % cells_ + kMargin) * cell, (next_cell_ / cells_ + kMargin) * cell};
  const double edge = (1 - 2 * kMargin) * cell;
  ++next_cell_;
  Mesh mesh;
  mesh.name = name;
  mesh.material = material;
  mesh.positions = {origin, origin + s, origin + s + t, origin + t};
  mesh.texcoord1 = {low, low + Vec2{edge, 0}, low + Vec2{edge, edge}, low + Vec2{0, edge}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scene_.meshes.push_back(mesh);
}

void RoomBuilder::add_box(const std::string& name, Vec3 low, Vec3 high, int material, bool faces_in) {
  const Vec3 d = high - low;
  const Vec3 x{d.x, 0, 0}, y{0, d.y, 0}, z{0, 0, d.z};
  // Each side faces out as (s, t); swapped, it faces in.
  const auto side = [&](const char* which, Vec3 origin, Vec3 s, Vec3 t) {
    if (faces_in) std::swap(s, t);
    add_quad(name + "." + which, origin, s, t, material);
  };
  side("bottom", low, x, z);
  side("top", low + y, z, x);
  side("left", low, z, y);
  side("right", low + x, y, z);
  side("back", low, y, x);
  side("front", low + z, x, y);
}

Scene furnace_room(double reflectance) {
  RoomBuilder builder(4);
  const int glowing = builder.add_material("glowing", Vec3{1, 1, 1} * reflectance, {1, 1, 1});
  builder.add_box("room", kRoomLow, kRoomHigh, glowing, true);
  builder.add_box("block", kBlockLow, kBlockHigh, glowing, false);
  return builder.scene();
}

Scene small_emitter_room(double reflectance) {
  RoomBuilder builder(5);
  const int grey = builder.add_material("grey", Vec3{1, 1, 1} * reflectance);
  // The panel is the underside of a thin block, so that the room stays closed.
  const Vec3 panel_low{2.6, 2.8, 1}, panel_high = panel_low + Vec3{kPanelEdge, 0.1, kPanelEdge};
  const double power = box_area(kRoomLow, kRoomHigh) + box_area(kBlockLow, kBlockHigh);
  const int lamp =
      builder.add_material("lamp", Vec3{1, 1, 1} * reflectance, Vec3{1, 1, 1} * (power / (kPanelEdge * kPanelEdge)));
  builder.add_box("room", kRoomLow, kRoomHigh, grey, true);
  builder.add_box("block", kBlockLow, kBlockHigh, grey, false);
  builder.add_box("lamp", panel_low, panel_high, grey, false);
  builder.scene().meshes[12].material = lamp;  // its bottom
  return builder.scene();
}

}  // namespace radbake::tests
