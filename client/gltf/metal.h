#pragma once

#include "common/scene/scene.h"

namespace radbake::gltf {

/// Factors of a material's metalness and roughness. A texture multiplies them: metalness is its blue channel, roughness
/// its green one.
struct MetalRoughness {
  double metallic = 0;
  double roughness = 1;
};

/// What a metallic-roughness surface reflects of its base colour, as diffuse light.
///
///   diffuse = (1 - m) + m r^2 / 2        m: metalness, r: roughness as glTF has it (perceptual)
///
/// A metal has no diffuse light of its own, and a diffuse bake no mirrors; yet a rough metal scatters its colour much
/// like paint. Engines that bake give it the part r^2 / 2, so that rooms of metal are not black, nor as bright as white
/// paint. Without that, m = 1 would leave 0, and base colour as it is would leave 1.
/// Source: Unity, meta pass of the Universal Render Pipeline: albedo = diffuse + specular * roughness * 0.5, where
/// roughness is the square of the perceptual one, diffuse = (1 - m) base, specular = m base of a metal.
struct MetalShares {
  double diffuse = 1;     ///< of the base colour
  double dielectric = 1;  ///< 1 - m: the part that transmission may let through
};
MetalShares metal_shares(const MetalRoughness& surface);

/// Their mean over all texels of a texture of metalness and roughness.
MetalShares mean_metal_shares(const MetalRoughness& factors, const TexturePlane& texture);

/// The share `diffuse` at a point of such a texture: metalness and roughness are interpolated between texel centres.
/// uv is inside 0..1; beyond the border texels the texture's wrap modes hold.
double diffuse_share_at(const MetalRoughness& factors, const TexturePlane& texture, Vec2 uv);

}  // namespace radbake::gltf
