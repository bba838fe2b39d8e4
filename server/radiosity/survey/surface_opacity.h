#pragma once

#include "server/radiosity/survey/surfaces.h"
#include "server/radiosity/visibility/visibility.h"

namespace radbake::radiosity {

/// What rays are told of the surfaces that they cross. Refers to them: keep them in place.
class SurfaceOpacity final : public Opacity {
 public:
  explicit SurfaceOpacity(const Surfaces& surfaces) : surfaces_(surfaces) {}

  bool is_see_through(std::uint32_t triangle) const override { return surfaces_.is_see_through(triangle); }
  Vec3 opacity(std::uint32_t triangle, double u, double v) const override {
    return surfaces_.opacity({triangle, u, v});
  }

 private:
  const Surfaces& surfaces_;
};

}  // namespace radbake::radiosity
