#pragma once

#include <string>

#include "common/scene/scene.h"

namespace radbake::tests {

/// Builds scenes of flat quads, each with a chart of its own in one atlas.
///
/// Charts are laid on a square grid of cells with a margin, so the layout holds for any atlas of at least 64 texels.
class RoomBuilder {
 public:
  /// The atlas has room for cells x cells quads.
  explicit RoomBuilder(int cells) : cells_(cells) {}

  int add_material(const std::string& name, Vec3 reflectance, Vec3 exitance_lx = {}, bool is_double_sided = false);

  /// A parallelogram at `origin` along `s` and `t`; it faces s x t.
  void add_quad(const std::string& name, Vec3 origin, Vec3 s, Vec3 t, int material);

  /// Six quads. `faces_in`: a room that is seen from inside; else a block that is seen from outside.
  void add_box(const std::string& name, Vec3 low, Vec3 high, int material, bool faces_in);

  Scene& scene() { return scene_; }

 private:
  Scene scene_;
  int cells_;
  int next_cell_ = 0;
};

/// A closed room of 4 x 3 x 5 m with a block inside that touches nothing: every surface of one reflectance, and either
/// every surface glows with E = 1 lx, or only a small panel below the ceiling does, with the same total power.
Scene furnace_room(double reflectance);
Scene small_emitter_room(double reflectance);

}  // namespace radbake::tests
