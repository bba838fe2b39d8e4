#include "server/radiosity/survey/texture.h"

#include <algorithm>
#include <cmath>

namespace radbake::radiosity {
namespace {

/// Index of a texel along one side after wrapping. Precondition: size > 0.
int wrapped(double texel, int size, Wrap wrap) {
  double index = 0;
  switch (wrap) {
    case Wrap::kClamp: index = std::clamp(texel, 0.0, size - 1.0); break;
    case Wrap::kRepeat: index = texel - size * std::floor(texel / size); break;
    case Wrap::kMirror: {
      const double in_period = texel - 2.0 * size * std::floor(texel / (2.0 * size));
      index = in_period < size ? in_period : 2.0 * size - 1 - in_period;
    }
  }
  // Beyond 2^53 the period is lost in rounding: any texel, but one that exists.
  return index >= 0 && index < size ? static_cast<int>(index) : 0;
}

/// What lies between four texels: read(texel), a pointer to its channels, gives the value of one.
template <typename Read>
auto between_texels(const TexturePlane& texture, Vec2 uv, const Read& read) {
  // Texel centres lie at half numbers.
  const double x = uv.x * texture.width - 0.5, y = uv.y * texture.height - 0.5;
  const double x0 = std::floor(x), y0 = std::floor(y);
  const auto texel = [&](int dx, int dy) {
    const int column = wrapped(x0 + dx, texture.width, texture.wrap_s);
    const int row = wrapped(y0 + dy, texture.height, texture.wrap_t);
    return read(&texture.values[(static_cast<std::size_t>(row) * texture.width + column) * texture.channels]);
  };
  // Between equal texels this form gives that value itself, to the last bit.
  const auto between = [](auto a, auto b, double share) { return a + (b - a) * share; };
  return between(between(texel(0, 0), texel(1, 0), x - x0), between(texel(0, 1), texel(1, 1), x - x0), y - y0);
}

}  // namespace

Vec3 sampled_texture(const TexturePlane& texture, Vec2 uv) {
  return between_texels(texture, uv, [](const float* value) { return Vec3{value[0], value[1], value[2]}; });
}

double sampled_opacity(const TexturePlane& texture, Vec2 uv) {
  if (texture.channels < 4) return 1;
  return between_texels(texture, uv, [](const float* value) { return static_cast<double>(value[3]); });
}

double least_opacity(const TexturePlane& texture) {
  if (texture.channels < 4 || texture.values.empty()) return 1;
  double least = texture.values[3];
  for (std::size_t at = 3; at < texture.values.size(); at += 4) least = std::min<double>(least, texture.values[at]);
  return least;
}

Vec3 brightest(const Scene& scene, const std::optional<TextureReference>& use) {
  if (!use) return {1, 1, 1};
  const TexturePlane& texture = scene.textures[static_cast<std::size_t>(use->texture)];
  Vec3 most;
  for (std::size_t at = 0; at + 2 < texture.values.size(); at += static_cast<std::size_t>(texture.channels)) {
    for (std::size_t c = 0; c < 3; ++c) {
      most[static_cast<int>(c)] = std::max<double>(most[static_cast<int>(c)], texture.values[at + c]);
    }
  }
  return most;
}

}  // namespace radbake::radiosity
