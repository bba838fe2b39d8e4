#pragma once

#include "server/radiosity/bake/bake.h"

namespace radbake::tests {

/// Ignores what a bake tells.
class SilentObserver final : public radiosity::BakeObserver {
 public:
  void on_progress(const radiosity::BakeProgress&) override {}
  void on_tile(const radiosity::Tile&) override {}
};

/// Bakes, and fails the test with the error's message where that fails.
radiosity::BakeOutcome baked(const Scene& scene, const radiosity::BakeOptions& options);

/// Calls visit(x, y, rgb) for every texel that lies wholly or partly in a chart (coverage above 0) and was not filled.
template <typename Visit>
void for_each_covered_texel(const radiosity::Layer& layer, const Visit& visit) {
  for (int y = 0; y < layer.height; ++y) {
    for (int x = 0; x < layer.width; ++x) {
      const float* texel = &layer.values[(static_cast<std::size_t>(y) * layer.width + x) * layer.channels];
      if (texel[3] > 0) visit(x, y, Vec3{texel[0], texel[1], texel[2]});
    }
  }
}

}  // namespace radbake::tests
