#include "client/gltf/metal.h"

#include <cmath>

namespace radbake::gltf {
namespace {

/// Texel before or after a border of a row of n: -1 or n may be asked for.
int wrapped(int i, int n, Wrap wrap) {
  if (i >= 0 && i < n) return i;
  if (wrap == Wrap::kRepeat) return i < 0 ? n - 1 : 0;
  return i < 0 ? 0 : n - 1;  // clamped and mirrored are one at the first texel beyond
}

/// The factors times a texel.
MetalRoughness at_texel(const MetalRoughness& factors, const TexturePlane& texture, int x, int y) {
  const std::size_t texel = std::size_t(y) * std::size_t(texture.width) + std::size_t(x);
  const float* values = &texture.values[texel * std::size_t(texture.channels)];
  return {factors.metallic * std::fmin(values[2], 1), factors.roughness * std::fmin(values[1], 1)};
}

}  // namespace

MetalShares metal_shares(const MetalRoughness& surface) {
  const double m = surface.metallic, r = surface.roughness;
  return {(1 - m) + m * r * r / 2, 1 - m};
}

MetalShares mean_metal_shares(const MetalRoughness& factors, const TexturePlane& texture) {
  MetalShares sum{0, 0};
  for (int y = 0; y < texture.height; ++y) {
    for (int x = 0; x < texture.width; ++x) {
      const MetalShares shares = metal_shares(at_texel(factors, texture, x, y));
      sum.diffuse += shares.diffuse;
      sum.dielectric += shares.dielectric;
    }
  }
  const double num_texels = double(texture.width) * texture.height;
  return {sum.diffuse / num_texels, sum.dielectric / num_texels};
}

double diffuse_share_at(const MetalRoughness& factors, const TexturePlane& texture, Vec2 uv) {
  // Bilinear between the four texel centres around the point.
  const double x = uv.x * texture.width - 0.5, y = uv.y * texture.height - 0.5;
  const double left = std::floor(x), top = std::floor(y);
  MetalRoughness mean{0, 0};
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const double weight = (dx == 1 ? x - left : 1 - (x - left)) * (dy == 1 ? y - top : 1 - (y - top));
      const MetalRoughness texel = at_texel(factors, texture, wrapped(int(left) + dx, texture.width, texture.wrap_s),
                                            wrapped(int(top) + dy, texture.height, texture.wrap_t));
      mean.metallic += weight * texel.metallic;
      mean.roughness += weight * texel.roughness;
    }
  }
  return metal_shares(mean).diffuse;
}

}  // namespace radbake::gltf
