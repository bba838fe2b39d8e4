#pragma once

#include "common/scene/scene.h"

namespace radbake::tests {

/// A sphere of radius 1 m about the origin, `rings` x 2 `rings` quads, seen from outside, with normals, without layout.
Mesh make_sphere(int rings);

/// A vase: a surface of revolution with a foot, a belly, a neck and an inside, 1.2 m high, with normals.
Mesh make_vase(int segments);

/// A hall of 20 x 6 x 15 m with 199 boxes of seeded sizes and places: 200 meshes without layout.
Scene make_furnished_hall();

/// A closed box of 1 x 1 x 1 m seen from inside, its top turned by an angle: its sides (meshes 2 to 5) are quads that
/// are not planar, each folded inwards along its longer diagonal. Bottom, top and sides glow with E = 1 lx; reflectance
/// 0.5. Without layout.
Scene twisted_box(double radians);

}  // namespace radbake::tests
