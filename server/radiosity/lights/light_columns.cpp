#include "server/radiosity/lights/light_columns.h"

#include <algorithm>
#include <cmath>

namespace radbake::radiosity {

void ReceiverColumns::fill(std::span<const Site> sites, std::span<const std::uint32_t> open, const Surfaces& surfaces) {
  size = open.size();
  position.make_room(size);
  if (lift.size() < size) {
    lift.resize(size);
    scale.resize(size);
    origin.resize(size);
  }
  const Site& first = sites[open[0]];
  is_flat = true;
  bool is_one_triangle = true;
  for (const std::uint32_t s : open) {
    is_flat = is_flat & (sites[s].facing == first.facing) & (sites[s].normal == first.normal);
    is_one_triangle = is_one_triangle & (sites[s].point.triangle == first.point.triangle);
  }
  // Any point amid the sites will do.
  middle = (first.position + sites[open[size / 4]].position + sites[open[size / 2]].position +
            sites[open[3 * size / 4]].position) /
           4;
  facing = first.facing;
  normal = first.normal;
  if (is_flat && is_one_triangle) {
    fill_plain(sites, open, surfaces);
  } else {
    fill_any(sites, open, surfaces);
  }
}

void ReceiverColumns::fill_plain(std::span<const Site> sites, std::span<const std::uint32_t> open,
                                 const Surfaces& surfaces) {
  const double offset = surfaces.ray_offsets[sites[open[0]].point.triangle];
  const Vec3 lifted = facing * offset;
  std::fill_n(lift.begin(), size, static_cast<float>(offset));
  std::fill_n(scale.begin(), size, static_cast<float>(1 / (0.5 * (1 + dot(normal, facing)))));
  double squared = 0;
  for (std::size_t k = 0; k < size; ++k) {
    const Vec3 at = sites[open[k]].position, local = at - middle, start = at + lifted;
    squared = std::max(squared, dot(local, local));
    position.set(k, local);
    origin[k] = {static_cast<float>(start.x), static_cast<float>(start.y), static_cast<float>(start.z)};
  }
  radius = static_cast<float>(std::sqrt(squared));
  lowest = 0;
}

void ReceiverColumns::fill_any(std::span<const Site> sites, std::span<const std::uint32_t> open,
                               const Surfaces& surfaces) {
  if (!is_flat) {
    facings.make_room(size);
    normals.make_room(size);
    Vec3 facing_sum, normal_sum;
    for (const std::uint32_t s : open) {
      facing_sum += sites[s].facing;
      normal_sum += sites[s].normal;
    }
    if (length(facing_sum) > 0) facing = normalized(facing_sum);
    if (length(normal_sum) > 0) normal = normalized(normal_sum);
  }
  double squared = 0, least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < size; ++k) {
    const Site& site = sites[open[k]];
    const Vec3 local = site.position - middle;
    squared = std::max(squared, dot(local, local));
    least = std::min(least, dot(local, facing));
    position.set(k, local);
    lift[k] = static_cast<float>(surfaces.ray_offsets[site.point.triangle]);
    origin[k] = lifted_origin(surfaces, site.position, site.facing, site.point.triangle);
    scale[k] = static_cast<float>(1 / (0.5 * (1 + dot(site.normal, site.facing))));
    if (is_flat) continue;
    facings.set(k, site.facing);
    normals.set(k, site.normal);
  }
  radius = static_cast<float>(std::sqrt(squared));
  lowest = static_cast<float>(least);
}

EmitterColumns::EmitterColumns(std::span<const Emitter> emitters) : size(emitters.size()) {
  const std::size_t whole = whole_lanes(size);
  double brightest = 0;
  for (const Emitter& emitter : emitters) brightest = std::max(brightest, max_component(emitter.exitance));
  s.make_room(whole);
  t.make_room(whole);
  normal.make_room(whole);
  for (std::size_t e = 0; e < whole; ++e) {
    const Emitter& emitter = emitters[e < size ? e : 0];
    corner_x.push_back(emitter.corner.x);
    corner_y.push_back(emitter.corner.y);
    corner_z.push_back(emitter.corner.z);
    normal_x.push_back(emitter.normal.x);
    normal_y.push_back(emitter.normal.y);
    normal_z.push_back(emitter.normal.z);
    s.set(e, emitter.s);
    t.set(e, emitter.t);
    normal.set(e, emitter.normal);
    area.push_back(static_cast<float>(emitter.area));
    exitance.push_back(static_cast<float>(max_component(emitter.exitance) / brightest));
    lift.push_back(emitter.lift);
    is_rectangle.push_back(emitter.is_rectangle());
    is_two_sided.push_back(emitter.is_two_sided);
  }
}

void SeenEmitters::make_room(std::size_t n) {
  const std::size_t whole = whole_lanes(n);
  if (height.size() >= whole) return;
  corner.make_room(whole);
  for (auto* column : {&height, &w00, &w10, &w01, &w11, &importance}) column->resize(whole);
  is_near.resize(whole);
}

void SampleColumns::make_room(std::size_t n) {
  const std::size_t whole = whole_lanes(n);
  if (x.size() >= whole) return;
  for (auto* column : {&x, &y, &per_probability, &weight, &a, &b}) column->resize(whole);
  for (auto* column : {&site, &emitter, &slot}) column->resize(whole);
  z.resize(whole);
  direction.make_room(whole);
}

void SampleColumns::pad(std::size_t n) {
  for (std::size_t k = n; k < whole_lanes(n); ++k) {
    x[k] = y[k] = 0;
    per_probability[k] = 0;
    site[k] = emitter[k] = slot[k] = 0;
  }
}

}  // namespace radbake::radiosity
