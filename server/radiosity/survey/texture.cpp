#include "server/radiosity/survey/texture.h"

#include <algorithm>
#include <cmath>

namespace radbake::radiosity {
namespace {

/// Index of a texel along one side after wrapping. Precondition: size > 0.
int wrapped(double texel, int size, Wrap wrap) {
  switch (wrap) {
    case Wrap::kClamp: return static_cast<int>(std::clamp(texel, 0.0, size - 1.0));
    case Wrap::kRepeat: return static_cast<int>(texel - size * std::floor(texel / size));
    case Wrap::kMirror: {
      const double in_period = texel - 2.0 * size * std::floor(texel / (2.0 * size));
      return static_cast<int>(in_period < size ? in_period : 2.0 * size - 1 - in_period);
    }
  }
  return 0;
}

}  // namespace

Vec3 sampled_texture(const TexturePlane& texture, Vec2 uv) {
  // Texel centres lie at half numbers.
  const double x = uv.x * texture.width - 0.5, y = uv.y * texture.height - 0.5;
  const double x0 = std::floor(x), y0 = std::floor(y);
  Vec3 sum;
  for (int dy = 0; dy < 2; ++dy) {
    for (int dx = 0; dx < 2; ++dx) {
      const double weight = (dx == 0 ? 1 - (x - x0) : x - x0) * (dy == 0 ? 1 - (y - y0) : y - y0);
      const int column = std::min(wrapped(x0 + dx, texture.width, texture.wrap_s), texture.width - 1);
      const int row = std::min(wrapped(y0 + dy, texture.height, texture.wrap_t), texture.height - 1);
      const float* texel = &texture.values[(static_cast<std::size_t>(row) * texture.width + column) * texture.channels];
      sum += Vec3{texel[0], texel[1], texel[2]} * weight;
    }
  }
  return sum;
}

}  // namespace radbake::radiosity
