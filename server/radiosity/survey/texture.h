#pragma once

#include "common/geometry/vector.h"
#include "common/scene/scene.h"

namespace radbake::radiosity {

/// Colour of a texture at a coordinate, bilinear between texel centres, wrapped as the texture says. Linear light.
Vec3 sampled_texture(const TexturePlane& texture, Vec2 uv);

/// Its fourth channel, in the same way; 1 where it has none.
double sampled_opacity(const TexturePlane& texture, Vec2 uv);

/// The least of its texels' fourth channel; 1 without one.
double least_opacity(const TexturePlane& texture);

/// The largest value of each colour channel; 1 without a texture.
Vec3 brightest(const Scene& scene, const std::optional<TextureReference>& use);

}  // namespace radbake::radiosity
