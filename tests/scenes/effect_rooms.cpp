#include "tests/scenes/effect_rooms.h"

#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "tests/scenes/rooms.h"
#include "tests/scenes/solids.h"

namespace radbake::tests {
namespace {

constexpr double kEdge = 2;  // of a room, m
constexpr int kCells = 5;    // of the atlas, along a side: small charts, quick bakes
constexpr Vec3 kWhite{1, 1, 1};
constexpr Vec3 kMiddle{kEdge / 2, kEdge / 2, kEdge / 2};
constexpr Vec3 kDown{0, -1, 0};

Vec3 grey(double value) { return kWhite * value; }

/// A room of quads, built part by part.
class Room {
 public:
  Room() : walls_(builder_.add_material("walls", grey(0.5))) {}

  int material(const std::string& name, double reflectance) { return builder_.add_material(name, grey(reflectance)); }
  Material& at(int material) { return builder_.scene().materials[static_cast<std::size_t>(material)]; }
  int walls() const { return walls_; }
  Scene& scene() { return builder_.scene(); }

  /// A quad whose texture coordinates run from 0 to 1 along its sides.
  void quad(const std::string& name, Vec3 origin, Vec3 s, Vec3 t, int material) {
    builder_.add_quad(name, origin, s, t, material);
    scene().meshes.back().texcoord0 = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  }
  void floor(int material) { quad("floor", {0, 0, 0}, {0, 0, kEdge}, {kEdge, 0, 0}, material); }
  void ceiling(int material) { quad("ceiling", {0, kEdge, 0}, {kEdge, 0, 0}, {0, 0, kEdge}, material); }
  void left_wall(int material) { quad("left", {0, 0, 0}, {0, kEdge, 0}, {0, 0, kEdge}, material); }
  void other_walls() {
    quad("right", {kEdge, 0, 0}, {0, 0, kEdge}, {0, kEdge, 0}, walls_);
    quad("back", {0, 0, 0}, {kEdge, 0, 0}, {0, kEdge, 0}, walls_);
    quad("front", {0, 0, kEdge}, {0, kEdge, 0}, {kEdge, 0, 0}, walls_);
  }
  /// Open at the top.
  void pit() {
    floor(walls_);
    left_wall(walls_);
    other_walls();
  }
  void closed() {
    pit();
    ceiling(walls_);
  }
  /// A level sheet amid the room that faces up.
  void sheet(const std::string& name, int material, double low = 0.5, double high = 1.5) {
    quad(name, {low, 0.75, low}, {0, 0, high - low}, {high - low, 0, 0}, material);
  }

  void point(Vec3 position, Vec3 candela) { scene().lights.push_back({"lamp", PointLight{position, candela}}); }
  void spot(double candela) {
    SpotLight spot;
    spot.position = {0.5, 1.8, 0.5};
    spot.direction = kDown;
    spot.intensity = grey(candela);
    spot.inner_cone_radians = 0.2;
    spot.outer_cone_radians = 0.5;
    scene().lights.push_back({"spot", spot});
  }
  /// Narrow, brighter to one side.
  void luminaire(double candela) {
    const auto i = static_cast<float>(candela);
    ProfileLight light;
    light.position = {0.5, 1.8, 0.5};
    light.direction = kDown;
    light.zero_side = {1, 0, 0};
    light.profile =
        std::make_shared<const LightProfile>(LightProfile{{0, 30, 60}, {0, 180}, {i, 2 * i, 0, i, i / 2, 0}});
    scene().lights.push_back({"luminaire", light});
  }
  void parallel(Vec3 direction, double lux, double diameter_degrees = 0) {
    scene().lights.push_back(
        {diameter_degrees > 0 ? "sun" : "directional",
         DirectionalLight{normalized(direction), grey(lux), diameter_degrees * std::numbers::pi / 180}});
  }
  /// The lamp of most rooms: above the middle.
  void lamp() { point({1, 1.4, 1}, grey(1)); }

  /// value(u, v) -> a texel; channels 3, or 4 with opacity.
  template <typename Value>
  TextureReference texture(int width, int height, int channels, const Value& value) {
    scene().textures.push_back(plane(width, height, channels, value));
    TextureReference reference;
    reference.texture = static_cast<int>(scene().textures.size()) - 1;
    return reference;
  }
  template <typename Value>
  static TexturePlane plane(int width, int height, int channels, const Value& value) {
    TexturePlane plane;
    plane.name = "texture";
    plane.width = width;
    plane.height = height;
    plane.channels = channels;
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const std::array<double, 4> texel = value((x + 0.5) / width, (y + 0.5) / height);
        for (int c = 0; c < channels; ++c)
          plane.values.push_back(static_cast<float>(texel[static_cast<std::size_t>(c)]));
      }
    }
    return plane;
  }

 private:
  RoomBuilder builder_{kCells};
  int walls_;
};

// Texels of textures: red, green, blue, opacity.
using Texel = std::array<double, 4>;
Texel same(double value, double opacity = 1) { return {value, value, value, opacity}; }
/// White in one half, nearly black in the other.
Texel two_halves(double u, double) { return same(u < 0.5 ? 1 : 0.02); }
/// A hole in the middle that takes a quarter of the area.
Texel hole(double u, double v) { return same(1, std::fabs(u - 0.5) < 0.25 && std::fabs(v - 0.5) < 0.25 ? 0 : 1); }

/// Brighter above, with a bright patch beside the zenith.
Texel sky_with_patch(double u, double v) {
  if (u > 0.25 && u < 0.5 && v > 0.1 && v < 0.3) return same(10);
  return same(v < 0.5 ? 0.5 * (1 - v) : 0);
}

EffectRoom room(const std::string& name, Room& room, std::vector<std::string> on, std::vector<std::string> off) {
  return {name, room.scene(), std::move(on), std::move(off)};
}

/// A ceiling that shines: emitters, as the rest is dark.
void add_bright_ceiling(Room& room) {
  const int bright = room.material("bright", 0.5);
  room.at(bright).emissive = grey(1);
  room.pit();
  room.ceiling(bright);
}

/// A screen amid the room that stands, and takes light from both sides.
void add_screen(Room& room) {
  const int screen = room.material("screen", 0.9);
  room.at(screen).is_double_sided = true;
  room.quad("screen", {1, 0.5, 0.5}, {0, 0, 1}, {0, 1, 0}, screen);
}

int add_mask(Room& room) {
  const int mask = room.material("mask", 0.5);
  room.at(mask).alpha_mode = AlphaMode::kMask;
  room.at(mask).reflectance_texture = room.texture(32, 32, 4, hole);
  return mask;
}

int add_glass(Room& room, Vec3 transmittance) {
  const int glass = room.material("glass", 0.1);
  room.at(glass).transmittance = transmittance;
  return glass;
}

/// A curtain: reflects and lets through.
int add_curtain(Room& room) {
  const int curtain = room.material("curtain", 0.3);
  room.at(curtain).is_double_sided = true;
  room.at(curtain).diffuse_transmittance = {0.5, 0.5, 0.5};
  return curtain;
}

/// Turns quads, point lights and spots about two axes by odd angles.
void turn(Scene& scene) {
  const double a = 0.37, b = 0.81;
  const auto turned = [&](Vec3 v) {
    v = {v.x * std::cos(a) - v.y * std::sin(a), v.x * std::sin(a) + v.y * std::cos(a), v.z};
    return Vec3{v.x, v.y * std::cos(b) - v.z * std::sin(b), v.y * std::sin(b) + v.z * std::cos(b)};
  };
  for (Mesh& mesh : scene.meshes) {
    for (Vec3& position : mesh.positions) position = turned(position);
  }
  for (Light& light : scene.lights) {
    if (auto* point = std::get_if<PointLight>(&light.kind)) point->position = turned(point->position);
    if (auto* spot = std::get_if<SpotLight>(&light.kind)) {
      spot->position = turned(spot->position);
      spot->direction = turned(spot->direction);
    }
  }
}

/// Nine quads and every light there is.
Scene everything(bool has_environment) {
  Room room;
  // A floor in two colours, a red wall.
  const int floor = room.material("floor", 0.6);
  room.at(floor).reflectance_texture = room.texture(16, 16, 3, [](double u, double) {
    return u < 0.5 ? Texel{1, 0.6, 0.2, 1} : Texel{0.05, 0.1, 0.2, 1};
  });
  const int red = room.material("red", 0);
  room.at(red).reflectance = {0.8, 0.1, 0.1};
  room.floor(floor);
  room.left_wall(red);
  room.other_walls();
  // Sheets side by side, a screen that stands, and a panel that shines down from one half.
  const int mask = add_mask(room), glass = add_glass(room, {0.7, 0.4, 0.1});
  room.quad("mask", {0.1, 1.2, 1.1}, {0, 0, 0.8}, {0.8, 0, 0}, mask);
  room.quad("glass", {1.1, 1.2, 1.1}, {0, 0, 0.8}, {0.8, 0, 0}, glass);
  add_screen(room);
  const int panel = room.material("panel", 0.2);
  room.at(panel).emissive = grey(20);
  room.at(panel).emissive_texture = room.texture(16, 16, 3, two_halves);
  room.quad("panel", {1.2, 1.6, 0.2}, {0.6, 0, 0}, {0, 0, 0.6}, panel);
  room.quad("curtain", {0.2, 0.3, 0.2}, {0, 0, 0.7}, {0, 0.7, 0}, add_curtain(room));
  room.point({0.5, 0.6, 1.5}, {1, 1, 2});
  room.spot(8);
  room.luminaire(4);
  room.parallel({-0.3, -1, 0.2}, 3);
  room.parallel({0.5, -1, -0.3}, 6, 10);
  if (has_environment) {
    room.scene().environment = Room::plane(32, 16, 3, sky_with_patch);
  } else {
    room.scene().sky = grey(1);
  }
  return room.scene();
}

}  // namespace

EffectRoom empty_room() {
  Room own;
  own.closed();
  own.lamp();
  return room("empty", own, {"point", "interreflection"}, {"occlusion", "color"});
}

EffectRoom room_with_block() {
  RoomBuilder builder(kCells);
  const int walls = builder.add_material("walls", grey(0.5));
  builder.add_box("room", {0, 0, 0}, {kEdge, kEdge, kEdge}, walls, true);
  builder.add_box("block", {0.3, 0.3, 0.3}, {0.8, 0.8, 0.8}, walls, false);
  builder.scene().lights.push_back({"lamp", PointLight{{1, 1.4, 1}, grey(1)}});
  return {"block", builder.scene(), {"point", "occlusion", "interreflection"}, {"color"}};
}

std::vector<EffectRoom> rooms_with_effects() {
  std::vector<EffectRoom> rooms;
  {
    Room own;
    add_bright_ceiling(own);
    own.point(kMiddle, grey(0.2));
    rooms.push_back(room("emitters", own, {"emitters", "point", "interreflection"}, {"occlusion", "color"}));
  }
  {
    Room own;
    add_bright_ceiling(own);
    own.point(kMiddle, grey(0.5));
    rooms.push_back(room("point", own, {"emitters", "point", "interreflection"}, {"occlusion", "color"}));
  }
  {
    Room own;
    own.closed();
    own.lamp();
    own.spot(2);
    rooms.push_back(room("spot", own, {"point", "spot", "interreflection"}, {"occlusion", "color"}));
  }
  {
    Room own;
    own.closed();
    own.lamp();
    own.luminaire(2);
    rooms.push_back(room("ies", own, {"point", "ies", "interreflection"}, {"occlusion", "color"}));
  }
  {
    Room own;
    own.pit();
    own.lamp();
    own.parallel({0.5, -1, 0.3}, 1);
    rooms.push_back(room("directional", own, {"point", "directional", "occlusion", "interreflection"}, {"color"}));
  }
  {
    Room own;
    own.pit();
    own.lamp();
    own.parallel({0.5, -1, 0.3}, 1, 10);
    rooms.push_back(room("sun", own, {"point", "sun", "occlusion", "interreflection"}, {"color"}));
  }
  {
    Room own;
    own.pit();
    own.lamp();
    own.scene().sky = grey(1);
    rooms.push_back(room("sky", own, {"point", "sky", "interreflection"}, {"occlusion", "color"}));
  }
  {
    Room own;
    own.pit();
    own.lamp();
    own.scene().environment = Room::plane(32, 16, 3, sky_with_patch);
    rooms.push_back(room("hdri", own, {"point", "hdri", "occlusion", "interreflection"}, {"color"}));
  }
  {
    EffectRoom own = room_with_block();
    own.name = "occlusion";
    rooms.push_back(own);
  }
  {
    // A floor and a wall at right angles.
    Room own;
    own.floor(own.walls());
    own.left_wall(own.walls());
    own.point(kMiddle, grey(1));
    rooms.push_back(room("interreflection", own, {"point", "interreflection"}, {"occlusion", "color"}));
  }
  {
    Room own;
    const int red = own.material("red", 0);
    own.at(red).reflectance = {0.8, 0.1, 0.1};
    own.floor(own.walls());
    own.left_wall(red);
    own.other_walls();
    own.ceiling(own.walls());
    own.lamp();
    rooms.push_back(room("color", own, {"point", "interreflection", "color"}, {"occlusion"}));
  }
  {
    Room own;
    const int floor = own.material("floor", 0.9);
    own.at(floor).reflectance_texture = own.texture(16, 16, 3, two_halves);
    own.floor(floor);
    own.left_wall(own.walls());
    own.other_walls();
    own.ceiling(own.walls());
    own.lamp();
    rooms.push_back(room("textured_reflectance", own, {"point", "interreflection", "textured_reflectance"},
                         {"occlusion", "color"}));
  }
  {
    Room own;
    const int bright = own.material("bright", 0.5);
    own.at(bright).emissive = grey(1);
    own.at(bright).emissive_texture = own.texture(16, 16, 3, two_halves);
    own.pit();
    own.ceiling(bright);
    rooms.push_back(
        room("textured_emission", own, {"emitters", "interreflection", "textured_emission"}, {"occlusion", "color"}));
  }
  {
    Room own;
    own.closed();
    own.sheet("mask", add_mask(own));
    own.lamp();
    // Only the mask's opacity varies.
    rooms.push_back(room("alpha_mask", own, {"point", "occlusion", "interreflection", "alpha_mask"},
                         {"color", "textured_reflectance"}));
  }
  {
    Room own;
    own.closed();
    own.sheet("glass", add_glass(own, grey(0.6)));
    own.lamp();
    rooms.push_back(room("tint", own, {"point", "occlusion", "interreflection", "tint"}, {"color"}));
  }
  {
    Room own;
    own.closed();
    own.sheet("curtain", add_curtain(own));
    own.lamp();
    rooms.push_back(room("diffuse_transmission", own,
                         {"point", "occlusion", "interreflection", "diffuse_transmission", "two_sided"}, {"color"}));
  }
  {
    Room own;
    own.closed();
    add_screen(own);
    own.point({0.4, 1, 1}, grey(1));
    rooms.push_back(room("two_sided", own, {"point", "occlusion", "interreflection", "two_sided"}, {"color"}));
  }
  const std::vector<std::string> all = {"emitters",          "point",      "spot",
                                        "directional",       "sun",        "occlusion",
                                        "interreflection",   "color",      "textured_reflectance",
                                        "textured_emission", "alpha_mask", "tint",
                                        "two_sided",         "ies",        "diffuse_transmission"};
  rooms.push_back({"all", everything(true), all, {}});
  rooms.back().on.push_back("hdri");
  rooms.push_back({"all_with_sky", everything(false), all, {}});
  rooms.back().on.push_back("sky");
  return rooms;
}

std::vector<EffectRoom> rooms_without_effects() {
  std::vector<EffectRoom> rooms;
  {
    Room own;
    const int floor = own.material("floor", 0.9);
    own.at(floor).reflectance_texture = own.texture(8, 4, 3, [](double, double) { return same(0.3); });
    own.floor(floor);
    own.left_wall(own.walls());
    own.other_walls();
    own.ceiling(own.walls());
    own.lamp();
    rooms.push_back(
        room("flat_reflectance", own, {"point", "interreflection"}, {"occlusion", "color", "textured_reflectance"}));
  }
  {
    Room own;
    own.closed();
    Mesh& floor = own.scene().meshes.front();
    floor.colors.assign(floor.positions.size(), {0.7, 0.7, 0.7});
    own.lamp();
    rooms.push_back(
        room("flat_vertex_colors", own, {"point", "interreflection"}, {"occlusion", "color", "textured_reflectance"}));
  }
  {
    Room own;
    const int bright = own.material("bright", 0.5);
    own.at(bright).emissive = grey(1);
    own.at(bright).emissive_texture = own.texture(8, 4, 3, [](double, double) { return same(0.3); });
    own.pit();
    own.ceiling(bright);
    rooms.push_back(
        room("flat_emission", own, {"emitters", "interreflection"}, {"occlusion", "color", "textured_emission"}));
  }
  {
    Room own;
    const int dark = own.material("dark", 0.5);
    own.at(dark).emissive = grey(1);
    own.at(dark).emissive_texture = own.texture(4, 4, 3, [](double, double) { return same(0); });
    own.pit();
    own.ceiling(dark);
    own.lamp();
    rooms.push_back(room("dark_emission", own, {"point", "interreflection"},
                         {"emitters", "occlusion", "color", "textured_emission"}));
  }
  {
    // Opaque to more than the cutoff, everywhere.
    Room own;
    const int mask = own.material("mask", 0.5);
    own.at(mask).alpha_mode = AlphaMode::kMask;
    own.at(mask).reflectance_texture =
        own.texture(8, 8, 4, [](double u, double) { return same(1, u < 0.5 ? 1 : 0.6); });
    own.closed();
    own.sheet("mask", mask);
    own.lamp();
    rooms.push_back(room("opaque_mask", own, {"point", "occlusion", "interreflection"},
                         {"color", "textured_reflectance", "alpha_mask"}));
  }
  {
    Room own;
    const int blend = own.material("blend", 0.5);
    own.at(blend).alpha_mode = AlphaMode::kBlend;
    own.closed();
    own.sheet("blend", blend);
    own.lamp();
    rooms.push_back(room("opaque_blend", own, {"point", "occlusion", "interreflection"}, {"color", "alpha_mask"}));
  }
  {
    // Lights of zero intensity, of each kind.
    Room own;
    own.pit();
    own.scene().sky = grey(1);
    own.point(kMiddle, {});
    own.spot(0);
    own.parallel(kDown, 0);
    own.parallel(kDown, 0, 10);
    rooms.push_back(room("zero_lamps", own, {"sky", "interreflection"},
                         {"point", "spot", "directional", "sun", "occlusion", "color"}));
  }
  {
    Room own;
    own.pit();
    own.lamp();
    own.scene().environment = Room::plane(8, 4, 3, [](double, double) { return same(0); });
    rooms.push_back(room("black_environment", own, {"point", "interreflection"}, {"hdri", "occlusion", "color"}));
  }
  {
    // Everything outside of a closed room.
    Room own;
    own.closed();
    own.lamp();
    own.scene().sky = grey(10);
    own.point({1, 5, 1}, grey(100));
    own.parallel({0.5, -1, 0.3}, 10);
    own.parallel({0.5, -1, 0.3}, 10, 10);
    // One of the two lamps is inside.
    rooms.push_back(room("closed_under_sky", own, {"point", "occlusion", "interreflection"},
                         {"directional", "sun", "sky", "color"}));
  }
  {
    Room own;
    own.closed();
    own.lamp();
    own.scene().environment = Room::plane(16, 8, 3, sky_with_patch);
    rooms.push_back(
        room("closed_under_environment", own, {"point", "interreflection"}, {"hdri", "occlusion", "color"}));
  }
  {
    // A floor lit from below, under a sky: one surface sees nothing but the sky.
    Room own;
    own.floor(own.walls());
    own.parallel({0.3, 1, 0}, 10);
    own.parallel({0.3, 1, 0}, 10, 10);
    own.point({1, -1, 1}, grey(10));
    own.scene().sky = grey(1);
    rooms.push_back(
        room("lit_from_below", own, {"sky"}, {"point", "directional", "sun", "occlusion", "interreflection", "color"}));
  }
  {
    Room own;
    const int black = own.material("black", 0);
    own.floor(black);
    own.left_wall(black);
    own.lamp();
    own.parallel({-0.5, -1, 0.3}, 1);
    rooms.push_back(room("black_walls", own, {"point", "directional"}, {"occlusion", "interreflection", "color"}));
  }
  {
    Room own;
    own.at(own.walls()).is_double_sided = true;
    own.closed();
    own.lamp();
    rooms.push_back(room("double_sided_walls", own, {"point", "interreflection"}, {"occlusion", "color", "two_sided"}));
  }
  {
    // Light straight down, along the walls.
    Room own;
    own.pit();
    own.lamp();
    own.parallel(kDown, 1);
    rooms.push_back(room("lit_from_above", own, {"point", "directional", "interreflection"}, {"occlusion", "color"}));
  }
  {
    // No wall lies in a plane of the axes: rounding is in every plane.
    Room own;
    own.closed();
    own.lamp();
    own.spot(2);
    turn(own.scene());
    rooms.push_back(room("turned", own, {"point", "spot", "interreflection"}, {"occlusion", "color"}));
  }
  {
    // A sphere seen from inside: each facet sees its neighbours at a grazing angle.
    EffectRoom own{"sphere", {}, {"point", "interreflection"}, {"occlusion", "color"}};
    Mesh sphere = make_sphere(6);
    for (auto& triangle : sphere.triangles) std::swap(triangle[1], triangle[2]);
    for (Vec3& normal : sphere.normals) normal = -normal;
    own.scene.meshes = {sphere};
    own.scene.materials.resize(1);
    own.scene.lights = {{"lamp", PointLight{{0.3, 0.2, 0.1}, grey(1)}}};
    rooms.push_back(own);
  }
  {
    // A tinted sheet and a mask with a hole, with nothing behind that could be lit.
    Room own;
    own.quad("glass", {0, 0, 0}, {0, 0, 1}, {1, 0, 0}, add_glass(own, grey(0.6)));
    own.quad("mask", {1, 0, 0}, {0, 0, 1}, {1, 0, 0}, add_mask(own));
    own.lamp();
    rooms.push_back(room("sheets_over_nothing", own, {"point"},
                         {"occlusion", "interreflection", "color", "textured_reflectance", "alpha_mask", "tint"}));
  }
  return rooms;
}

}  // namespace radbake::tests
