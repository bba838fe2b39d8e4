#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "common/scene/scene.h"

namespace radbake::tests {

/// A small scene, and which effects a plan of it must find: by id; all others are absent.
struct EffectRoom {
  std::string name;
  Scene scene;
  std::vector<std::string> on;
  std::vector<std::string> off;  ///< there, and without effect
};
/// For the names of tests.
inline void PrintTo(const EffectRoom& room, std::ostream* out) { *out << room.name; }

/// A room for each effect that light has, named as the effect, and two with all of them: `all` has a sky of every
/// direction, `all_with_sky` one of one luminance. Each room has two sources of light of different kinds, so that
/// either can be left out.
///
/// Rooms are of 2 x 2 x 2 m and reflect half; each quad has a chart of RoomBuilder(5): about 100 texels in an atlas of
/// 64 x 64.
std::vector<EffectRoom> rooms_with_effects();

/// Rooms in which an effect is there and changes nothing: flat textures, masks without holes, dark lights, light that
/// cannot enter or meets no front, backs that nothing sees, black walls, and convex rooms in which rounding might hide
/// something. Named as what they hold.
std::vector<EffectRoom> rooms_without_effects();

/// An empty convex room lit by a lamp in it, in grey: what costs less where no colour and no occluder is. The same with
/// a block amid it.
EffectRoom empty_room();
EffectRoom room_with_block();

}  // namespace radbake::tests
